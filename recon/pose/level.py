# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Slopes and depth at one resolution, and how they are read between pixels."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import cv2
import numpy as np
from jaxtyping import Float, Float32

from recon.pose.rigid import Points
from sensor.toml import Pair

DETAIL_PX = 2.0
CONTINUATION_SIGMA_PX = 1.0
CUBIC = np.array([[1, -3, 3, -1], [4, 0, -6, 3], [1, 3, 3, -3], [0, 0, 0, 1]], np.float32) / 6
"""Weights of a cubic B-spline by powers of how far a point lies beyond the second of its pixels."""


@dataclass(frozen=True, kw_only=True)
class Level:
    """Slopes and depth at one resolution."""

    values: Float32[np.ndarray, "h w 4"]
    """Slopes, depth in mm, and 1 inside the contact, as read at the pixels."""
    samples: Float32[np.ndarray, "h w 4"]
    """What readings between pixels are weighed from; at full resolution not smoothed yet."""
    x_mm: Float[np.ndarray, " w"]
    y_mm: Float[np.ndarray, " h"]
    halvings: int

    @cached_property
    def pitch_mm(self) -> Pair:
        """Between neighbours along x and y."""
        return float(self.x_mm[1] - self.x_mm[0]), float(self.y_mm[1] - self.y_mm[0])

    def place(self, points: Points) -> Float32[np.ndarray, "2 n"]:
        """Columns and rows of points, not rounded."""
        (first, scale), across = self._grid, points[:, :2].T.astype(np.float32, copy=False)
        place: Float32[np.ndarray, "2 n"] = (across - first) * scale
        return place

    @cached_property
    def _grid(self) -> tuple[Float32[np.ndarray, "2 1"], Float32[np.ndarray, "2 1"]]:
        """Where the first column and row lie, and pixels per mm."""
        first = np.array([[self.x_mm[0]], [self.y_mm[0]]], np.float32)
        return first, np.float32(1) / np.array(self.pitch_mm, np.float32)[:, None]

    @cached_property
    def planes(self) -> Float32[np.ndarray, "4 hw"]:
        """The samples, map after map."""
        return np.ascontiguousarray(self.samples.reshape(-1, 4).T)

    @cached_property
    def detail(self) -> "Level":
        """The same slopes less their mean around: texture and edges, without the large shape."""
        mask = self.values[..., 3]
        slopes = self.values[..., :2]
        inner = (cv2.GaussianBlur(mask, (0, 0), DETAIL_PX) > 0.9) * mask  # a mean needs both sides
        fine = (slopes - blurred(slopes, mask, DETAIL_PX)) * inner[..., None]
        values = by_plane([fine[..., 0], fine[..., 1], np.zeros_like(mask), mask])
        return replace(self, values=values, samples=values)


def looked_up(level: Level, points: Points) -> Float32[np.ndarray, "n 4"]:
    """A level's values at points; zero outside the frame.

    Bilinear reading blurs more between pixels than on them, which bends a step such as an edge's
    toward where it happens to lie between them. So at full resolution the weights are those of a
    cubic B-spline, whose blur is the same everywhere (variance 1/3 pixel squared; Unser, IEEE
    Signal Processing Magazine 16(6), 1999). Coarser levels are smooth enough.

    Many points take long by their number, few by how often an array is touched: what is done for
    one map or one axis is done for all of them at once, and each lies in one piece.
    """
    height, width = level.samples.shape[:2]
    place = level.place(points)
    pixel = np.floor(place)
    across, down = (_bilinear if level.halvings else _cubic)(place - pixel).swapaxes(0, 1)
    taps = len(across)
    first = pixel.astype(np.int32) - (taps // 2 - 1)
    inside = ((first >= 0) & (first <= np.array([[width - taps], [height - taps]]))).all(0)
    left, top = first * inside
    share = (down[:, None] * across).reshape(taps * taps, -1)
    steps = np.add.outer(np.arange(taps) * width, np.arange(taps)).reshape(-1, 1)
    near = level.planes.take(top * width + left + steps, axis=1)
    near *= share * inside
    found: Float32[np.ndarray, "n 4"] = near.sum(1).T
    return found


def _bilinear(share: Float32[np.ndarray, "2 n"]) -> Float32[np.ndarray, "2 2 n"]:
    """Weights of the pixel before and of the one after, by axis."""
    return np.stack([1 - share, share])


def _cubic(share: Float32[np.ndarray, "2 n"]) -> Float32[np.ndarray, "4 2 n"]:
    """Weights of two pixels before and of two after, by axis."""
    powers = np.ones((4, *share.shape), np.float32)
    powers[1], powers[2] = share, share**2
    powers[3] = powers[2] * share
    return (CUBIC @ powers.reshape(4, -1)).reshape(powers.shape)


def by_plane(maps: Sequence[Float32[np.ndarray, "h w"]]) -> Float32[np.ndarray, "h w c"]:
    """Maps beside each other, each in one piece."""
    return np.moveaxis(np.stack(maps), 0, -1)


def blurred(
    values: Float32[np.ndarray, "h w c"], mask: Float32[np.ndarray, "h w"], sigma_px: float
) -> Float32[np.ndarray, "h w c"]:
    """A Gaussian mean over the pixels inside the mask."""
    share = np.maximum(cv2.GaussianBlur(mask, (0, 0), sigma_px), np.float32(1e-3))
    maps = np.moveaxis(values, -1, 0)
    return by_plane([cv2.GaussianBlur(item * mask, (0, 0), sigma_px) / share for item in maps])


def continued(
    values: Float32[np.ndarray, "h w c"], mask: Float32[np.ndarray, "h w"]
) -> Float32[np.ndarray, "h w c"]:
    """The values inside the mask, continued to its outside."""
    outside = blurred(values, mask, CONTINUATION_SIGMA_PX)
    whole: Float32[np.ndarray, "h w c"] = np.where(mask[..., None] > 0, values, outside)
    return whole
