# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Gel that did not move is flat: slopes far from everything that changed are noise and drift."""

import cv2
import numpy as np

from recon.arrays import ContactMask, GradientField

SMOOTHING = 1 / 120
"""Of the frame's shorter side: standard deviation of a Gaussian over the slopes."""
CLEAR_SLOPE = 0.12
"""Smoothed slopes beyond this are no drift, whatever the colour's noise is thought to be."""
REACH = 1 / 24
"""Of the frame's shorter side: gel follows what moved no farther than this, most of the time."""
LONG_COLLAR = 0.04
"""Of the frame's shorter side: a longer collar reaches farther."""
FARTHEST = 1 / 8
"""Of the frame's shorter side: with any collar."""


def reach_of(collar: float) -> float:
    """How far gel of such a collar follows what moved, in shares of the frame's shorter side.

    Depth beside a contact fades by exp(-x / s), and is cut off where slopes are no longer clear.
    What is left there grows with s, so that the reach grows faster than the collar.

    Args:
        collar: of the same shares; NaN where no collar was fitted.
    """
    return float(min(FARTHEST, REACH * np.fmax(1, collar / LONG_COLLAR) ** 3))


def without_still(
    gradient: GradientField, disturbed: ContactMask, reach: float = REACH
) -> GradientField:
    """The slopes, zero where neither colour nor slope tells of a contact nearby.

    Args:
        gradient: (h, w, 2), mm/mm.
        disturbed: where the colour changed.
        reach: how far gel follows what moved, in shares of the frame's shorter side.
    """
    side_px = min(disturbed.shape)
    smooth = cv2.GaussianBlur(gradient, (0, 0), SMOOTHING * side_px)
    moved = disturbed | (np.square(smooth).sum(-1) > CLEAR_SLOPE**2)
    width_px = 2 * round(reach * side_px) + 1
    near = cv2.dilate(moved.astype(np.uint8), np.ones((width_px, width_px), np.uint8))
    return np.asarray(gradient * near[..., None], np.float32)
