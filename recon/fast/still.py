# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Gel that did not move is flat: ``recon.still`` at a quarter of the frame's resolution."""

import math
from typing import Any

import cv2
import numpy as np
from jaxtyping import Float32

from recon.fast.disturbance import SIDE_PX, QuarterMask
from recon.fast.kernels import compiled
from recon.still import CLEAR_SLOPE, MARGIN, SMOOTHING


class FrameStill:
    """Flattens gel that did not move in frames of one size."""

    def __init__(self, size_px: tuple[int, int]) -> None:
        """Prepare for frames of (width, height)."""
        width, height = size_px
        quarter = -(-height // SIDE_PX), -(-width // SIDE_PX)
        self._smooth = np.zeros((2, *quarter), np.float32)
        self._near = np.zeros(quarter, np.uint8)
        side_px = min(size_px)
        # Variances add: what the averages have not smoothed yet, in averages.
        left = (SMOOTHING * side_px) ** 2 - (SIDE_PX**2 - 1) / 12
        self._sigma = math.sqrt(max(left, 0.01)) / SIDE_PX
        width_px = 2 * round(MARGIN * side_px / SIDE_PX) + 1
        self._around = np.ones((width_px, width_px), np.uint8)

    def __call__(self, gradient: Float32[np.ndarray, "2 h w"], disturbed: QuarterMask) -> None:
        """Set slopes to zero where neither colour nor slope tells of a contact nearby."""
        shape = self._near.shape[::-1]
        for plane, smooth in zip(gradient, self._smooth, strict=True):
            cv2.resize(plane, shape, dst=smooth, interpolation=cv2.INTER_AREA)
            cv2.GaussianBlur(smooth, (0, 0), self._sigma, dst=smooth)
        steep = np.square(self._smooth).sum(0) > CLEAR_SLOPE**2
        cv2.dilate((disturbed | steep).astype(np.uint8), self._around, dst=self._near)
        _flatten(gradient, self._near)


def _take_flat(gradient: Any, near: Any) -> None:
    _, height, width = gradient.shape
    for row in range(height):
        for column in range(width):
            if not near[row // SIDE_PX, column // SIDE_PX]:
                gradient[0, row, column] = gradient[1, row, column] = 0


_flatten = compiled(_take_flat)
