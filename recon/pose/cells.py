# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""A touch in cells, and how slope errors of neighbouring pixels go together.

Colours are smoothed and lights drift, so errors of slopes are alike over several pixels, and the
longer, the less do many pixels tell more than a few. Errors are taken for a sum of white noise and
of white noise smoothed by Gaussians (``LENGTHS_MM``). How much there is of each shows in the means
over blocks of a few sizes of what two touches of one sensor differ by: beside both contacts as they
are, and within them once the motion is undone. White noise's mean over n pixels varies by 1 / n of
what one pixel does, and smooth noise's by nearly as much as one pixel, up to its length.
"""

from dataclasses import dataclass
from functools import cached_property, lru_cache

import cv2
import numpy as np
from jaxtyping import Bool, Float, Float32, Int
from scipy.optimize import nnls

from recon.arrays import GradientField
from recon.contact.mask import COLLAR_MM
from recon.kernels import compiled
from recon.pose.level import ALL, Level, looked_up
from recon.pose.registration import Touch
from recon.pose.rigid import Transform
from recon.pose.template import LEAST_UPRIGHT, carried
from sensor.toml import Pair

CELL_MM = 0.25
"""Noise is looked at and summed in cells so wide; a fine texture's waves still have several."""
SIDES = (1, 2, 4, 8)
"""Of blocks, in cells."""
LENGTHS_MM = (0.0, 0.125, 0.25, 0.5)
"""Standard deviations of the Gaussians: none, and half the side of all blocks but the largest."""
BESIDE_MM = 3 * COLLAR_MM
"""Gel farther from the contact than this does not follow it."""
LEAST_BLOCKS = 8
"""Blocks, below which their scatter is not told."""
MOST_BLOCKS = 1000
"""Blocks that tell the scatter as well as all would."""
FLAT = np.float32(3e-5)
"""Slopes that differ by less differ by rounding alone."""
RAYLEIGH_SQUARE = 2 * np.log(2)
"""Median of the squared length of two normal numbers of variance 1."""

Variances = Float[np.ndarray, "4"]
"""Of one slope's errors at one pixel, by ``LENGTHS_MM``."""


@dataclass(frozen=True, kw_only=True)
class Coarse:
    """A touch in cells."""

    gradient: Float32[np.ndarray, "r c 2"]
    """Mean slopes, as they were reconstructed."""
    depth_mm: Float32[np.ndarray, "r c"]
    """In their middle."""
    inside: Bool[np.ndarray, "r c"]
    """Cells whose corners lie within the contact."""
    apart: Bool[np.ndarray, "r c"]
    """Cells of gel that lies still."""
    x_mm: Float32[np.ndarray, " c"]
    y_mm: Float32[np.ndarray, " r"]
    side_px: tuple[int, int]
    mm_per_px: Pair

    @cached_property
    def level(self) -> Level:
        """The same, to be read between cells."""
        maps = cv2.merge((self.gradient, self.depth_mm, self.inside.astype(np.float32)))
        x_mm, y_mm = (axis.astype(float) for axis in (self.x_mm, self.y_mm))
        return Level(values=maps, samples=maps, x_mm=x_mm, y_mm=y_mm, halvings=1)

    @cached_property
    def held(
        self,
    ) -> tuple[Float32[np.ndarray, "n 3"], Int[np.ndarray, " n"], Int[np.ndarray, " n"]]:
        """Points of the cells inside the contact, in mm, and their rows and columns there."""
        rows, columns = np.nonzero(self.inside)
        depth_mm = self.depth_mm[rows, columns]
        points = np.stack([self.x_mm[columns], self.y_mm[rows], -depth_mm], -1)
        return points, rows - rows.min(), columns - columns.min()

    @cached_property
    def expected(self) -> Float32[np.ndarray, "n 2"]:
        """Slopes there."""
        return self.gradient[self.inside]


