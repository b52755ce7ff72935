# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Names for the arrays that pass through reconstruction; shapes are checked under pytest.

Images are (height, width, 3) RGB. Frames and signs: ``docs/concepts/frames.md``.
"""

import numpy as np
from jaxtyping import Bool, Float, Float32, UInt8

Frame = UInt8[np.ndarray, "frame_h frame_w 3"]
"""A camera frame, RGB; its pixels are not those of the unwarped ones."""
Unwarped = Float32[np.ndarray, "h w 3"]
"""The gel plane, RGB in units of full scale, 0 to 1."""
Difference = Float32[np.ndarray, "h w 3"]
"""Unwarped frame minus unwarped background, signed, in units of full scale."""
GradientField = Float[np.ndarray, "h w 2"]
"""(d depth/dx, d depth/dy) in mm/mm."""
DepthMap = Float[np.ndarray, "h w"]
"""Indentation in mm, positive toward the camera; noise may leave some below zero."""
NormalMap = Float[np.ndarray, "h w 3"]
"""Unit normals of the skin in the gel frame, pointing out of the gel (z > 0)."""
ContactMask = Bool[np.ndarray, "h w"]
"""True where something touches."""
