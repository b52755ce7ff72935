# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""The part of a slope field that some depth map has as its gradient.

Slopes of a surface have no curl, independent noise on the two slopes has: removing it takes half of
white noise away and nothing of the surface. Any border is allowed, as the stream function of what
is removed is zero there (Helmholtz's decomposition with a free depth). Derivatives are those of the
sines and cosines themselves, not of differences, so that edges stay as sharp as they are.
"""

import numpy as np
from scipy import fft

from recon.arrays import GradientField
from sensor.toml import Pair


def integrable(gradient: GradientField, mm_per_px: Pair) -> GradientField:
    """The nearest field without curl, by least squares.

    Args:
        gradient: (h, w, 2), mm/mm, along x and y, at least 2 x 2.
        mm_per_px: pixel pitch along x and y.

    Returns:
        (h, w, 2), of the gradient's dtype.
    """
    height, width = gradient.shape[:2]
    along_x, along_y = (
        (np.arange(1, count) / (count * pitch)).astype(gradient.dtype)
        for count, pitch in zip((width, height), mm_per_px, strict=True)
    )
    along_y = along_y[:, None]
    # Of a depth in cosines, the slope along an axis is a sine there and a cosine across.
    slope_x = _transformed(gradient[..., 0], sine_axis=1)
    slope_y = _transformed(gradient[..., 1], sine_axis=0)
    shared_x, shared_y = slope_x[1:, :-1], slope_y[:-1, 1:]  # of the same waves
    curl = (along_x * shared_y - along_y * shared_x) / (along_x**2 + along_y**2)
    shared_x += along_y * curl
    shared_y -= along_x * curl
    return np.stack([_returned(slope_x, sine_axis=1), _returned(slope_y, sine_axis=0)], -1)


def _transformed(slope: np.ndarray, sine_axis: int) -> np.ndarray:
    cosines = fft.dct(slope, type=2, axis=1 - sine_axis, norm="ortho")
    return fft.dst(cosines, type=2, axis=sine_axis, norm="ortho", overwrite_x=True)


def _returned(waves: np.ndarray, sine_axis: int) -> np.ndarray:
    cosines = fft.idst(waves, type=2, axis=sine_axis, norm="ortho", overwrite_x=True)
    return fft.idct(cosines, type=2, axis=1 - sine_axis, norm="ortho", overwrite_x=True)
