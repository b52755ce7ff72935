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
from recon.integration.poisson import Boundary, margins_px
from recon.kernels import compiled
from sensor.toml import Pair


class FrameIntegrator:
    """Integrates gradient fields of one size with one border."""

    def __init__(self, size_px: tuple[int, int], mm_per_px: Pair, boundary: Boundary) -> None:
        """Prepare for frames of (width, height)."""
        self._per_mm = (0.5 / np.asarray(mm_per_px)).astype(np.float32)
        self._zero_border = boundary == "dirichlet"
        width, height = size_px
        top = left = 0
        rows, columns = height, width
        if self._zero_border:  # the ring of zeros itself is no unknown
            (left, right), (top, bottom) = margins_px(width), margins_px(height)
            top, left = top - 1, left - 1
            rows, columns = top + height + bottom - 1, left + width + right - 1
        self._field = np.zeros((rows, columns), np.float32)
        self._inside = slice(top, top + height), slice(left, left + width)
        self._ringed = np.zeros((2, rows + 2, columns + 2), np.float32)
        self._down, self._pivot = _elimination(rows, columns, mm_per_px, self._zero_border)

    def __call__(self, gradient: Float32[np.ndarray, "2 h w"]) -> DepthMap:
        """Depth in mm, (h, w), of gradients as planes; the next call overwrites it."""
        ringed, (rows, columns) = self._ringed, self._inside
        ringed[:, rows.start + 1 : rows.stop + 1, columns.start + 1 : columns.stop + 1] = gradient
        if not self._zero_border:  # no slope halfway across the border
            ringed[0, :, 0], ringed[0, :, -1] = -ringed[0, :, 1], -ringed[0, :, -2]
            ringed[1, 0], ringed[1, -1] = -ringed[1, 1], -ringed[1, -2]
        _divergence(ringed, self._field, self._per_mm)
        if self._zero_border:
            self._field = fft.dst(self._field, type=1, axis=1, overwrite_x=True)
            _sweep(self._field, self._down, self._pivot)
            self._field = fft.idst(self._field, type=1, axis=1, overwrite_x=True)
        else:
            self._field = fft.dct(self._field, type=2, axis=1, overwrite_x=True)
            _sweep(self._field, self._down, self._pivot)
            self._field[:, 0] -= self._field[:, 0].mean()
            self._field = fft.idct(self._field, type=2, axis=1, overwrite_x=True)
        return self._field[self._inside]


def _elimination(
    rows: int, columns: int, mm_per_px: Pair, zero_border: bool
) -> tuple[np.ndarray, np.ndarray]:
    """What the sweeps multiply by, (rows, columns): the row above, and the row itself.

    Along the columns the equation is ``(z[r-1] - 2 z[r] + z[r+1]) / h^2 + value * z[r] = s[r]``.
    Free borders have 1 instead of 2 in the first and last row; the constant, which they leave
    open, is fixed by a zero in the last row and removed by the caller.
    """
    waves = (
        np.arange(1, columns + 1) / (columns + 1) if zero_border else np.arange(columns) / columns
    )
    value = -((2 * np.sin(np.pi * waves / 2) / mm_per_px[0]) ** 2)
    off = 1 / mm_per_px[1] ** 2
    diagonal = np.tile(value - 2 * off, (rows, 1))
    if not zero_border:
        diagonal[0] += off
        diagonal[-1] += off  # the same row, where there is but one
    down, pivot = np.zeros_like(diagonal), np.zeros_like(diagonal)
    with np.errstate(divide="ignore"):
        pivot[0] = 1 / diagonal[0]
        for r in range(1, rows):
            down[r] = off * pivot[r - 1]
            pivot[r] = 1 / (diagonal[r] - off * down[r])
    if not zero_border:
        pivot[-1, 0] = 0
    return down.astype(np.float32), np.stack([pivot, pivot * off]).astype(np.float32)


def _take_divergence(ringed: Any, field: Any, per_mm: Any) -> None:
    """Differences of the slopes halfway between pixels: the middle one cancels."""
    rows, columns = field.shape
    for r in range(rows):
        for c in range(columns):
            across = ringed[0, r + 1, c + 2] - ringed[0, r + 1, c]
            along = ringed[1, r + 2, c + 1] - ringed[1, r, c + 1]
            field[r, c] = per_mm[0] * across + per_mm[1] * along


def _take_sweep(field: Any, down: Any, pivot: Any) -> None:
    rows, columns = field.shape
    for r in range(1, rows):
        for c in range(columns):
            field[r, c] -= down[r, c] * field[r - 1, c]
    for c in range(columns):
        field[rows - 1, c] *= pivot[0, rows - 1, c]
    for r in range(rows - 2, -1, -1):
        for c in range(columns):
            field[r, c] = pivot[0, r, c] * field[r, c] - pivot[1, r, c] * field[r + 1, c]


_divergence, _sweep = compiled(_take_divergence), compiled(_take_sweep)
