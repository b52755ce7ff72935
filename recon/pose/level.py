# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Slopes and depth at one resolution, and how they are read between pixels."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import cv2
import numpy as np
from jaxtyping import Float, Float32

from recon.kernels import compiled
from recon.pose.rigid import Points
from sensor.toml import Pair

DETAIL_PX = 2.0
ALL = 0.999
"""Of a share that is read between pixels, but for rounding."""
LEAST_AROUND = 0.9
"""Of a mean's weights, to be one of both sides."""
CONTINUATION_SIGMA_PX = 1.0


@dataclass(frozen=True, kw_only=True)
class Level:
    """Slopes and depth at one resolution."""

    values: Float32[np.ndarray, "h w 4"]
    """Slopes, depth in mm, and 1 inside the contact, as read at the pixels."""
    samples: Float32[np.ndarray, "h w 4"]
    """What readings between pixels are weighed from; at full resolution not smoothed yet.

    In one piece, pixel after pixel.
    """
    x_mm: Float[np.ndarray, " w"]
    y_mm: Float[np.ndarray, " h"]
    halvings: int

    @cached_property
    def pitch_mm(self) -> Pair:
        """Between neighbours along x and y."""
        return float(self.x_mm[1] - self.x_mm[0]), float(self.y_mm[1] - self.y_mm[0])

    @cached_property
    def contact_px(self) -> int:
        """Of the contact."""
        return int(np.count_nonzero(self.values[..., 3]))

    def place(self, points: Points) -> Float32[np.ndarray, "2 n"]:
        """Columns and rows of points, not rounded."""
        (first_mm, px_per_mm), across = self.grid, points[:, :2].T.astype(np.float32, copy=False)
        place: Float32[np.ndarray, "2 n"] = (across - first_mm[:, None]) * px_per_mm[:, None]
        return place

    @cached_property
    def grid(self) -> Float32[np.ndarray, "2 2"]:
        """Along x and y, where the first pixel lies, and how many lie in a millimetre."""
        (pitch_x, pitch_y), first = self.pitch_mm, (self.x_mm[0], self.y_mm[0])
        return np.array([first, (1 / pitch_x, 1 / pitch_y)], np.float32)

    @cached_property
    def detail(self) -> "Level":
        """The same slopes less their mean around: texture and edges, without the large shape."""
        *slopes, _, mask = cv2.split(self.values)
        share = cv2.GaussianBlur(mask, (0, 0), DETAIL_PX)
        inner = (share > LEAST_AROUND) * mask
        fine = [
            (item - mean) * inner
            for item, mean in zip(slopes, blurred(slopes, mask, DETAIL_PX, share), strict=True)
        ]
        values = cv2.merge([*fine, np.zeros_like(mask), mask])
        return replace(self, values=values, samples=values)


def looked_up(level: Level, points: Float32[np.ndarray, "3 n"]) -> Float32[np.ndarray, "4 n"]:
    """A level's values at points; zero outside the frame.

    Bilinear reading blurs more between pixels than on them, which bends a step such as an edge's
    toward where it happens to lie between them. So at full resolution the weights are those of a
    cubic B-spline, whose blur is the same everywhere (variance 1/3 pixel squared; Unser, IEEE
    Signal Processing Magazine 16(6), 1999). Coarser levels are smooth enough.
    """
    found = np.empty((4, points.shape[1]), np.float32)
    (_linear if level.halvings else _cubic)(level.samples, level.grid, points, found)
    return found


