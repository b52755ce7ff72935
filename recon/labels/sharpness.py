# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""How much of a sensor's fine structure a frame still shows: out of focus or shaken, it is lost.

The grain of a film, dust, dots and the edges of the pad are the same in every frame; a camera's
noise is not, and no lens blurs it. So a frame f and the blank frame b, of equal noise, are compared
by what they share: of the finest structure, of variance s in the blank frame, a blurred frame keeps
the amplitude h,

    var b = s + noise,  var f = h^2 s + noise,  cov(b, f) = h s,

and the noise falls out: (1 - h^2) / h = (var b - var f) / cov(b, f).
"""

import cv2
import numpy as np
from jaxtyping import Float32

from recon.arrays import Frame

FINEST_PX, COARSER_PX = 1.0, 2.0
"""Standard deviations of the two Gaussians whose difference is the finest structure."""
CALM = 0.6
"""Share of the frame that is compared, where it changed least: a contact hides what it presses."""
CALM_PX = 4.0
AKIN_PX = 16
"""So many pixels tell as much as one independent one: the Gaussians let neighbours share noise."""
CHANCE = 3.0
"""Standard deviations by which two variances of the same noise may differ."""


def detail_kept(frame: Frame, blank: Frame) -> float:
    """Amplitude of the finest structure in a frame, over that in the blank frame.

    Of 100 presses on seven sensors, real and rendered, 0.98 to 1; blurred by a Gaussian of 2 px
    before a noise of 0.6 grey levels, 0.09 to 0.61. Blur of 1 px is told on some sensors alone.

    Args:
        frame: raw, (h, w, 3).
        blank: one frame of the untouched gel, not an average, as its noise must be a frame's.

    Returns:
        About 1 for a sharp frame, and where the sensor has no structure that noise does not hide;
        0 where none is left.
    """
    gray_f, gray_b = (picture.astype(np.float32).mean(-1) for picture in (frame, blank))
    change = cv2.GaussianBlur(np.abs(gray_f - gray_b), (0, 0), CALM_PX)
    calm = change <= np.quantile(change, CALM)
    f, b = _finest(gray_f)[calm], _finest(gray_b)[calm]
    var_b, var_f, shared = float(np.mean(b * b)), float(np.mean(f * f)), float(np.mean(b * f))
    by_chance = CHANCE * np.sqrt(2 * AKIN_PX / calm.sum())
    lost = var_b * (1 - by_chance) - var_f
    if lost <= 0:
        return 1.0
    if shared <= 0:
        return 0.0
    half = lost / shared / 2
    return float(np.hypot(half, 1) - half)


def _finest(gray: Float32[np.ndarray, "h w"]) -> Float32[np.ndarray, "h w"]:
    fine, coarse = (cv2.GaussianBlur(gray, (0, 0), sigma) for sigma in (FINEST_PX, COARSER_PX))
    return np.asarray(fine - coarse, np.float32)
