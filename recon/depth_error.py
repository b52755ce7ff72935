# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""How far off depth is expected to be: what slopes that are wrong become when they are integrated.

With independent errors of the slopes that is closed form (``depth_noise``). An estimator's errors
are not independent: a flank is misread as a whole. They count as pixels' independent noise times
the side, in pixels, of a square of ``CORRELATED_MM``: about what errors come to that are the same
over such squares, one square independent of the next. But waves shorter than the square, which it
would average out, count in full. So this is cautious, and grows as the logarithm of the pixels'
number, by 7 % with each halving of the pitch: errors drawn by squares scattered depth by 0.66 to
0.87 of it (medians of a frame of 16 x 12 mm at pitches of 0.2 to 0.05 mm), and by less where a
border is held at zero.
"""

import math
from collections.abc import Mapping
from functools import lru_cache

import cv2
import numpy as np
from jaxtyping import Float32, Float64
from scipy import fft

from recon.arrays import DepthMap, GradientField
from recon.estimators import GradientEstimator
from recon.integration.poisson import Boundary
from recon.lights import line_turn_deg, unseen_axis
from sensor.toml import Pair

CORRELATED_MM = 0.8
"""Side of the square over which an estimator's errors count as the same: chosen so that depths of
presses and shapes not learnt from are off by about what is expected
(``docs/concepts/contact.md``)."""
NORMAL90 = 1.645
"""Standard deviations in half the width of a normal error's 90 % interval."""
LAPLACE = 2**0.5
"""Standard deviations in the mean absolute error of Laplace's law, by which doubt is learnt."""
MOST_INFERRED = 0.25
"""Standard deviation of an inferred slope's error, mm/mm, at most: where it is doubted more, it is
off by no more (root mean squares of 0.14 to 0.34 on shapes and balls). Squares of larger doubts
would let a few pixels count for more than all others of a frame."""
MOST_CELLS = 80
"""Along the frame's longer side, in which errors are spread: they go together over more than
one."""


def slope_error(
    estimator: GradientEstimator | None,
    gradient: GradientField,
    lights_deg: Mapping[str, float] | None,
    doubt: DepthMap | None,
) -> GradientField | None:
    """Standard deviation expected of each slope's error, mm/mm; ``None`` where nobody measured it.

    How far off an inferred slope is says nothing of the one that was measured. Of an unseen slope
    that was set to zero, or that colours alone were asked for, none is known.

    Args:
        estimator: that read the slopes.
        gradient: (h, w, 2), mm/mm.
        lights_deg: where the lights sit.
        doubt: (h, w), how far off slopes that were inferred are expected to be, mm/mm; ``None``
            where none were.
    """
    if estimator is None:
        return None
    half_width = estimator.half_width(gradient)
    unseen = unseen_axis(lights_deg, estimator.channels)
    if half_width is None or (unseen is not None and doubt is None):
        return None
    error = half_width / np.float32(NORMAL90)
    if unseen is None or doubt is None:
        return error
    inferred = np.minimum(np.float32(LAPLACE) * doubt, np.float32(MOST_INFERRED))
    # Variances along the line of the lights and across it, and what both axes have of them.
    line_deg = 90 * (unseen == "x") + line_turn_deg(lights_deg, estimator.channels)
    along = np.square([math.cos(math.radians(line_deg)), math.sin(math.radians(line_deg))])
    measured2 = (error**2 @ along)[..., None]
    return np.sqrt(measured2 * along + inferred[..., None] ** 2 * (1 - along)).astype(np.float32)


