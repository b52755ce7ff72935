# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""What sums of slopes and depths vary by, given how slope errors of neighbours go together.

How much there is of which errors, ``recon.pose.cells`` tells.
"""

from functools import lru_cache

import numpy as np
from jaxtyping import Float, Int

from recon.depth_error import depth_noise
from recon.integration.poisson import eigenvalues
from recon.pose.cells import LENGTHS_MM, cell_px
from recon.pose.rigid import Points
from sensor.toml import Pair


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
