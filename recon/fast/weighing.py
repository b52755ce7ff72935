# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""``recon.integration.weighed`` for frames of one size: one pass along each axis."""

from typing import Any

import numpy as np
from jaxtyping import Float32

from recon.arrays import DepthMap
from recon.integration.poisson import Boundary
from recon.integration.weighed import (
    MEASURED,
    MORE_PER_SLOPE,
    STILL,
    BetweenCells,
    Map,
    Mask,
    Rest,
    cell_sides_px,
    cells_change,
    held_weight,
    spread,
    without_ring,
)
from recon.kernels import compiled
from recon.lights import Axis
from sensor.toml import Pair

BEYOND = 1e30
"""Variance of slopes beyond a free border: nothing is known there."""


class FrameWeighing:
    """Changes integrals of one size and border to those by slopes that count by their doubt."""

    def __init__(self, size_px: tuple[int, int], mm_per_px: Pair, boundary: Boundary) -> None:
        """Prepare for frames of (width, height)."""
        self._shape, self._boundary = size_px[::-1], boundary
        side_px, ring_px = cell_sides_px(self._shape, boundary)
        self._pitch_mm = side_px * mm_per_px[0], side_px * mm_per_px[1]
        self._firmness = held_weight(self._shape, mm_per_px) / side_px**2
        self._per_mm = 1 / np.asarray(mm_per_px, np.float32)
        rows, columns = (-(-(size + 2 * ring_px) // side_px) for size in self._shape)
        self._inside = tuple(slice(ring_px, ring_px + size) for size in self._shape)
        self._depth = np.zeros((rows * side_px, columns * side_px), np.float32)
        self._slopes = np.zeros((2, *self._depth.shape), np.float32)
        self._variance = np.full_like(self._depth, STILL**2 if ring_px else BEYOND)
        self._lines = np.zeros((2, columns * side_px), np.float32)
        self._x = np.zeros((2, rows, columns - 1), np.float32)
        self._y = np.zeros((2, rows - 1, columns), np.float32)
        self._held_lines = np.zeros((2, size_px[0]), np.float32)
        self._rest = np.zeros((2, *(-(-size // side_px) for size in self._shape)), np.float32)

    def __call__(
        self,
        gradient: Float32[np.ndarray, "2 h w"],
        depth_mm: DepthMap,
        inferred: tuple[Axis, Map] | None = None,
        rests: Mask | None = None,
    ) -> bool:
        """Change a depth, the plain integral of gradients as planes, in place.

        Whether any gel rests is told: if none does, depth is as deep on average as it was.

        Args:
            gradient: mm/mm.
            depth_mm: that is changed.
            inferred: the axis whose slope was, if one was, and how far off that is expected to be:
                (h, w), mm/mm.
            rests: which gel does; none unless given.
        """
        rows, columns = self._inside
        slopes, depth, variance = self._slopes, self._depth, self._variance
        slopes[:, rows, columns], depth[rows, columns] = gradient, depth_mm
        _variances(gradient, variance, rows.start, columns.start)
        of_x = of_y = variance
        if inferred is not None:
            (axis, doubt), more = inferred, variance.copy()
            more[rows, columns] += np.square(doubt / np.float32(MEASURED))
            of_x, of_y = (more, variance) if axis == "x" else (variance, more)
        _along_x(slopes[0], depth, of_x, self._per_mm[0], self._lines, self._x)
        _along_y(slopes[1], depth, of_y, self._per_mm[1], self._lines, self._y)
        between = BetweenCells(
            weight_x=without_ring(self._x[0], self._boundary),
            pull_x=without_ring(self._x[1], self._boundary),
            weight_y=without_ring(self._y[0].T, self._boundary).T,
            pull_y=without_ring(self._y[1].T, self._boundary).T,
        )
        rest = None
        if rests is not None:
            _held(depth_mm, rests, np.float32(self._firmness), self._held_lines, self._rest)
            weight, pull = self._rest
            if weight.any():
                if self._boundary == "neumann":
                    lies_mm = pull.sum() / weight.sum()
                    depth_mm -= lies_mm
                    pull -= lies_mm * weight
                rest = Rest(weight=weight, pull=pull)
        change = cells_change(between, self._pitch_mm, self._boundary, rest)
        depth_mm += spread(change, self._shape, self._boundary, rest)
        return rest is not None


def _take_variances(gradient: Any, out: Any, top: int, left: int) -> None:
    still, more, one = np.float32(STILL**2), np.float32(MORE_PER_SLOPE), np.float32(1)
    for r in range(gradient.shape[1]):
        for c in range(gradient.shape[2]):
            squared = gradient[0, r, c] ** 2 + gradient[1, r, c] ** 2
            doubt = one + more * np.sqrt(squared)
            out[top + r, left + c] = doubt * doubt if squared > 0 else still


def _take_along_x(slope: Any, depth: Any, variance: Any, per_mm: Any, lines: Any, out: Any) -> None:
    side = slope.shape[0] // out.shape[1]
    for row in range(out.shape[1]):
        lines[:] = 0
        for r in range(row * side, (row + 1) * side):
            for c in range(slope.shape[1] - 1):
                weight = 2 / (variance[r, c] + variance[r, c + 1])
                lacks = (slope[r, c] + slope[r, c + 1]) / 2
                lacks -= (depth[r, c + 1] - depth[r, c]) * per_mm
                lines[0, c] += weight
                lines[1, c] += weight * lacks
        for k in range(2):
            for column in range(out.shape[2]):
                first = side // 2 + column * side
                out[k, row, column] = lines[k, first : first + side].mean() / side


def _take_along_y(slope: Any, depth: Any, variance: Any, per_mm: Any, lines: Any, out: Any) -> None:
    side = slope.shape[1] // out.shape[2]
    for row in range(out.shape[1]):
        lines[:] = 0
        first = side // 2 + row * side
        for r in range(first, first + side):
            for c in range(slope.shape[1]):
                weight = 2 / (variance[r, c] + variance[r + 1, c])
                lacks = (slope[r, c] + slope[r + 1, c]) / 2
                lacks -= (depth[r + 1, c] - depth[r, c]) * per_mm
                lines[0, c] += weight
                lines[1, c] += weight * lacks
        for k in range(2):
            for column in range(out.shape[2]):
                out[k, row, column] = lines[k, column * side : (column + 1) * side].mean() / side


def _take_held(depth: Any, rests: Any, firmness: Any, lines: Any, out: Any) -> None:
    side = -(-depth.shape[0] // out.shape[1])
    for row in range(out.shape[1]):
        lines[:] = 0
        for r in range(row * side, min((row + 1) * side, depth.shape[0])):
            for c in range(depth.shape[1]):
                held = np.float32(rests[r, c])
                lines[0, c] += held
                lines[1, c] += held * depth[r, c]
        for k in range(2):
            for column in range(out.shape[2]):
                out[k, row, column] = firmness * lines[k, column * side : (column + 1) * side].sum()


_variances, _held = compiled(_take_variances), compiled(_take_held)
_along_x, _along_y = compiled(_take_along_x), compiled(_take_along_y)
