# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Skin that a light does not reach, because a dent is in its way.

Light enters the gel from its sides and grazes the skin. Along its azimuth a ray that climbs away
from the camera's side by the light's elevation meets the skin once; where it has passed a deeper
place of the skin before, that place casts a shadow. There the light's colour says nothing of the
slope, and the slope that an estimator reads from it is not to be believed.
"""

from collections.abc import Mapping

import cv2
import numpy as np
from jaxtyping import Bool

from recon.arrays import DepthMap, Difference
from recon.windows import window_about
from sensor.toml import Pair

GRAZING = 0.25
"""Tangent of a light's elevation over the skin: lowest that reaches most of a pad."""
LEAST_DARKER = 0.03
"""Of full scale: what a shadow takes from its colour at least."""
LEAST_DEPTH_MM = 0.01
"""A ray that passes the skin by less is not stopped."""


def cast_shadows(
    difference: Difference,
    depth_mm: DepthMap,
    lights_deg: Mapping[str, float],
    mm_per_px: Pair,
) -> Bool[np.ndarray, "h w 3"]:
    """Where each colour's light is blocked and its colour darker than on the blank gel.

    Args:
        difference: unwarped frame minus unwarped background.
        depth_mm: (h, w).
        lights_deg: azimuth that each of R, G and B comes from; a colour without one has no shadow.
        mm_per_px: pixel pitch along x and y.
    """
    shadows = np.zeros(difference.shape, bool)
    dented = depth_mm > LEAST_DEPTH_MM
    if not dented.any():
        return shadows
    reach_mm = float(depth_mm.max()) / GRAZING
    margin_x, margin_y = (int(reach_mm / pitch) + 2 for pitch in mm_per_px)
    window = window_about(dented, (margin_x, margin_y))
    depth = np.ascontiguousarray(depth_mm[window], np.float32)
    for channel, azimuth_deg in lights_deg.items():
        index = "RGB".index(channel)
        dark = difference[(*window, index)] < -LEAST_DARKER
        if dark.any():
            shadows[(*window, index)] = dark & _blocked(depth, azimuth_deg, reach_mm, mm_per_px)
    return shadows


def _blocked(
    depth_mm: DepthMap, azimuth_deg: float, reach_mm: float, mm_per_px: Pair
) -> Bool[np.ndarray, "h w"]:
    """Where the way to the light passes deeper skin."""
    step_mm = min(mm_per_px)
    toward = np.array([np.cos(np.radians(azimuth_deg)), np.sin(np.radians(azimuth_deg))])
    step_px = toward * step_mm / mm_per_px
    height, width = depth_mm.shape
    overhang = np.full((height, width), -np.inf, np.float32)
    for count in range(2, int(reach_mm / step_mm) + 1):  # a neighbour is slope, not shadow
        shift = np.array([[1, 0, count * step_px[0]], [0, 1, count * step_px[1]]], np.float32)
        there = cv2.warpAffine(
            depth_mm,
            shift,
            (width, height),
            flags=cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP,
            borderMode=cv2.BORDER_REPLICATE,
        )
        np.maximum(overhang, there - np.float32(count * step_mm * GRAZING), out=overhang)
    return np.asarray(overhang - depth_mm > LEAST_DEPTH_MM)
