# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Gel that did not move is flat: ``recon.still`` at a quarter of the frame's resolution.

It is found before the slopes are, from the slopes of a quarter as many rows and columns, of a large
frame an eighth, so that those of still gel need not be worked out at all.
"""

import math

import cv2
import numpy as np

from recon.estimators.default import Default, asked_size_px
from recon.fast.ensemble import FrameEnsemble, Seen
from recon.quarters import SIDE_PX, QuarterMask
from recon.still import CLEAR_SLOPE, SMOOTHING


class FrameStill:
    """Finds gel that moved, and what lies near it, in frames of one size."""

    def __init__(self, estimator: Default, size_px: tuple[int, int]) -> None:
        """Prepare for frames of (width, height)."""
        asked_px = SIDE_PX if asked_size_px(size_px) == size_px else 2 * SIDE_PX
        width, height = (-(-length // asked_px) for length in size_px)
        self._network = FrameEnsemble(estimator, (width, height), (width, height))
        self._colors = np.zeros((3, height, width), np.float32)
        self._slopes = np.zeros((2, height, width), np.float32)
        side_px = min(size_px)
        # Variances add: what the averages have not smoothed yet, in averages.
        left = (SMOOTHING * side_px) ** 2 - (asked_px**2 - 1) / 12
        self._sigma = math.sqrt(max(left, 0.01)) / asked_px
        width_px = 2 * -(-round(estimator.reach * side_px) // SIDE_PX) + 1
        self._around = np.ones((width_px, width_px), np.uint8)

    def __call__(self, small: Seen, disturbed: QuarterMask) -> QuarterMask:
        """Where colour or slope tells of a contact nearby, from what was prepared, quartered."""
        for every, fewer in zip(small.settled, self._colors, strict=True):
            cv2.resize(every, fewer.shape[::-1], dst=fewer, interpolation=cv2.INTER_AREA)
        self._network(small._replace(settled=self._colors), self._slopes)
        for slopes in self._slopes:
            cv2.GaussianBlur(slopes, (0, 0), self._sigma, dst=slopes)
        steep = (np.square(self._slopes).sum(0) > CLEAR_SLOPE**2).astype(np.uint8)
        quartered = cv2.resize(steep, disturbed.shape[::-1], interpolation=cv2.INTER_NEAREST)
        moved = disturbed.astype(np.uint8) | quartered
        return np.asarray(cv2.dilate(moved, self._around), bool)
