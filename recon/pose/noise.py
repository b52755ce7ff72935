# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""How slope errors of neighbouring pixels go together, and what sums of slopes and depths vary by.

Colours are smoothed and lights drift, so errors of slopes are alike over several pixels, and the
longer, the less do many pixels tell more than a few. Errors are taken for a sum of white noise and
of white noise smoothed by Gaussians (``LENGTHS_MM``). How much there is of each shows in the means
over blocks of a few sizes of what two touches of one sensor differ by: beside both contacts as they
are, and within them once the motion is undone. White noise's mean over n pixels varies by 1 / n of
what one pixel does, and smooth noise's by nearly as much as one pixel, up to its length.
"""

from dataclasses import dataclass
from functools import lru_cache

import cv2
import numpy as np
from jaxtyping import Bool, Float, Float32, Int
from scipy.optimize import nnls

from recon.arrays import GradientField
from recon.contact.mask import COLLAR_MM
from recon.depth_error import depth_noise
from recon.integration.poisson import eigenvalues
from recon.pose.registration import Touch
from recon.pose.rigid import Points, Transform
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
"""Fewer do not tell how they scatter."""
MOST_BLOCKS = 1000
"""So many tell it as all would."""
ALL = 0.999
"""Of a share, but for rounding."""
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


def sums_in_waves(
    points: Points, shares: Float[np.ndarray, "c n k"], shape: tuple[int, int], mm_per_px: Pair
) -> Float[np.ndarray, "k m"]:
    """Of k sums, how much each wave of the slopes' errors goes into them.

    Let S be the errors' variances by wave (``wave_variances``): 1 for white noise, and for noise
    that was smoothed by l and is again of variance 1 at each pixel 4 pi l^2 exp(-l^2 k^2) of the
    wave k. What is returned is A, and A S A' the sums' covariance. The surface that fits wrong
    slopes best is off by depths of the covariance (-L)^-1 S: L, the Laplacian of
    ``recon.integration.poisson``, is diagonal in sines. Means over a cell of n pixels vary by
    1 / n.

    Args:
        points: (n, 3), in mm; the frame's middle is at zero.
        shares: what each sum takes of the points' depths in mm; or, three of them, of the slopes
            along x, along y and the depths of the surface that fits best.
        shape: height and width in pixels of the frame that is integrated, zero around it.
        mm_per_px: its pixel pitch.
    """
    side_px = cell_px(mm_per_px)
    row, column = pixels(points, shape, mm_per_px, side_px)
    rows, columns = -(-shape[0] // side_px[1]), -(-shape[1] // side_px[0])
    (top, left), (bottom, right) = ((f(row), f(column)) for f in (np.min, np.max))
    high, wide = bottom + 1 - top, right + 1 - left
    cell = (row - top) * wide + column - left
    pitch_mm = side_px[0] * mm_per_px[0], side_px[1] * mm_per_px[1]
    down, across = _sines(rows)[:, top : bottom + 1], _sines(columns)[left : right + 1]
    steep_down = _slopes_of_sines(rows, pitch_mm[1])[:, top : bottom + 1]
    steep_across = _slopes_of_sines(columns, pitch_mm[0]).T[left : right + 1]
    factors = ((down, steep_across), (steep_down, across), (down, across))
    waves = np.zeros((shares.shape[2], rows, columns))
    for share, (up, along) in zip(shares, factors[-len(shares) :], strict=True):
        summed = np.stack([np.bincount(cell, item, high * wide) for item in share.T])
        waves += up @ (summed.reshape(-1, high, wide) @ along)
    waves /= np.sqrt(-eigenvalues(rows, columns, pitch_mm, "dirichlet", "d"))
    flat: np.ndarray = waves.reshape(len(waves), -1) / np.sqrt(side_px[0] * side_px[1])
    return flat


@lru_cache(maxsize=8)
def wave_variances(shape: tuple[int, int], mm_per_px: Pair) -> Float[np.ndarray, "l m"]:
    """Of errors by ``LENGTHS_MM``, in the waves of ``sums_in_waves``; do not write into it."""
    side_px = cell_px(mm_per_px)
    cells = -(-shape[0] // side_px[1]), -(-shape[1] // side_px[0])
    return _spectra(cells, mm_per_px, side_px).reshape(len(LENGTHS_MM), -1)


@lru_cache(maxsize=8)
def depth_variances(shape: tuple[int, int], mm_per_px: Pair) -> Float[np.ndarray, "l h w"]:
    """Of each pixel's depth, in mm^2, for the same errors; do not write into it."""
    height, width = shape
    smooth = _spectra(shape, mm_per_px, (1, 1))[1:]
    smooth = smooth / -eigenvalues(height, width, mm_per_px, "dirichlet", "d")
    white = depth_noise(shape, mm_per_px, "dirichlet") ** 2
    return np.stack([white, *(_sines(height) ** 2 @ smooth @ _sines(width) ** 2)])


def cell_px(mm_per_px: Pair) -> tuple[int, int]:
    """Width and height of a cell."""
    return max(1, round(CELL_MM / mm_per_px[0])), max(1, round(CELL_MM / mm_per_px[1]))


