# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""The unseen slope by plain integrals of the seen one, as far as those close.

Along each line of lights the depth is the integral of the slope that they show, zero at both ends
of the disturbed gel. A groove that runs along the lights is seen at its two ends only: such
integrals carry it from one to the other, where the network, which knows what contacts look like,
smears it. But they add up noise along each line. What is left at a line's far end, the misclosure,
tells how much; network and integrals are weighed by it as by a variance.
"""

import cv2
import numpy as np
from jaxtyping import Float, Float32

from recon.arrays import GradientField
from recon.lights import Axis
from recon.pressed import Support
from sensor.toml import Pair

Slopes = Float[np.ndarray, "h w"]

SMOOTHING = 1 / 160
"""Of the frame's shorter side: standard deviation of a Gaussian across the lines, whose noise is
alike along a line and differs between neighbours."""
NETWORK_ERROR = 0.15
"""Misclosure over depth at which both are believed alike."""


def depth_by_columns(
    known: Slopes, support: Support, pitch_mm: float
) -> tuple[Float[np.ndarray, "h w"], Float[np.ndarray, " w"]]:
    """Depth (mm) from each column's slopes, and each column's misclosure (mm).

    The misclosure is shared out over the column's disturbed gel; depth below zero is cut off.

    Args:
        known: ∂depth/∂y, mm/mm.
        support: where the gel may have moved; it is flat elsewhere.
        pitch_mm: of the pixels along y.
    """
    slopes = np.where(support, known, 0)
    depth = (np.cumsum(slopes, axis=0) - slopes / 2) * pitch_mm
    misclosure = slopes.sum(axis=0) * pitch_mm
    passed = np.cumsum(support, axis=0) - support / 2
    share = passed / np.maximum(support.sum(axis=0), 1)
    return np.maximum(depth - share * misclosure, 0) * support, misclosure


def weigh_columns(
    gradient: GradientField, known: Slopes, unseen: Axis, support: Support, mm_per_px: Pair
) -> GradientField:
    """The gradient field whose inferred slope is a mean of the network's and the integrals'.

    Args:
        gradient: (h, w, 2), mm/mm, as the network completed it.
        known: the slope that was measured, mm/mm.
        unseen: the axis that was not.
        support: where the gel may have moved.
        mm_per_px: pixel pitch along x and y.
    """
    if unseen == "y":
        swapped = gradient.transpose(1, 0, 2)[..., ::-1]
        found = weigh_columns(swapped, known.T, "x", support.T, mm_per_px[::-1])
        return np.ascontiguousarray(found.transpose(1, 0, 2)[..., ::-1])
    height, width = support.shape
    depth, misclosure = depth_by_columns(known, support, mm_per_px[1])
    deepest_mm = float(np.linalg.norm(depth.max(axis=0, initial=0)))
    if width < 2 or deepest_mm == 0:
        return gradient
    open_share = float(np.linalg.norm(misclosure)) / deepest_mm
    weight = 1 / (1 + (open_share / NETWORK_ERROR) ** 2)
    sigma_px = SMOOTHING * min(height, width)
    across: Float32[np.ndarray, "h w"] = cv2.GaussianBlur(
        depth.astype(np.float32), (0, 0), sigmaX=sigma_px, sigmaY=1e-3
    )
    by_columns = np.gradient(across, axis=1) / mm_per_px[0] * support
    joined = gradient.copy()
    joined[..., 0] += np.float32(weight) * (by_columns - gradient[..., 0])
    return joined
