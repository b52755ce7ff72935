# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""One touch at several resolutions: as what is looked at, and as a reference with derivatives."""

from dataclasses import replace
from functools import cached_property

import cv2
import numpy as np
from jaxtyping import Float, Float32, Shaped
from scipy.fft import next_fast_len

from recon.arrays import ContactMask
from recon.integration.integrable import integrable
from recon.pose.cells import Coarse, coarse
from recon.pose.level import Level, continued, looked_up
from recon.pose.mesh import MeshTouch
from recon.pose.noise import sums_in_waves, wave_variances
from recon.pose.registration import Touch, pixel_grid_mm
from recon.pose.rest import rest_under
from recon.pose.template import Template, template_of
from recon.windows import window_about
from sensor.toml import Pair

LEVELS = 3
FULL_RESOLUTION_PX = 4000
"""Contacts of fewer pixels are read at full resolution, larger ones at half."""
LEAST_PX = 40
"""Of a level that takes part."""
CONTINUED_PX = 8
"""Beyond the contact, at full resolution."""
BESIDE_PX, BESIDE_SIGMA_PX = 3, 3.0
"""The gel right beside is so far beyond the contact: masks end before a gentle flank does."""
LEAST_BESIDE = 0.001
"""Share of that mean's weights on gel: with less, none is near."""
COARSEST = 2 ** (LEVELS - 1)
BESIDE_COARSE_PX = 6 * COARSEST
"""Around the contact, of coarse levels: gel farther away goes into no pixel of it."""
ON_PIXEL = np.array([1, 4, 1], np.float32) / 6
"""Weights of a cubic B-spline at a pixel."""


class Pyramid:
    """One touch at all resolutions; as a reference, with its templates."""

    def __init__(self, touch: Touch) -> None:
        contact_px = int(np.count_nonzero(touch.contact))
        self.finest = 0 if contact_px < FULL_RESOLUTION_PX else 1
        self.touch = touch
        self._values = _values(touch, self.finest)
        self._coarse = _coarse_levels(touch, self._values)
        self._details: dict[int, Float32[np.ndarray, "2 n"]] = {}

    def level(self, halvings: int) -> Level:
        """The touch at one resolution."""
        return self._coarse[halvings - 1] if halvings else self._full

    @cached_property
    def _full(self) -> Level:
        return _full_level(self.touch, self._values)

    @cached_property
    def beside(self) -> Level:
        """Full resolution, with heights above the gel right beside the contact for depth.

        They run on across the outline. The last map says where gel is near: 1 there, else 0.
        """
        rows, columns = _window(self.touch.contact, CONTINUED_PX)
        contact = self.touch.contact[rows, columns].astype(np.uint8)
        wide, narrow = (
            cv2.dilate(contact, cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (side, side)))
            for side in (2 * BESIDE_PX + 1, 2 * BESIDE_PX - 1)
        )
        ring = (wide - narrow).astype(np.float32)
        rest = rest_under(self.touch)
        rest_mm = 0 if rest is None else rest.depth_mm[rows, columns]
        depth = self._values[2][rows, columns] - rest_mm
        share = cv2.GaussianBlur(ring, (0, 0), BESIDE_SIGMA_PX)
        total = cv2.GaussianBlur(depth * ring, (0, 0), BESIDE_SIGMA_PX)
        level, near = self.level(0), share > LEAST_BESIDE
        samples = level.samples.copy()
        samples[..., 2] = (depth - total / np.maximum(share, LEAST_BESIDE) + rest_mm) * near
        samples[..., 3] = near
        values = cv2.sepFilter2D(samples, -1, ON_PIXEL, ON_PIXEL)
        return replace(level, values=values, samples=samples)

    @cached_property
    def coarse(self) -> Coarse:
        """The touch in cells."""
        return coarse(self.touch)

    @cached_property
    def templates(self) -> dict[int, Template]:
        """By level, those of too few pixels left out, the coarsest first."""
        weight, touch = depth_weight(self.touch), self.touch
        doubt_mm2 = touch.unseen_mm**2 if isinstance(touch, MeshTouch) else 0.0
        made = {
            index: template_of(self.level(index), weight, doubt_mm2)
            for index in range(LEVELS - 1, self.finest - 1, -1)
        }
        return {index: item for index, item in made.items() if len(item.points) >= LEAST_PX}

    def details(self, halvings: int) -> Float32[np.ndarray, "2 n"]:
        """Texture and edges at the pixels of a template."""
        if halvings not in self._details:
            points = self.templates[halvings].points
            self._details[halvings] = looked_up(self.level(halvings).detail, points.T)[:2]
        return self._details[halvings]

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
        change = np.moveaxis(template.change, 0, -1)
        shares = np.concatenate([change * part[:, None, None] for part in weights], -1)
        points = template.points - np.array([*middle, 0], np.float32)
        for axis, side in _cut_by(contact):
            points, shares, shape = _mirrored(points, shares, shape, pitch_mm, axis, side)
        waves = sums_in_waves(points, shares, shape, pitch_mm)
        return (waves * wave_variances(shape, pitch_mm)[:, None]) @ waves.T


