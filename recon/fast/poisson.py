# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""The solver of ``recon.integration.poisson`` with all prepared that depends on size alone.

Same equations and borders, but only the rows are transformed. That leaves one three-point
equation along the columns for each wave number, which elimination solves in one sweep down and
one up (Thomas; Hockney, J. ACM 12(1), 1965): half of the transforms, and no division per frame.
"""

from typing import Any

import numpy as np
from jaxtyping import Float32
from scipy import fft

from recon.arrays import DepthMap
from recon.fast.pages import in_large_pages
from recon.integration.poisson import Boundary, margins_px
from recon.kernels import compiled
from sensor.toml import Pair

STRIPE_PX = 1024
"""Columns that are swept together. LLVM takes whole rows of one array for overlapping, and makes no
vectors of them; parts it checks."""


class FrameIntegrator:
    """Integrates gradient fields of one size with one border."""

    def __init__(self, size_px: tuple[int, int], mm_per_px: Pair, boundary: Boundary) -> None:
        """Prepare for frames of (width, height)."""
        # Slopes are scaled so that the equation along the columns has ones beside its middle.
        self._per_mm = (0.5 * mm_per_px[1] ** 2 / np.asarray(mm_per_px)).astype(np.float32)
        self._zero_border = boundary == "dirichlet"
        width, height = size_px
        top = left = 0
        rows, columns = height, width
        if self._zero_border:  # the ring of zeros itself is no unknown
            (left, right), (top, bottom) = margins_px(width), margins_px(height)
            top, left = top - 1, left - 1
            rows, columns = top + height + bottom - 1, left + width + right - 1
        self._field = in_large_pages(np.zeros((rows, columns), np.float32))
        self._inside = slice(top, top + height), slice(left, left + width)
        self._pivot = in_large_pages(_elimination(rows, columns, mm_per_px, self._zero_border))

    def __call__(self, gradient: Float32[np.ndarray, "2 h w"]) -> DepthMap:
        """Depth in mm, (h, w), of gradients as planes; the next call overwrites it."""
        rows, columns = self._inside
        beyond = np.float32(0 if self._zero_border else -1)
        _divergence(gradient, self._field, rows.start, columns.start, self._per_mm, beyond)
        if self._zero_border:
            self._field = fft.dst(self._field, type=1, axis=1, overwrite_x=True)
            _sweep(self._field, self._pivot)
            self._field = fft.idst(self._field, type=1, axis=1, overwrite_x=True)
        else:
            self._field = fft.dct(self._field, type=2, axis=1, overwrite_x=True)
            _sweep(self._field, self._pivot)
            self._field[:, 0] -= self._field[:, 0].mean()
            self._field = fft.idct(self._field, type=2, axis=1, overwrite_x=True)
        return self._field[self._inside]


def _elimination(
    rows: int, columns: int, mm_per_px: Pair, zero_border: bool
) -> Float32[np.ndarray, "rows columns"]:
    """What the sweeps multiply by.

    Along the columns the equation is ``z[r-1] - (2 - value) z[r] + z[r+1] = s[r]``, where ``value``
    is a wave's eigenvalue along the rows, times the square of the columns' pitch. Free borders
    have 1 instead of 2 in the first and last row; the constant, which they leave open, is fixed by
    a zero in the last row and removed by the caller.
    """
    waves = (
        np.arange(1, columns + 1) / (columns + 1) if zero_border else np.arange(columns) / columns
    )
    value = -((2 * np.sin(np.pi * waves / 2) * mm_per_px[1] / mm_per_px[0]) ** 2)
    diagonal = np.tile(value - 2, (rows, 1))
    if not zero_border:
        diagonal[0] += 1
        diagonal[-1] += 1  # the same row, where there is but one
    pivot = np.zeros_like(diagonal)
    with np.errstate(divide="ignore"):
        pivot[0] = 1 / diagonal[0]
        for r in range(1, rows):
            pivot[r] = 1 / (diagonal[r] - pivot[r - 1])
    if not zero_border:
        pivot[-1, 0] = 0
    return pivot.astype(np.float32)


def _take_divergence(
    gradient: Any, field: Any, top: int, left: int, per_mm: Any, beyond: Any
) -> None:
    """Differences of the slopes halfway between pixels: the middle one cancels.

    ``top`` and ``left`` are where the frame begins in ``field``. Slopes just beyond it are those of
    its edge times ``beyond``: of flat gel 0, and -1 where there is none halfway across the border.
    """
    _, height, width = gradient.shape
    across, along = per_mm
    for r in range(field.shape[0]):
        line, y = field[r], r - top
        line[:] = 0
        inside = line[left : left + width]
        if 0 <= y < height:
            slopes = gradient[0, y]
            for x in range(width - 2):
                inside[x + 1] = across * (slopes[x + 2] - slopes[x])
            first, last = across * slopes[0], across * slopes[width - 1]
            inside[0] -= beyond * first
            inside[width - 1] += beyond * last
            if width > 1:
                inside[0] += across * slopes[1]
                inside[width - 1] -= across * slopes[width - 2]
            if left > 0:
                line[left - 1] = first
            if left + width < field.shape[1]:
                line[left + width] = -last
        for near, share in ((y + 1, along), (y - 1, -along)):
            if 0 <= near < height:
                slopes = gradient[1, near]
            elif 0 <= y < height:
                slopes, share = gradient[1, y], share * beyond
            else:
                continue
            for x in range(width):
                inside[x] += share * slopes[x]


def _take_sweep(field: Any, pivot: Any) -> None:
    rows, columns = field.shape
    for left in range(0, columns, STRIPE_PX):
        right = min(left + STRIPE_PX, columns)
        above = field[0, left:right]
        for r in range(1, rows):
            line, factor = field[r, left:right], pivot[r - 1, left:right]
            for c in range(len(above)):
                line[c] -= factor[c] * above[c]
            above = line
        below, factor = above, pivot[rows - 1, left:right]
        for c in range(len(below)):
            below[c] *= factor[c]
        for r in range(rows - 2, -1, -1):
            line, factor = field[r, left:right], pivot[r, left:right]
            for c in range(len(below)):
                line[c] = factor[c] * (line[c] - below[c])
            below = line


_divergence, _sweep = compiled(_take_divergence), compiled(_take_sweep)