def pixels(
    points: Points, shape: tuple[int, int], mm_per_px: Pair, side_px: tuple[int, int] = (1, 1)
) -> tuple[Int[np.ndarray, " n"], Int[np.ndarray, " n"]]:
    """Row and column of the cell, so many pixels wide and high, in which each point lies."""
    height, width = shape
    column, row = (
        np.clip((points[:, axis] / mm_per_px[axis] + count / 2).astype(int), 0, count - 1)
        // side_px[axis]
        for axis, count in ((0, width), (1, height))
    )
    return row, column


def _left(
    reference: Coarse, current: Coarse, T_current_reference: Transform
) -> tuple[GradientField, Bool[np.ndarray, "r c"]]:
    """Slopes as seen less those that the motion predicts, and which lie within both contacts.

    In cells of the reference, around its contact.
    """
    spans = [np.flatnonzero(reference.inside.any(axis)) for axis in (1, 0)]
    rows, columns = (slice(span[0], span[-1] + 1) for span in spans)
    turn = T_current_reference[:3, :3].astype(np.float32)
    shift_mm = T_current_reference[:3, 3].astype(np.float32)
    depth_mm = reference.depth_mm[rows, columns]
    along_x, along_y = (
        (
            turn[axis, 0] / pitch * reference.x_mm[columns]
            + (turn[axis, 1] / pitch * reference.y_mm[rows] + (shift_mm[axis] - first) / pitch)[
                :, None
            ]
            - turn[axis, 2] / pitch * depth_mm
        )
        for axis, first, pitch in (
            (0, current.x_mm[0], np.float32(current.side_px[0] * current.mm_per_px[0])),
            (1, current.y_mm[0], np.float32(current.side_px[1] * current.mm_per_px[1])),
        )
    )
    found = cv2.remap(
        cv2.merge((current.gradient, current.inside.astype(np.float32))),
        along_x,
        along_y,
        cv2.INTER_LINEAR,
    )
    x, y, z = turn
    normal = cv2.transform(found, np.stack([x, y, np.zeros(3), z], 1))
    slopes = normal[..., :2] / np.maximum(normal[..., 2:], np.float32(0.1))
    both = reference.inside[rows, columns] & (found[..., 2] > ALL)
    return slopes - reference.gradient[rows, columns], both


def _scatter(difference: GradientField, counted: Bool[np.ndarray, "r c"]) -> Float[np.ndarray, "4"]:
    """Variance of a slope's mean over blocks by ``SIDES``, robust; NaN where there are too few."""
    found = np.full(len(SIDES), np.nan)
    squares = difference[..., 0] ** 2 + difference[..., 1] ** 2
    share = (counted & (squares > 0)).astype(np.float32)  # gel taken for flat tells nothing
    for index in range(len(SIDES)):
        whole = squares[share > ALL]
        if len(whole) < LEAST_BLOCKS:
            break
        whole = whole[:: -(-len(whole) // MOST_BLOCKS)]
        half = len(whole) // 2
        found[index] = np.partition(whole, half)[half] / RAYLEIGH_SQUARE
        rows, columns = (count // 2 for count in share.shape)
        if min(rows, columns) < 1:
            break
        difference, share = (
            cv2.resize(
                item[: 2 * rows, : 2 * columns], (columns, rows), interpolation=cv2.INTER_AREA
            )
            for item in (difference, share)
        )
        squares = difference[..., 0] ** 2 + difference[..., 1] ** 2
    return found


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


def _spectra(
    shape: tuple[int, int], mm_per_px: Pair, side_px: tuple[int, int]
) -> Float[np.ndarray, "l r c"]:
    """Of noise by ``LENGTHS_MM``, over the sines of a lattice of cells."""

    def along(count: int, side: int, length_px: float) -> Float[np.ndarray, " n"]:
        angles = np.pi * np.arange(1, count + 1) / (count + 1) / side
        smooth: np.ndarray = 2 * np.sqrt(np.pi) * length_px * np.exp(-((length_px * angles) ** 2))
        return smooth if length_px else np.ones(count)

    return np.stack(
        [
            np.outer(
                along(shape[0], side_px[1], length_mm / mm_per_px[1]),
                along(shape[1], side_px[0], length_mm / mm_per_px[0]),
            )
            for length_mm in LENGTHS_MM
        ]
    )


@lru_cache(maxsize=8)
def _sines(count: int) -> Float[np.ndarray, "n n"]:
    """The type-I sine transform's orthonormal matrix; do not write into it, it is kept."""
    number = np.arange(1, count + 1)
    found: np.ndarray = np.sqrt(2 / (count + 1)) * np.sin(
        np.pi / (count + 1) * number[:, None] * number
    )
    return found


@lru_cache(maxsize=8)
def _slopes_of_sines(count: int, pitch_mm: float) -> Float[np.ndarray, "n n"]:
    """Of each sine, a row, its slope at each place; do not write into it, it is kept."""
    number = np.arange(1, count + 1)
    angles = np.pi / (count + 1) * number[:, None]
    steepness = 2 * np.sin(angles / 2) / pitch_mm  # as the five-point Laplacian has it
    found: np.ndarray = np.sqrt(2 / (count + 1)) * steepness * np.cos(angles * number)
    return found