def _full_level(touch: Touch, values: list[Float32[np.ndarray, "h w"]]) -> Level:
    """Every pixel; beside the contact the gel only follows, so it is continued from inside."""
    x_mm, y_mm = pixel_grid_mm(touch.contact.shape[::-1], touch.mm_per_px)
    rows, columns = _window(touch.contact, CONTINUED_PX)
    mask = touch.contact[rows, columns].astype(np.float32)
    samples = cv2.merge([*continued([item[rows, columns] for item in values], mask), mask])
    smoothed = cv2.sepFilter2D(samples, -1, ON_PIXEL, ON_PIXEL)
    smoothed[..., 3] = mask
    return Level(values=smoothed, samples=samples, x_mm=x_mm[columns], y_mm=y_mm[rows], halvings=0)


def _coarse_levels(touch: Touch, values: list[Float32[np.ndarray, "h w"]]) -> list[Level]:
    """Halved again and again, from pixels of the contact alone."""
    x_mm, y_mm = pixel_grid_mm(touch.contact.shape[::-1], touch.mm_per_px)
    rows, columns = (
        slice(part.start // COARSEST * COARSEST, part.stop)
        for part in _window(touch.contact, BESIDE_COARSE_PX)
    )
    x_mm, y_mm = x_mm[columns], y_mm[rows]
    mask = touch.contact[rows, columns].astype(np.float32)
    maps = [item[rows, columns] for item in values]
    levels = []
    for halvings in range(1, LEVELS):
        share = cv2.pyrDown(mask)
        counted = np.maximum(share, np.float32(1e-3))
        maps = [cv2.pyrDown(item * mask) / counted for item in maps]
        mask = (share > 0.5).astype(np.float32)
        x_mm, y_mm = x_mm[::2], y_mm[::2]
        whole = cv2.merge([*maps, mask])
        levels.append(Level(values=whole, samples=whole, x_mm=x_mm, y_mm=y_mm, halvings=halvings))
    return levels


def _values(touch: Touch, finest: int) -> list[Float32[np.ndarray, "h w"]]:
    """Slopes of a surface, and depth above the gel that lies still around; zero beyond that.

    What no depth can have is taken out of the slopes, as finely as they will be read. The gel
    around serves only by being continuous there, so its collar may follow as it likes.
    """
    window, contact, rest = still_window(touch.contact), touch.contact, rest_under(touch)
    gradient = touch.gradient[window].astype(np.float32, copy=False)
    depth_mm = touch.depth_mm[window].astype(np.float32, copy=False)
    if rest is not None:
        gradient, depth_mm = gradient - rest.gradient[window], depth_mm - rest.depth_mm[window]
    if finest == 0:
        slopes = cv2.split(integrable(gradient, touch.mm_per_px))
    else:
        slopes = cv2.split(gradient)
        half = np.dstack([cv2.pyrDown(item) for item in slopes])
        swirl = half - integrable(half, (2 * touch.mm_per_px[0], 2 * touch.mm_per_px[1]))
        size_px = slopes[0].shape[::-1]
        slopes = [
            item - cv2.pyrUp(part, dstsize=size_px)
            for item, part in zip(slopes, cv2.split(swirl), strict=True)
        ]
    still_mm = _border(depth_mm)[~_border(contact[window])]
    above = depth_mm - (still_mm.mean() if len(still_mm) else 0)
    if rest is not None:
        slopes = [
            item + part for item, part in zip(slopes, cv2.split(rest.gradient[window]), strict=True)
        ]
        above = above + rest.depth_mm[window]
    return [_framed(item, window, contact.shape) for item in (*slopes, above)]


def _border(whole: Shaped[np.ndarray, "r c"]) -> Shaped[np.ndarray, " n"]:
    """The outermost pixels."""
    return np.concatenate([whole[0], whole[-1], whole[1:-1, 0], whole[1:-1, -1]])


def _framed(
    inside: Float32[np.ndarray, "r c"], window: tuple[slice, slice], shape: tuple[int, int]
) -> Float32[np.ndarray, "h w"]:
    """A map of a whole frame, zero outside a window."""
    if inside.shape == shape:
        return inside
    whole = np.zeros(shape, np.float32)
    whole[window] = inside
    return whole


def still_window(contact: ContactMask) -> tuple[slice, slice]:
    """Rows and columns around the contact, as far as the root of its area.

    Around a disc that is 2.8 radii from its middle: there the collar has ended.
    """
    margin_px = round(np.sqrt(np.count_nonzero(contact)))
    rows, columns = (
        _widened(span, count)
        for span, count in zip(_window(contact, margin_px), contact.shape, strict=True)
    )
    return rows, columns


def _widened(span: slice, count: int) -> slice:
    """A span of so many pixels in all, of a length whose transform is fast, as is its half's."""
    wanted = 2 * next_fast_len(-(-(span.stop - span.start) // 2), real=True)
    start = min(max(span.start - (wanted - span.stop + span.start) // 2, 0), max(count - wanted, 0))
    return slice(start, min(start + wanted, count))


def _cut_by(contact: ContactMask) -> list[tuple[int, int]]:
    """The frame's borders that the contact reaches: axis (0 is x) and side (-1 or 1) of each."""
    return [
        (axis, side)
        for axis in (0, 1)
        for side, index in ((-1, 0), (1, -1))
        if contact.take(index, 1 - axis).any()
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
