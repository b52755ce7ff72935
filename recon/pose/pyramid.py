# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""One touch at several resolutions: as what is looked at, and as a reference with derivatives.

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

from recon.arrays import ContactMask
from recon.integration.integrable import integrable
from recon.pose.level import Level, blurred, looked_up
from recon.pose.mesh import MeshTouch
from recon.pose.noise import Coarse, coarse, sums_in_waves, wave_variances
from recon.pose.registration import Touch, pixel_grid_mm
from recon.pose.rigid import Covariance, Points, Transform
from recon.windows import window_about
from sensor.toml import Pair

LEVELS = 3
FULL_RESOLUTION_PX = 4000
"""Contacts of fewer pixels are read at full resolution, larger ones at half."""
LEAST_PX = 40
"""Of a level that takes part."""
MOST_PX = 6000
CONTINUATION_SIGMA_PX = 1.0
CONTINUED_PX = 8
"""Beyond the contact, at full resolution."""
BESIDE_PX, BESIDE_SIGMA_PX = 3, 3.0
"""The gel right beside is so far beyond the contact: masks end before a gentle flank does."""
LEAST_BESIDE = 0.001
"""Share of that mean's weights on gel: with less, none is near."""
TILES = 5
"""Along each side of the contact."""
STENCIL = np.array([[1, -8, 0, 8, -1]], np.float32) / 12
ON_PIXEL = np.array([1, 4, 1], np.float32) / 6
"""Weights of a cubic B-spline at a pixel."""


@dataclass(frozen=True, kw_only=True)
class Template:
    """Pixels of a reference at one level, and how motions change what is seen there."""

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

    def thinned(self, every: int) -> "Template":
        """One of so many of its pixels."""
        return replace(
            self,
            points=self.points[::every],
            slopes=self.slopes[::every],
            change=self.change[:, ::every],
            steepness=self.steepness[::every],
        )

    @cached_property
    def tiles(self) -> Int[np.ndarray, " n"]:
        """Which of ``TILES`` x ``TILES`` tiles of the contact's extent each pixel lies in."""
        place = self.points[:, :2] - self.points[:, :2].min(0)
        column, row = np.minimum(
            place * (TILES / np.maximum(place.max(0), 1e-6)), TILES - 1
        ).T.astype(int)
        return row * TILES + column


class Pyramid:
    """One touch at all resolutions; as a reference, with its templates."""

    def __init__(self, touch: Touch) -> None:
        contact_px = int(np.count_nonzero(touch.contact))
        self.finest = 0 if contact_px < FULL_RESOLUTION_PX else 1
        self.touch = touch
        self._values = _values(touch, self.finest)
        self._coarse = _coarse_levels(touch, self._values)

    def level(self, halvings: int) -> Level:
        """The touch at one resolution."""
        return self._coarse[halvings - 1] if halvings else self._full

    @cached_property
    def _full(self) -> Level:
        return _full_level(self.touch, self._values)

    @cached_property
    def beside(self) -> Level:
        """Full resolution, with heights above the gel right beside the contact for depth.

        They run on across the outline, and are NaN where no gel is near.
        """
        rows, columns = _window(self.touch.contact, CONTINUED_PX)
        contact = self.touch.contact[rows, columns].astype(np.uint8)
        wide, narrow = (
            cv2.dilate(contact, cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (side, side)))
            for side in (2 * BESIDE_PX + 1, 2 * BESIDE_PX - 1)
        )
        ring = (wide - narrow).astype(np.float32)
        depth = self._values[rows, columns, 2]
        share = cv2.GaussianBlur(ring, (0, 0), BESIDE_SIGMA_PX)
        total = cv2.GaussianBlur(depth * ring, (0, 0), BESIDE_SIGMA_PX)
        height = depth - total / np.where(share > LEAST_BESIDE, share, np.nan)
        level = self.level(0)
        values, samples = level.values.copy(), level.samples.copy()
        values[..., 2] = cv2.sepFilter2D(height, -1, ON_PIXEL, ON_PIXEL)
        samples[..., 2] = height
        return replace(level, values=values, samples=samples)

    @cached_property
    def coarse(self) -> Coarse:
        """The touch in cells."""
        return coarse(self.touch)

    @cached_property
    def templates(self) -> dict[int, Template]:
        """By level, those of too few pixels left out, the coarsest first."""
        made = {
            index: _template(self.level(index), self.touch)
            for index in range(LEVELS - 1, self.finest - 1, -1)
        }
        return {index: item for index, item in made.items() if len(item.points) >= LEAST_PX}

    def pulls(self, depth_share: float) -> Float[np.ndarray, "l 6 6"]:
        """Covariances of what slope errors pull at a twist, of variance 1 by ``LENGTHS_MM``.

        That is ``change.T @ (weight * errors)`` of the finest template, with the depths above the
        still window's border, which count for a share of their weight. Where the frame cuts the
        contact off, nothing holds the depth.
        """
        both = np.concatenate([np.eye(6), depth_share * np.eye(6)])
        return both.T @ self._pulls @ both

    @cached_property
    def _pulls(self) -> Float[np.ndarray, "l 12 12"]:
        """The same of the slopes' sums, and behind them those of depths of their whole weight."""
        template, contact = self.templates[min(self.templates)], self.touch.contact
        window, pitch_mm = still_window(contact), self.touch.mm_per_px
        shape = contact[window].shape
        grid = pixel_grid_mm(contact.shape[::-1], pitch_mm)
        middle = [axis[span].mean() for axis, span in zip(grid, window[::-1], strict=True)]
        weights = np.array([[1, 1, 0], [0, 0, template.depth_weight]])
        shares = np.concatenate([template.change * part[:, None, None] for part in weights], -1)
        points = template.points - np.array([*middle, 0], np.float32)
        for axis, side, cut in _borders(contact):
            if cut:
                points, shares, shape = _mirrored(points, shares, shape, pitch_mm, axis, side)
        waves = sums_in_waves(points, shares, shape, pitch_mm)
        return (waves * wave_variances(shape, pitch_mm)[:, None]) @ waves.T


