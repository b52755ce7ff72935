# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Gel that did not move is flat: ``recon.still`` at a quarter of the frame's resolution.

It is found before the slopes are, from the slopes of a quarter as many rows and columns, so that
those of still gel need not be worked out at all.
"""

import math

import cv2
import numpy as np

from recon.estimators.default import Default
from recon.fast.disturbance import SIDE_PX, QuarterMask
from recon.fast.ensemble import FrameEnsemble, Seen
from recon.still import CLEAR_SLOPE, MARGIN, SMOOTHING


class FrameStill:
    """Finds gel that moved, and what lies near it, in frames of one size."""

    def __init__(self, estimator: Default, size_px: tuple[int, int]) -> None:
        """Prepare for frames of (width, height)."""
        width, height = size_px
        self._size = -(-width // SIDE_PX), -(-height // SIDE_PX)
        shape = self._size[::-1]
        self._network = FrameEnsemble(estimator, self._size, self._size)
        self._slopes = np.zeros((2, *shape), np.float32)
        side_px = min(size_px)
        # Variances add: what the averages have not smoothed yet, in averages.
        left = (SMOOTHING * side_px) ** 2 - (SIDE_PX**2 - 1) / 12
        self._sigma = math.sqrt(max(left, 0.01)) / SIDE_PX
        width_px = 2 * round(MARGIN * side_px / SIDE_PX) + 1
        self._around = np.ones((width_px, width_px), np.uint8)

    def __call__(self, small: Seen, disturbed: QuarterMask) -> QuarterMask:
        """Where colour or slope tells of a contact nearby, from what was prepared, quartered."""
        self._network(small, self._slopes)
        for slopes in self._slopes:
            cv2.GaussianBlur(slopes, (0, 0), self._sigma, dst=slopes)
        steep = np.square(self._slopes).sum(0) > CLEAR_SLOPE**2
        moved = (disturbed | steep).astype(np.uint8)
        return np.asarray(cv2.dilate(moved, self._around), bool)