def _take_linear(
    samples: Float32[np.ndarray, "h w 4"],
    grid: Float32[np.ndarray, "2 2"],
    points: Float32[np.ndarray, "3 n"],
    found: Float32[np.ndarray, "4 n"],
) -> None:
    """Read from the two pixels around along each axis."""
    height, width = samples.shape[:2]
    flat, one, pixel = samples.reshape(-1), np.float32(1), np.uintp(4)
    for k in range(points.shape[1]):
        x = (points[0, k] - grid[0, 0]) * grid[1, 0]
        y = (points[1, k] - grid[0, 1]) * grid[1, 1]
        left, top = int(np.floor(x)), int(np.floor(y))
        if left < 0 or top < 0 or left > width - 2 or top > height - 2:
            found[:, k] = 0
            continue
        x, y = x - np.float32(left), y - np.float32(top)
        above = np.uintp(4 * (top * width + left))
        below = above + np.uintp(4 * width)
        for channel in range(4):
            c = np.uintp(channel)
            found[channel, k] = (one - y) * (
                (one - x) * flat[above + c] + x * flat[above + pixel + c]
            ) + y * ((one - x) * flat[below + c] + x * flat[below + pixel + c])


def _take_weights(
    share: np.float32,
) -> tuple[np.float32, np.float32, np.float32, np.float32]:
    """Of a cubic B-spline for two pixels before a point, the second by so much, and two after."""
    rest, sixth = np.float32(1) - share, np.float32(1 / 6)
    square, cube = share * share, share * share * share
    return (
        rest * rest * rest * sixth,
        (np.float32(4) - np.float32(6) * square + np.float32(3) * cube) * sixth,
        (np.float32(1) + np.float32(3) * (share + square - cube)) * sixth,
        cube * sixth,
    )


def _take_cubic(
    samples: Float32[np.ndarray, "h w 4"],
    grid: Float32[np.ndarray, "2 2"],
    points: Float32[np.ndarray, "3 n"],
    found: Float32[np.ndarray, "4 n"],
) -> None:
    """Read from the four pixels around along each axis."""
    height, width = samples.shape[:2]
    flat, nothing = samples.reshape(-1), np.float32(0)
    for k in range(points.shape[1]):
        x = (points[0, k] - grid[0, 0]) * grid[1, 0]
        y = (points[1, k] - grid[0, 1]) * grid[1, 1]
        left, top = int(np.floor(x)) - 1, int(np.floor(y)) - 1
        if left < 0 or top < 0 or left > width - 4 or top > height - 4:
            found[:, k] = 0
            continue
        across, down = _weights(x - np.float32(left + 1)), _weights(y - np.float32(top + 1))
        row = np.uintp(4 * (top * width + left))
        a = b = c = d = nothing
        for j in range(4):
            for i in range(4):
                share, at = down[j] * across[i], row + np.uintp(4 * i)
                a += share * flat[at]
                b += share * flat[at + np.uintp(1)]
                c += share * flat[at + np.uintp(2)]
                d += share * flat[at + np.uintp(3)]
            row += np.uintp(4 * width)
        found[0, k], found[1, k], found[2, k], found[3, k] = a, b, c, d


_weights = compiled(_take_weights)
_linear, _cubic = compiled(_take_linear), compiled(_take_cubic)


def blurred(
    maps: Sequence[Float32[np.ndarray, "h w"]],
    mask: Float32[np.ndarray, "h w"],
    sigma_px: float,
    share: Float32[np.ndarray, "h w"] | None = None,
) -> list[Float32[np.ndarray, "h w"]]:
    """Gaussian means over the pixels inside the mask.

    Args:
        maps: any number.
        mask: 1 inside, else 0.
        sigma_px: of the Gaussian.
        share: the mask's own mean, where it is known.
    """
    if share is None:
        share = cv2.GaussianBlur(mask, (0, 0), sigma_px)
    share = np.maximum(share, np.float32(1e-3))
    return [cv2.GaussianBlur(item * mask, (0, 0), sigma_px) / share for item in maps]


def continued(
    maps: Sequence[Float32[np.ndarray, "h w"]], mask: Float32[np.ndarray, "h w"]
) -> list[Float32[np.ndarray, "h w"]]:
    """The maps inside the mask, continued to its outside."""
    inside = mask > 0
    outside = blurred(maps, mask, CONTINUATION_SIGMA_PX)
    return [np.where(inside, *both) for both in zip(maps, outside, strict=True)]
