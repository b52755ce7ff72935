# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Pixels of a reference at one resolution, and how motions change what is seen there.

A rigid motion with twist (w, v) moves the point p = (x, y, -d) of the skin by u = w x p + v. With
m = (Gx, Gy, 1), the depth seen at a fixed pixel then changes by ``-u . m``, and the slopes seen
there by the derivatives of that along x and y::

    depth    -[p x m, m] . (w, v)
    slope x  -[p_x x m + p x m_x, m_x] . (w, v)      p_x = (1, 0, -Gx), m_x = dm/dx
    slope y  -[p_y x m + p x m_y, m_y] . (w, v)      p_y = (0, 1, -Gy), m_y = dm/dy
"""

from dataclasses import dataclass, replace
from functools import cached_property

import cv2
import numpy as np
from jaxtyping import Bool, Float, Float32, Int

from recon.pose.level import Level, continued, looked_up
from recon.pose.registration import prior_root
from recon.pose.rigid import Covariance, Points, Transform
from sensor.toml import Pair

MOST_PX = 6000
FEW = 1000
"""Pixels at most that tell whether what derivatives say of a motion is seen."""
TILES = 5
"""Along each side of the contact."""
STENCIL = np.array([[1, -8, 0, 8, -1]], np.float32) / 12
LEAST_UPRIGHT = np.float32(0.1)
"""Upward part of a normal (Gx, Gy, 1) in the reference's frame; with less it shows its back."""