def coarse(touch: Touch) -> Coarse:
    """Take the means of a touch over cells; what is less than a cell at two borders is left out."""
    wide, high = cell_px(touch.mm_per_px)
    height, width = touch.contact.shape
    columns, rows = width // wide, height // high
    whole = slice(rows * high), slice(columns * wide)
    corners = [
        touch.contact[whole][row::high, column::wide]
        for row in {0, high - 1}
        for column in {0, wide - 1}
    ]
    touched = np.logical_or.reduce(corners).view(np.uint8)
    reach = [
        2 * int(np.ceil(BESIDE_MM / (side * pitch))) + 1
        for side, pitch in zip((high, wide), touch.mm_per_px[::-1], strict=True)
    ]
    x_mm, y_mm = (
        ((np.arange(cells) * side + (side - count) / 2) * pitch).astype(np.float32)
        for cells, side, count, pitch in zip(
            (columns, rows), (wide, high), (width, height), touch.mm_per_px, strict=True
        )
    )
    depth_mm = touch.depth_mm[whole][high // 2 :: high, wide // 2 :: wide]
    return Coarse(
        gradient=cv2.resize(
            np.ascontiguousarray(touch.gradient[whole], np.float32),
            (columns, rows),
            interpolation=cv2.INTER_AREA,
        ),
        depth_mm=depth_mm.astype(np.float32, copy=False),
        inside=np.logical_and.reduce(corners),
        apart=cv2.dilate(touched, np.ones(reach, np.uint8)) == 0,
        x_mm=x_mm,
        y_mm=y_mm,
        side_px=(wide, high),
        mm_per_px=touch.mm_per_px,
    )


def noise_between(
    reference: Coarse, current: Coarse, T_current_reference: Transform
) -> Variances | None:
    """Variances of the errors by which the slopes of two touches differ.

    Where gel beside the contacts and the surface within them say different things, the larger
    counts. Within small contacts nothing is looked at: their outlines and edges would be taken for
    noise. ``None`` where neither says anything: there is no such gel, or an estimator has taken it
    for flat.
    """
    apart = reference.apart & current.apart
    beside = _scatter(current.gradient - reference.gradient, apart)
    scatter = beside
    if np.count_nonzero(reference.inside) >= 4 * LEAST_BLOCKS:
        within = _scatter(*_left(reference, current, T_current_reference))
        if np.isfinite(within[1]):
            scatter = np.fmax(beside, within)
    known = int(np.count_nonzero(scatter > 0))
    if known < 2:
        return None
    shares = _scatter_of_noise(reference.side_px, reference.mm_per_px)[:known, :known]
    weight = 1 / (scatter[:known] * SIDES[:known])  # as many blocks tell it as closely
    found = np.zeros(len(LENGTHS_MM))
    found[:known] = nnls(shares * weight[:, None], scatter[:known] * weight)[0]
    return found


def cell_px(mm_per_px: Pair) -> tuple[int, int]:
    """Width and height of a cell."""
    return max(1, round(CELL_MM / mm_per_px[0])), max(1, round(CELL_MM / mm_per_px[1]))


def _left(
    reference: Coarse, current: Coarse, T_current_reference: Transform
) -> tuple[GradientField, Bool[np.ndarray, "r c"]]:
    """Slopes as seen less those that the motion predicts, and which lie within both contacts.

    In cells of the reference, around its contact.
    """
    points, rows, columns = reference.held
    found = looked_up(current.level, carried(points, T_current_reference))
    turn = T_current_reference[:3, :3].astype(np.float32)
    size = int(rows.max()) + 1, int(columns.max()) + 1
    difference, both = np.zeros((*size, 2), np.float32), np.zeros(size, bool)
    _differences(turn, found, reference.expected, rows, columns, difference, both)
    return difference, both


def _take_differences(
    turn: Float32[np.ndarray, "3 3"],
    found: Float32[np.ndarray, "4 n"],
    expected: Float32[np.ndarray, "n 2"],
    rows: Int[np.ndarray, " n"],
    columns: Int[np.ndarray, " n"],
    difference: GradientField,
    both: Bool[np.ndarray, "r c"],
) -> None:
    """Turn the normals that are found back, and put what they differ by into their cells."""
    for k in range(len(rows)):
        x, y, row, column = found[0, k], found[1, k], rows[k], columns[k]
        upright = max(turn[0, 2] * x + turn[1, 2] * y + turn[2, 2], LEAST_UPRIGHT)
        for axis in range(2):
            across = turn[0, axis] * x + turn[1, axis] * y + turn[2, axis]
            difference[row, column, axis] = across / upright - expected[k, axis]
        both[row, column] = found[3, k] > ALL


def _scatter(difference: GradientField, counted: Bool[np.ndarray, "r c"]) -> Float[np.ndarray, "4"]:
    """Variance of a slope's mean over blocks by ``SIDES``, robust; NaN where there are too few."""
    found, squares = np.full(len(SIDES), np.nan), np.empty(counted.size, np.float32)
    for index, side in enumerate(SIDES):
        count = _squares(difference, counted, side, squares)
        if count < LEAST_BLOCKS:
            break
        some = squares[: count : -(-count // MOST_BLOCKS)]
        half = len(some) // 2
        found[index] = np.partition(some, half)[half] / RAYLEIGH_SQUARE
    return found


def _take_squares(
    difference: GradientField,
    counted: Bool[np.ndarray, "r c"],
    side: int,
    squares: Float32[np.ndarray, " n"],
) -> int:
    """Squared lengths of means over blocks that count as a whole; how many they are.

    Gel taken for flat tells nothing.
    """
    count = 0
    for top in range(0, counted.shape[0] - side + 1, side):
        for left in range(0, counted.shape[1] - side + 1, side):
            x = y = np.float32(0)
            whole = True
            for row in range(top, top + side):
                for column in range(left, left + side):
                    along_x, along_y = difference[row, column]
                    some = abs(along_x) + abs(along_y) > FLAT
                    whole &= counted[row, column] & some
                    x += along_x
                    y += along_y
            if whole:
                squares[count] = (x * x + y * y) / np.float32(side**4)
                count += 1
    return count


_differences, _squares = compiled(_take_differences), compiled(_take_squares)


@lru_cache(maxsize=8)
def _scatter_of_noise(side_px: tuple[int, int], mm_per_px: Pair) -> Float[np.ndarray, "s l"]:
    """Variance of the mean over blocks by ``SIDES`` of noise by ``LENGTHS_MM``, of variance 1."""

    def along(count: int, length_px: float) -> float:
        away = np.arange(1 - count, count)
        alike = np.exp(-((away / 2 / length_px) ** 2)) if length_px else away == 0
        return float(((count - np.abs(away)) * alike).sum() / count**2)

    return np.array(
        [
            [
                along(side * side_px[0], length_mm / mm_per_px[0])
                * along(side * side_px[1], length_mm / mm_per_px[1])
                for length_mm in LENGTHS_MM
            ]
            for side in SIDES
        ]
    )
