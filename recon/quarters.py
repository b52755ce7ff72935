# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Masks at a quarter of the frame's resolution, one element for 4 x 4 pixels."""

from functools import reduce

import numpy as np
from jaxtyping import Bool

SIDE_PX = 4
QuarterMask = Bool[np.ndarray, "qh qw"]


def in_pixels(disturbed: QuarterMask, size_px: tuple[int, int]) -> Bool[np.ndarray, "h w"]:
    """The mask at the resolution of frames of (width, height)."""
    width, height = size_px
    large = disturbed.repeat(SIDE_PX, 0).repeat(SIDE_PX, 1)
    return large[:height, :width]


def in_quarters(mask: Bool[np.ndarray, "h w"]) -> QuarterMask:
    """True where a mask of pixels holds any of 4 x 4."""
    whole = np.pad(mask, [(0, -length % SIDE_PX) for length in mask.shape])
    rows = reduce(np.bitwise_or, (whole[k::SIDE_PX] for k in range(SIDE_PX)))
    return reduce(np.bitwise_or, (rows[:, k::SIDE_PX] for k in range(SIDE_PX)))