def residuals(
    template: Template, level: Level, guess: Transform
) -> tuple[Float32[np.ndarray, "3 n"], Bool[np.ndarray, " n"]]:
    """What is seen less what the guess predicts, in the reference's frame, and where both touch."""
    rotation = guess[:3, :3].astype(np.float32)
    moved = template.points @ rotation.T + guess[:3, 3].astype(np.float32)
    found = looked_up(level, moved)
    normal = np.concatenate([found[:, :2], np.ones_like(found[:, :1])], 1)
    back = normal @ rotation
    upright = back[:, 2] > 0.1
    slopes = back[:, :2] / np.where(upright, back[:, 2], 1.0)[:, None]
    gap = -found[:, 2] - moved[:, 2]
    depth = -gap * template.steepness / np.linalg.norm(normal, axis=1)
    residual = np.stack([*(slopes - template.slopes).T, depth])
    return residual, (found[:, 3] > 0.5) & upright


def _full_level(touch: Touch, values: Float32[np.ndarray, "h w 3"]) -> Level:
    """Every pixel; beside the contact the gel only follows, so it is continued from inside."""
    mask = touch.contact.astype(np.float32)
    height, width = mask.shape
    x_mm, y_mm = pixel_grid_mm((width, height), touch.mm_per_px)
    rows, columns = _window(touch.contact, CONTINUED_PX)
    mask, values = mask[rows, columns], values[rows, columns]
    samples = np.dstack([_continued(values, mask), mask])
    smoothed = cv2.sepFilter2D(samples, -1, ON_PIXEL, ON_PIXEL)
    smoothed[..., 3] = mask
    return Level(values=smoothed, samples=samples, x_mm=x_mm[columns], y_mm=y_mm[rows], halvings=0)


def _coarse_levels(touch: Touch, values: Float32[np.ndarray, "h w 3"]) -> list[Level]:
    """Halved again and again, from pixels of the contact alone."""
    mask = touch.contact.astype(np.float32)
    height, width = mask.shape
    x_mm, y_mm = pixel_grid_mm((width, height), touch.mm_per_px)
    levels = []
    for halvings in range(1, LEVELS):
        share = cv2.pyrDown(mask)
        total = cv2.pyrDown(values * mask[..., None])
        values = (total / np.maximum(share, 1e-3)[..., None]).astype(np.float32)
        mask = (share > 0.5).astype(np.float32)
        x_mm, y_mm = x_mm[::2], y_mm[::2]
        whole = np.dstack([values, mask])
        levels.append(Level(values=whole, samples=whole, x_mm=x_mm, y_mm=y_mm, halvings=halvings))
    return levels


