# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Slopes and depth at one resolution, and how they are read between pixels."""

from dataclasses import dataclass, replace
from functools import cached_property

import cv2
import numpy as np
from jaxtyping import Float, Float32, Int32

from recon.pose.rigid import Points
from sensor.toml import Pair

DETAIL_PX = 2.0


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

    @property
    def pitch_mm(self) -> Pair:
        """Between neighbours along x and y."""
        return float(self.x_mm[1] - self.x_mm[0]), float(self.y_mm[1] - self.y_mm[0])

    def place(self, points: Points) -> tuple[Float[np.ndarray, " n"], Float[np.ndarray, " n"]]:
        """Columns and rows of points, not rounded."""
        pitch_x, pitch_y = self.pitch_mm
        return (
            (points[:, 0] - np.float32(self.x_mm[0])) * np.float32(1 / pitch_x),
            (points[:, 1] - np.float32(self.y_mm[0])) * np.float32(1 / pitch_y),
        )

    @cached_property
    def detail(self) -> "Level":
        """The same slopes less their mean around: texture and edges, without the large shape."""
        mask = self.values[..., 3]
        slopes = self.values[..., :2]
        inner = (cv2.GaussianBlur(mask, (0, 0), DETAIL_PX) > 0.9) * mask  # a mean needs both sides
        fine = (slopes - blurred(slopes, mask, DETAIL_PX)) * inner[..., None]
        values = np.dstack([fine, np.zeros_like(mask), mask])
        return replace(self, values=values, samples=values)


def looked_up(level: Level, points: Points) -> Float32[np.ndarray, "n 4"]:
    """A level's values at points; zero outside the frame.

    Bilinear reading blurs more between pixels than on them, which bends a step such as an edge's
    toward where it happens to lie between them. So at full resolution the weights are those of a
    cubic B-spline, whose blur is the same everywhere (variance 1/3 pixel squared; Unser, IEEE
    Signal Processing Magazine 16(6), 1999). Coarser levels are smooth enough.
    """
    height, width = level.samples.shape[:2]
    x, y = level.place(points)
    weights = _bilinear if level.halvings else _cubic
    left, across = weights(x)
    top, down = weights(y)
    taps = len(across)
    inside = (left >= 0) & (top >= 0) & (left <= width - taps) & (top <= height - taps)
    flat = level.samples.reshape(-1, 4)
    place = (top * inside) * width + left * inside
    found = np.zeros((len(points), 4), np.float32)
    for row in range(taps):
        line = across[0][:, None] * flat[place]
        for column in range(1, taps):
            line += across[column][:, None] * flat[place + column]
        found += down[row][:, None] * line
        place = place + width
    return found * inside[:, None]


Taps = tuple[Int32[np.ndarray, " n"], list[Float32[np.ndarray, " n"]]]
"""The first pixel that a reading weighs, and the weights of it and its successors."""


def _bilinear(along: Float32[np.ndarray, " n"]) -> Taps:
    first = np.floor(along)
    share = along - first
    return first.astype(np.int32), [1 - share, share]


def _cubic(along: Float32[np.ndarray, " n"]) -> Taps:
    second = np.floor(along)
    share = along - second
    rest = 1 - share
    ends = [rest**3 / 6, share**3 / 6]
    inner = [2 / 3 - part**2 * (1 - part / 2) for part in (share, rest)]
    return second.astype(np.int32) - 1, [ends[0], *inner, ends[1]]


def blurred(
    values: Float32[np.ndarray, "h w c"], mask: Float32[np.ndarray, "h w"], sigma_px: float
) -> Float32[np.ndarray, "h w c"]:
    """A Gaussian mean over the pixels inside the mask."""
    share = np.maximum(cv2.GaussianBlur(mask, (0, 0), sigma_px), np.float32(1e-3))
    total = cv2.GaussianBlur(values * mask[..., None], (0, 0), sigma_px)
    blurred: Float32[np.ndarray, "h w c"] = total.reshape(values.shape) / share[..., None]
    return blurred