def depth_error(error: GradientField, mm_per_px: Pair, boundary: Boundary) -> DepthMap:
    """Standard deviation expected of each depth's error, mm.

    A slope's error moves depth at a distance r by an amount that falls as 1 / r (the gradient of
    the Laplacian's Green function in the plane), so variances are averaged by 1 / r^2, and the
    average stands for the one variance that ``depth_noise`` asks for. Far from all wrong slopes
    that is too cautious, as a border held at zero keeps their errors to themselves.

    Args:
        error: (h, w, 2), standard deviation of the slopes, mm/mm.
        mm_per_px: pixel pitch along x and y.
        boundary: what the slopes are integrated with.
    """
    height, width = error.shape[:2]
    variance = np.square(error, dtype=np.float32).mean(-1)
    cell_px = -(-max(height, width) // MOST_CELLS)
    cells_px = -(-width // cell_px), -(-height // cell_px)
    cells = cv2.resize(variance, cells_px, interpolation=cv2.INTER_AREA)
    cell_mm = (mm_per_px[0] * width / cells_px[0], mm_per_px[1] * height / cells_px[1])
    around = cv2.resize(_averaged(cells, cell_mm), (width, height))
    squares = CORRELATED_MM / np.sqrt(mm_per_px[0] * mm_per_px[1])
    noise = depth_noise((height, width), mm_per_px, boundary)
    return np.asarray(squares * noise * np.sqrt(np.maximum(around, 0)), np.float32)


@lru_cache(maxsize=8)
def depth_noise(
    shape: tuple[int, int], mm_per_px: Pair, boundary: Boundary
) -> Float64[np.ndarray, "h w"]:
    """Standard deviation of depth, in mm, for slopes with independent noise of deviation 1.

    Integration divides the divergence by the Laplacian's eigenvalues, so with orthonormal
    transforms ``var z = sum_kl phi_k^2 phi_l^2 (sin^2 a_k / h_x^2 + sin^2 a_l / h_y^2) /
    lambda_kl^2``: slopes at pixel centres are differenced over two pixels, hence sin a and not
    2 sin(a / 2). With a free border depth is known up to a constant, which is not counted. In the
    outermost pixels beside a border held at zero it is cautious: depth scatters by 0.6 to 1 of it.
    """
    (powers_y, angles_y), (powers_x, angles_x) = (_modes(count, boundary) for count in shape)

    def squares(angles: np.ndarray, pitch_mm: float) -> tuple[np.ndarray, np.ndarray]:
        return (np.sin(angles) / pitch_mm) ** 2, (2 * np.sin(angles / 2) / pitch_mm) ** 2

    slope_x, bend_x = squares(angles_x, mm_per_px[0])
    slope_y, bend_y = squares(angles_y, mm_per_px[1])
    bend = bend_y[:, None] + bend_x[None, :]
    if boundary == "neumann":
        bend[0, 0] = np.inf
    spectrum = (slope_y[:, None] + slope_x[None, :]) / bend**2
    return np.sqrt(powers_y @ spectrum @ powers_x.T)


def _averaged(
    variance: Float32[np.ndarray, "rows columns"], cell_mm: Pair
) -> Float64[np.ndarray, "rows columns"]:
    """Around each cell, cells weighing by the inverse square of their distance."""
    rows, columns = variance.shape
    spectrum = _nearness((rows, columns), cell_mm)

    def gathered(values: np.ndarray) -> Float64[np.ndarray, "rows columns"]:
        padded = fft.rfft2(values, (2 * rows, 2 * columns))
        return np.asarray(fft.irfft2(padded * spectrum, (2 * rows, 2 * columns))[:rows, :columns])

    return gathered(variance.astype(np.float64)) / gathered(np.ones((rows, columns)))


@lru_cache(maxsize=8)
def _nearness(shape: tuple[int, int], cell_mm: Pair) -> np.ndarray:
    """Transform of 1 / r^2, a cell being half its width from itself."""
    y_mm, x_mm = (
        np.minimum(np.arange(2 * count), 2 * count - np.arange(2 * count)) * pitch_mm
        for count, pitch_mm in zip(shape, cell_mm[::-1], strict=True)
    )
    square_mm2 = y_mm[:, None] ** 2 + x_mm[None, :] ** 2
    return np.asarray(fft.rfft2(1 / np.maximum(square_mm2, cell_mm[0] * cell_mm[1] / 4)))


def _modes(count: int, boundary: Boundary) -> tuple[np.ndarray, np.ndarray]:
    """Squares (place, mode) of the orthonormal modes along one side, and their angles."""
    place = np.arange(count)[:, None]
    if boundary == "dirichlet":
        angles = np.pi * np.arange(1, count + 1) / (count + 1)
        return 2 / (count + 1) * np.sin(angles * (place + 1)) ** 2, angles
    angles = np.pi * np.arange(count) / count
    powers = 2 / count * np.cos(angles * (place + 0.5)) ** 2
    powers[:, 0] /= 2
    return powers, angles
