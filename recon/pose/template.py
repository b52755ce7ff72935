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

from recon.kernels import compiled
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
HALF = np.float32(0.5)
LEAST_UPRIGHT = np.float32(0.1)
"""Upward part of a normal (Gx, Gy, 1) in the reference's frame; with less it shows its back."""


@dataclass(frozen=True, kw_only=True)
class Template:
    """Pixels of a reference at one level, and how motions change what is seen there.

    Every coordinate is laid out in one piece, and so is what every part of a twist changes.
    """

    points: Float32[np.ndarray, "n 3"]
    slopes: Float32[np.ndarray, "n 2"]
    change: Float32[np.ndarray, "6 3 n"]
    """Per part of a twist, of slope x, slope y and depth."""
    steepness: Float32[np.ndarray, " n"]
    """|(Gx, Gy, 1)|."""
    noise_change: Covariance
    """What white slope noise of unit variance adds to ``change.T @ change`` of the slopes."""
    depth_weight: float
    depth_doubt_mm2: float
    """Variance of an error that all depths share, besides noise."""

    def __post_init__(self) -> None:
        """Lay the arrays out."""
        for name in ("points", "slopes"):
            object.__setattr__(self, name, np.ascontiguousarray(getattr(self, name).T).T)
        for name in ("change", "steepness"):
            object.__setattr__(self, name, np.ascontiguousarray(getattr(self, name)))

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
            change=self.change[..., :: self.every],
            steepness=self.steepness[:: self.every],
        )

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
    moved = np.empty(points.shape[::-1], np.float32)
    _carry(points.T, T_current_reference.astype(np.float32), moved)
    return moved


def _take_carried(
    points: Float32[np.ndarray, "3 n"],
    motion: Float32[np.ndarray, "4 4"],
    moved: Float32[np.ndarray, "3 n"],
) -> None:
    """Multiply and add in one go."""
    for axis in range(3):
        x, y, z, shift = motion[axis]
        for k in range(points.shape[1]):
            moved[axis, k] = x * points[0, k] + y * points[1, k] + z * points[2, k] + shift


def residuals(
    template: Template, level: Level, guess: Transform
) -> tuple[Float32[np.ndarray, "3 n"], Bool[np.ndarray, " n"]]:
    """What is seen less what the guess predicts, in the reference's frame, and where both touch."""
    moved = carried(template.points, guess)
    residual, seen = np.empty(moved.shape, np.float32), np.empty(moved.shape[1], bool)
    turn, found = guess[:3, :3].astype(np.float32), looked_up(level, moved)
    slopes, steepness = template.slopes.T, template.steepness
    _residuals(turn, moved[2], found, slopes, steepness, residual, seen)
    return residual, seen


def _take_residuals(
    turn: Float32[np.ndarray, "3 3"],
    height_mm: Float32[np.ndarray, " n"],
    found: Float32[np.ndarray, "4 n"],
    slopes: Float32[np.ndarray, "2 n"],
    steepness: Float32[np.ndarray, " n"],
    residual: Float32[np.ndarray, "3 n"],
    seen: Bool[np.ndarray, " n"],
) -> None:
    """Turn the normals that are found back, and compare."""
    for k in range(len(seen)):
        x, y = found[0, k], found[1, k]
        upright = turn[0, 2] * x + turn[1, 2] * y + turn[2, 2]
        whole = max(upright, LEAST_UPRIGHT)
        residual[0, k] = (turn[0, 0] * x + turn[1, 0] * y + turn[2, 0]) / whole - slopes[0, k]
        residual[1, k] = (turn[0, 1] * x + turn[1, 1] * y + turn[2, 1]) / whole - slopes[1, k]
        aslant = steepness[k] / np.sqrt(np.float32(1) + x * x + y * y)
        residual[2, k] = (found[2, k] + height_mm[k]) * aslant
        seen[k] = (found[3, k] > HALF) & (upright > LEAST_UPRIGHT)


_carry, _residuals = compiled(_take_carried), compiled(_take_residuals)


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
        change=np.moveaxis(seen, -1, 0),
        steepness=np.linalg.norm(upright, axis=1),
        noise_change=_noise_change(points, level.pitch_mm),
        depth_weight=depth_weight,
        depth_doubt_mm2=depth_doubt_mm2,
    )


def sums_by_tile(
    rows: Float[np.ndarray, "k n"], tile: Int[np.ndarray, " n"], tiles: int
) -> Float[np.ndarray, "tiles k"]:
    """Sums of each row over the pixels of each tile."""
    sums = np.zeros((tiles, len(rows)))
    _sum_tiles(rows, tile, sums)
    return sums


def _take_tiles(
    rows: Float[np.ndarray, "k n"], tile: Int[np.ndarray, " n"], sums: Float[np.ndarray, "tiles k"]
) -> None:
    """Add each pixel to its tile."""
    for row in range(len(rows)):
        for k in range(len(tile)):
            sums[tile[k], row] += rows[row, k]


_sum_tiles = compiled(_take_tiles)


def _derivatives(
    values: Float32[np.ndarray, "h w"], mask: Float32[np.ndarray, "h w"], pitch_mm: Pair
) -> tuple[Float32[np.ndarray, "h w"], Float32[np.ndarray, "h w"]]:
    """Along x and y, of fourth order: a smoother one would see less of a thread's motion."""
    (whole,) = continued([values], mask)
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
