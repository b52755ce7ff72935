# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Where the gel is disturbed, at a quarter of the frame's resolution: enough to choose a border.

The rules are those of ``recon.contact.disturbed``; averages over 4 x 4 pixels stand in for most of
its smoothing, and every second of them for its medians.
"""

import math
from typing import Any

import cv2
import numpy as np
from jaxtyping import Float32

from recon.contact.disturbed import (
    BESIDE_PX,
    FINE_PX,
    LEAST_AREA,
    RIM_PX,
    SMOOTHING_PX,
    disturbed_in_smooth,
    filled_patches,
    lit_planes,
)
from recon.integration.poisson import Boundary
from recon.kernels import compiled
from recon.lights import channel_indices
from recon.medians import PER_MAD, median
from recon.quarters import SIDE_PX, QuarterMask

LEAST_SIDE_PX = FINE_PX
"""Of frames with a shorter side than this, a quarter has too few pixels to tell contacts apart, and
the reference smooths them less."""
LEAST_STILL_PX = 100
"""And of even smaller ones too few to tell where slopes matter: they are worked out everywhere."""
_LEFT_PX = math.sqrt(SMOOTHING_PX**2 - (SIDE_PX**2 - 1) / 12) / SIDE_PX
"""Variances add: what the averages have not smoothed yet, in averages."""


class FrameDisturbance:
    """Finds disturbed gel in difference images of one size."""

    def __init__(self, size_px: tuple[int, int], channels: str) -> None:
        """Prepare for frames of (width, height), lit in these channels."""
        width, height = size_px
        self._quarter = np.zeros((3, -(-height // SIDE_PX), -(-width // SIDE_PX)), np.float32)
        self._smooth = np.zeros_like(self._quarter)
        self._line = np.zeros(width, np.float32)
        self._lit = channel_indices(channels)

    def __call__(self, difference: Float32[np.ndarray, "3 h w"]) -> QuarterMask:
        """The mask, one element for 4 x 4 pixels."""
        lit = [index for index in lit_planes(difference) if index in self._lit]
        if not lit:
            return np.zeros(self._quarter.shape[1:], bool)
        _average(difference, self._quarter, self._line)
        smooth = self._smooth[: len(lit)]
        for index, plane in zip(lit, smooth, strict=True):
            cv2.GaussianBlur(self._quarter[index], (0, 0), _LEFT_PX, dst=plane)
        rows = difference[:, ::16]
        pairs = (rows[..., :-1:4] - rows[..., 1::4])[lit]
        grain = PER_MAD * median(np.abs(pairs))
        grain /= math.sqrt(2) * 2 * math.sqrt(math.pi) * SMOOTHING_PX
        return disturbed_in_smooth(smooth, grain, _patches, RIM_PX // SIDE_PX, every=2)


def _patches(mask: QuarterMask) -> QuarterMask:
    """``recon.contact.disturbed.filled_patches`` at this resolution."""
    return filled_patches(mask, BESIDE_PX // SIDE_PX, LEAST_AREA * mask.size)


def border_of(disturbed: QuarterMask) -> Boundary:
    """``recon.contact.disturbed.boundary_of`` a mask of quarters."""
    edges = disturbed[[0, -1]], disturbed[:, [0, -1]]
    return "neumann" if any(edge.any() for edge in edges) else "dirichlet"


def _take_average(difference: Any, out: Any, line: Any) -> None:
    """Rows are added up first, as vectors; ``line`` is room for one of their sums."""
    _, height, width = difference.shape
    whole = width // SIDE_PX
    for k in range(3):
        for row in range(out.shape[1]):
            end = min(height, (row + 1) * SIDE_PX)
            rows = end - row * SIDE_PX
            line[:] = 0
            for r in range(row * SIDE_PX, end):
                for column in range(width):
                    line[column] += difference[k, r, column]
            scale = np.float32(1) / np.float32(rows * SIDE_PX)
            for column in range(whole):
                total = np.float32(0)
                for c in range(SIDE_PX):
                    total += line[column * SIDE_PX + c]
                out[k, row, column] = scale * total
            if whole < out.shape[2]:
                rest = line[whole * SIDE_PX :]
                out[k, row, whole] = rest.sum() / np.float32(rows * len(rest))


_average = compiled(_take_average)