@dataclass(frozen=True, kw_only=True)
class Template:
    """Pixels of a reference at one level, and how motions change what is seen there.

    Every coordinate, and every part of a twist, is laid out in one piece.
    """

    points: Float32[np.ndarray, "n 3"]
    slopes: Float32[np.ndarray, "n 2"]
    change: Float32[np.ndarray, "3 n 6"]
    """Of slope x, slope y and depth, per twist."""
    steepness: Float32[np.ndarray, " n"]
    """|(Gx, Gy, 1)|."""
    noise_change: Covariance
    """What white slope noise of unit variance adds to ``change.T @ change`` of the slopes."""
    depth_weight: float
    depth_doubt_mm2: float
    """Variance of an error that all depths share, besides noise."""

    def __post_init__(self) -> None:
        """Lay the arrays out."""
        for name in ("points", "slopes", "change"):
            object.__setattr__(self, name, _last_axis_outermost(getattr(self, name)))

    @property
    def every(self) -> int:
        """One of so many pixels is one of ``few``."""
        return max(1, -(-len(self.points) // FEW))

    @cached_property
    def few(self) -> "Template":
        """Each pixel, or each second, third and so on."""
        return replace(
            self,
            points=self.points[:: self.every],
            slopes=self.slopes[:: self.every],
            change=self.change[:, :: self.every],
            steepness=self.steepness[:: self.every],
        )

    @cached_property
    def by_twist(self) -> Float32[np.ndarray, "6 m"]:
        """``change`` of all pixels, slopes and depth one after another."""
        return np.moveaxis(self.change, -1, 0).reshape(6, -1)

    @cached_property
    def prior(self) -> Covariance:
        """A root of the prior; in its units that is the identity."""
        return prior_root(self.points.mean(0).astype(float))

    @cached_property
    def rigidity(self) -> Covariance:
        """What the prior adds to normal equations whose residuals have a variance of 1."""
        back = np.linalg.inv(self.prior)
        rigidity: Covariance = back.T @ back
        return rigidity

    @cached_property
    def tiles(self) -> Int[np.ndarray, " n"]:
        """Which of ``TILES`` x ``TILES`` tiles of the contact's extent each pixel lies in."""
        place = self.points[:, :2] - self.points[:, :2].min(0)
        column, row = np.minimum(
            place * (TILES / np.maximum(place.max(0), 1e-6)), TILES - 1
        ).T.astype(int)
        return row * TILES + column


def carried(
    points: Float32[np.ndarray, "n 3"], T_current_reference: Transform
) -> Float32[np.ndarray, "3 n"]:
    """Where a motion puts points, coordinate by coordinate."""
    motion = T_current_reference.astype(np.float32)
    moved: Float32[np.ndarray, "3 n"] = motion[:3, :3] @ points.T + motion[:3, 3:]
    return moved


def residuals(
    template: Template, level: Level, guess: Transform
) -> tuple[Float32[np.ndarray, "3 n"], Bool[np.ndarray, " n"]]:
    """What is seen less what the guess predicts, in the reference's frame, and where both touch."""
    rotation, moved = guess[:3, :3].astype(np.float32), carried(template.points, guess)
    found = looked_up(level, moved.T).T
    slope_x, slope_y, depth_mm, touched = found
    back = rotation[:2].T @ found[:2] + rotation[2][:, None]
    steepness = np.sqrt(1 + slope_x**2 + slope_y**2)
    residual = np.empty((3, len(template.points)), np.float32)
    np.subtract(back[:2] / np.maximum(back[2], LEAST_UPRIGHT), template.slopes.T, residual[:2])
    np.multiply(depth_mm + moved[2], template.steepness / steepness, residual[2])
    return residual, (touched > 0.5) & (back[2] > LEAST_UPRIGHT)


def template_of(level: Level, depth_weight: float, depth_doubt_mm2: float) -> Template:
    """The pixels of a contact at one resolution.

    Args:
        level: one resolution of a touch.
        depth_weight: as in ``Template``.
        depth_doubt_mm2: as in ``Template``.
    """
    mask = level.values[..., 3]
    rows, columns = np.nonzero(mask)
    keep = slice(None, None, max(1, -(-len(rows) // MOST_PX)))
    rows, columns = rows[keep], columns[keep]
    second = [_derivatives(level.values[..., axis], mask, level.pitch_mm) for axis in (0, 1)]
    xx, yy = second[0][0][rows, columns], second[1][1][rows, columns]
    xy = (second[0][1][rows, columns] + second[1][0][rows, columns]) / 2
    slope_x, slope_y, depth, _ = level.values[rows, columns].T
    zero, one = np.zeros_like(depth), np.ones_like(depth)
    points = np.stack([level.x_mm[columns], level.y_mm[rows], -depth], -1).astype(np.float32)
    upright = np.stack([slope_x, slope_y, one], -1)

    def change(along: np.ndarray, bend: np.ndarray) -> np.ndarray:
        turn = np.cross(along, upright) + np.cross(points, bend)
        return -np.concatenate([turn, bend], -1)

    seen = np.stack(
        [
            change(np.stack([one, zero, -slope_x], -1), np.stack([xx, xy, zero], -1)),
            change(np.stack([zero, one, -slope_y], -1), np.stack([xy, yy, zero], -1)),
            -np.concatenate([np.cross(points, upright), upright], -1),
        ]
    ).astype(np.float32)
    return Template(
        points=points,
        slopes=upright[:, :2],
        change=seen,
        steepness=np.linalg.norm(upright, axis=1),
        noise_change=_noise_change(points, level.pitch_mm),
        depth_weight=depth_weight,
        depth_doubt_mm2=depth_doubt_mm2,
    )


def sums_by_tile(
    rows: Float[np.ndarray, "k n"], tile: Int[np.ndarray, " n"], tiles: int
) -> Float[np.ndarray, "tiles k"]:
    """Sums of each row over the pixels of each tile."""
    count = len(rows)
    place = tile + tiles * np.arange(count)[:, None]
    sums = np.bincount(place.reshape(-1), rows.reshape(-1), minlength=count * tiles)
    return sums.reshape(count, tiles).T


def _last_axis_outermost(array: np.ndarray) -> np.ndarray:
    """The same array, in memory by its last axis first."""
    return np.moveaxis(np.ascontiguousarray(np.moveaxis(array, -1, 0)), 0, -1)


def _derivatives(
    values: Float32[np.ndarray, "h w"], mask: Float32[np.ndarray, "h w"], pitch_mm: Pair
) -> tuple[Float32[np.ndarray, "h w"], Float32[np.ndarray, "h w"]]:
    """Along x and y, of fourth order: a smoother one would see less of a thread's motion."""
    whole = continued(values[..., None], mask)[..., 0]
    along_x, along_y = (cv2.filter2D(whole, -1, kernel) for kernel in (STENCIL, STENCIL.T))
    return along_x / np.float32(pitch_mm[0]), along_y / np.float32(pitch_mm[1])


def _noise_change(points: Points, pitch_mm: Pair) -> Covariance:
    impulse = np.zeros((21, 21), np.float32)
    impulse[10, 10] = 1
    along_x, along_y = _derivatives(impulse, np.ones_like(impulse), pitch_mm)
    total = np.zeros((6, 6))
    for axis, energy in ((0, (along_x**2).sum()), (1, (along_y**2).sum())):
        unit = np.zeros(3)
        unit[axis] = 1
        rows = np.concatenate([np.cross(points, unit), np.broadcast_to(unit, points.shape)], -1)
        total += 2 * float(energy) * rows.T @ rows
    return total
