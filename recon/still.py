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
MARGIN = 1 / 24
"""Of the frame's shorter side: the skin's last rise lies within this distance of what moved."""


def without_still(gradient: GradientField, disturbed: ContactMask) -> GradientField:
    """The slopes, zero where neither colour nor slope tells of a contact nearby.

    Args:
        gradient: (h, w, 2), mm/mm.
        disturbed: where the colour changed.
    """
    side_px = min(disturbed.shape)
    smooth = cv2.GaussianBlur(gradient, (0, 0), SMOOTHING * side_px)
    moved = disturbed | (np.square(smooth).sum(-1) > CLEAR_SLOPE**2)
    width_px = 2 * round(MARGIN * side_px) + 1
    near = cv2.dilate(moved.astype(np.uint8), np.ones((width_px, width_px), np.uint8))
    return np.asarray(gradient * near[..., None], np.float32)
