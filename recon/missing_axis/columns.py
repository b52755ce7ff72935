# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""The unseen slope by plain integrals of the seen one, as far as those close.

Along each line of lights the depth is the integral of the slope that they show, zero at both ends
of the disturbed gel. A groove that runs along the lights is seen at its two ends only: such
integrals carry it from one to the other, where the network, which knows what contacts look like,
smears it. But they add up noise and false slopes along each line. What is left at a line's far end,
the misclosure, and depth that comes out below zero tell how much: where integrals and network
differ by more, the integrals are believed, and with them the slope as it was measured, which the
network smears as well.

By how much they differ also tells where the network is sure and wrong: its doubt knows nothing of
grooves that it never saw. So the doubt becomes the geometric mean of the two.
"""

import cv2
import numpy as np
from jaxtyping import Float, Float32

from recon.integration.pressed import Support
from recon.lights import Axis
from recon.missing_axis.inference import Completed
from sensor.toml import Pair

Slopes = Float[np.ndarray, "h w"]

SMOOTHING = 1 / 160
"""Of the frame's shorter side: standard deviation of a Gaussian across the lines, whose noise is
alike along a line and differs between neighbours."""
NEIGHBORHOOD = 3 / 160
"""Likewise, of the Gaussian over which a difference is held against the noise, and by which it
counts as doubt: that is of a place, while differences change sign from pixel to pixel."""


def depth_by_columns(
    known: Slopes, support: Support, pitch_mm: float
) -> tuple[Float32[np.ndarray, "h w"], Float32[np.ndarray, " w"]]:
    """Depth (mm) from each column's slopes, and each column's misclosure (mm).

    The misclosure is shared out over the column's disturbed gel. Errors may leave depth below zero.

    Args:
        known: ∂depth/∂y, mm/mm.
        support: where the gel may have moved; it is flat elsewhere.
        pitch_mm: of the pixels along y.
    """
    disturbed = support.astype(np.float32)
    climb_mm = known.astype(np.float32) * disturbed * np.float32(pitch_mm)
    misclosure = climb_mm.sum(axis=0)
    per_pixel_mm = misclosure / np.maximum(disturbed.sum(axis=0), 1)
    climb_mm -= per_pixel_mm * disturbed
    depth = np.cumsum(climb_mm, axis=0)
    depth -= climb_mm / 2  # at the pixels' middles
    return depth * disturbed, misclosure


def weigh_columns(
    network: Completed, known: Slopes, unseen: Axis, support: Support, mm_per_px: Pair
) -> Completed:
    """The gradient field between the network's and that of the integrals and the measured slope.

    Args:
        network: the field as the network completed it, mm/mm, and its doubt.
        known: the slope that was measured, mm/mm.
        unseen: the axis that was not.
        support: where the gel may have moved.
        mm_per_px: pixel pitch along x and y.
    """
    if unseen == "y":
        turned = weigh_columns(network.transposed(), known.T, "x", support.T, mm_per_px[::-1])
        return turned.transposed()
    gradient = network.gradient
    height, width = support.shape
    if width < 2 or not support.any():
        return network
    depth, misclosure = depth_by_columns(known, support, mm_per_px[1])
    by_columns, above_gel, unclosed = (
        np.gradient(_across(lines, SMOOTHING * min(height, width)), mm_per_px[0], axis=1)
        for lines in (np.maximum(depth, 0), np.minimum(depth, 0), misclosure[None, :])
    )
    apart = (by_columns - gradient[..., 0]) * support
    noise = np.square(unclosed[0, support.any(axis=0)]).mean() + np.square(above_gel).max(axis=0)
    around = cv2.GaussianBlur(apart**2, (0, 0), NEIGHBORHOOD * min(height, width))
    believed = around / (around + np.maximum(noise, np.float32(1e-12)))
    joined = gradient.copy()
    joined[..., 0] += believed * apart
    joined[..., 1] += believed * (known * support - gradient[..., 1])
    return Completed(gradient=joined, doubt=np.sqrt(network.doubt * np.sqrt(around)))


def _across(lines: Float32[np.ndarray, "n w"], sigma_px: float) -> Float32[np.ndarray, "n w"]:
    """Columns blurred into their neighbours."""
    return cv2.GaussianBlur(lines, (0, 0), sigmaX=sigma_px, sigmaY=1e-3)