def _values(touch: Touch, finest: int) -> Float32[np.ndarray, "h w 3"]:
    """Slopes of a surface, and depth above the gel that lies still around.

    What no depth can have is taken out of the slopes, as finely as they will be read. The gel
    around serves only by being continuous there, so its collar may follow as it likes.
    """
    values = np.dstack([touch.gradient, touch.depth_mm]).astype(np.float32)
    window = still_window(touch.contact)
    slopes = values[*window, :2]
    if finest == 0:
        slopes[:] = integrable(slopes, touch.mm_per_px)
    else:
        half = cv2.pyrDown(slopes)
        swirl = half - integrable(half, (2 * touch.mm_per_px[0], 2 * touch.mm_per_px[1]))
        slopes -= cv2.pyrUp(swirl, dstsize=slopes.shape[1::-1])
    still = np.ones_like(touch.contact[window])
    still[1:-1, 1:-1] = False
    still &= ~touch.contact[window]
    if still.any():
        values[..., 2] -= values[*window, 2][still].mean()
    return values


def still_window(contact: ContactMask) -> tuple[slice, slice]:
    """Rows and columns around the contact, as far as the root of its area.

    Around a disc that is 2.8 radii from its middle: there the collar has ended.
    """
    return _window(contact, round(np.sqrt(np.count_nonzero(contact))))


def _borders(contact: ContactMask) -> list[tuple[int, int, bool]]:
    """Of the frame's, the axis, the side (-1 or 1), and whether the contact reaches it."""
    return [
        (axis, side, bool(contact.take(0 if side < 0 else -1, 1 - axis).any()))
        for axis in (0, 1)
        for side in (-1, 1)
    ]


def _mirrored(
    points: Float[np.ndarray, "n 3"],
    shares: Float[np.ndarray, "3 n k"],
    shape: tuple[int, int],
    mm_per_px: Pair,
    axis: int,
    side: int,
) -> tuple[Float[np.ndarray, "m 3"], Float[np.ndarray, "3 m k"], tuple[int, int]]:
    """What sums over a window with one free border are in a window of twice its size.

    Depth with a free border is that of the window and its mirror image beyond the border. Errors
    of both are the same, so each wave has twice the variance that independent ones would have; and
    each half of the shares counts half.
    """
    size = [shape[1], shape[0]]
    once = points.astype(float)
    once[:, axis] -= side * size[axis] * mm_per_px[axis] / 2
    again, back = once.copy(), shares.copy()
    again[:, axis] *= -1
    back[axis] *= -1
    size[axis] *= 2
    both = np.concatenate([shares, back], 1) / np.sqrt(2)
    return np.concatenate([once, again]), both, (size[1], size[0])


def _window(contact: ContactMask, margin_px: int) -> tuple[slice, slice]:
    """Rows and columns of the contact with a margin; all of them where there is none."""
    return window_about(contact if contact.any() else np.ones_like(contact), margin_px)


def _template(level: Level, touch: Touch) -> Template:
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
        depth_weight=depth_weight(touch),
        depth_doubt_mm2=touch.unseen_mm**2 if isinstance(touch, MeshTouch) else 0.0,
    )


def _derivatives(
    values: Float32[np.ndarray, "h w"], mask: Float32[np.ndarray, "h w"], pitch_mm: Pair
) -> tuple[Float32[np.ndarray, "h w"], Float32[np.ndarray, "h w"]]:
    """Along x and y, of fourth order: a smoother one would see less of a thread's motion."""
    whole = _continued(values[..., None], mask)[..., 0]
    along_x, along_y = (cv2.filter2D(whole, -1, kernel) for kernel in (STENCIL, STENCIL.T))
    return along_x / np.float32(pitch_mm[0]), along_y / np.float32(pitch_mm[1])


def _continued(
    values: Float32[np.ndarray, "h w c"], mask: Float32[np.ndarray, "h w"]
) -> Float32[np.ndarray, "h w c"]:
    """The values inside the mask, continued to its outside."""
    outside = blurred(values, mask, CONTINUATION_SIGMA_PX)
    whole: Float32[np.ndarray, "h w c"] = np.where(mask[..., None] > 0, values, outside)
    return whole


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


def depth_weight(touch: Touch) -> float:
    """Weight of a depth residual (1/mm^2) beside slope residuals of weight 1.

    The mean depth over a disc of radius a in a zero ring of radius b, integrated from white slope
    noise s at a pitch h, has the variance ``h^2 s^2 (ln(b/a) + 1/4) / (2 pi)``: the potential of a
    charged disc, averaged over the disc. The ring is the border of the window.
    """
    contact_px = np.count_nonzero(touch.contact) + 1
    pitch_x, pitch_y = touch.mm_per_px
    ratio = max(np.sqrt(touch.contact[still_window(touch.contact)].size / contact_px), 1.0)
    spread = (np.log(ratio) + 0.25) / (2 * np.pi)
    return float(1 / (contact_px * pitch_x * pitch_y * spread))
