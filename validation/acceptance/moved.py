# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Has the blank gel's picture moved since the calibration: shifted, turned, come nearer?

Its film and its dots are searched for again: the affine map under which the two pictures, without
what is smooth in them, are most alike (enhanced correlation coefficient, Evangelidis and Psarakis,
IEEE TPAMI 30(10), 2008). It begins at no motion, and at the one shift that fits best.
"""

from collections.abc import Sequence

import cv2
import numpy as np
from jaxtyping import Float32, Float64

from recon.arrays import Unwarped
from validation.acceptance.gel import smooth

HIGH_PASS_PX = 6.0
CLIPPED, ODD = 3.0, 4.0
"""Standard deviations of a picture's levels at which they are cut off, and from which on they are
odd; by the median."""
AROUND, CROWDED = 1 / 40, 0.15
"""Of the shorter side, the square about a pixel, and the share of odd levels in it that makes it
strange."""
SCALES = (4, 2, 1)
LEAST_SIDE_PX = 32
"""Of a picture made smaller."""
STEPS, ENOUGH = 60, 1e-5
BLUR_PX = 5
LEAST_ALIKE = 0.25
"""Correlation of two pictures of one gel: 0.8 to 1 with noise of 1.5 grey levels; below this they
are strangers."""
LEAST_TEXTURE = 0.1
"""Correlation of pixels two apart: white noise has none, films and dots 0.3 to 0.9."""

Fine = Float32[np.ndarray, "h w"]
Affine = Float32[np.ndarray, "2 3"]


def moved_px(before: Unwarped, now: Float32[np.ndarray, "_ _ 3"]) -> float | None:
    """How far the corner that moved most is from where it was; ``None`` where nothing shows it.

    Infinite where the picture has another size or is not to be known again.
    """
    if before.shape != now.shape:
        return float("inf")
    old, new = fine(before), fine(now)
    if not textured(old):
        return None
    window = cv2.createHanningWindow(old.shape[::-1], cv2.CV_64F)
    shift, _ = cv2.phaseCorrelate(old.astype(np.float64), new.astype(np.float64), window)
    found = [_aligned(old, new, start_px) for start_px in ((0.0, 0.0), shift)]
    alike, motion = max(found, key=lambda item: item[0])
    return _farthest_px(motion, old.shape) if alike >= LEAST_ALIKE else float("inf")


def fine(image: Unwarped) -> Fine:
    """A picture's grey levels without what is smooth in them, and none of them outstanding.

    A speck, a scratch or glare would outweigh all of the film: levels are cut off, and where most
    around are, as on a worn patch, there is nothing to be recognised.
    """
    levels = np.asarray((image - smooth(image, HIGH_PASS_PX)).mean(-1), np.float32)
    spread = np.float32(1.4826 * np.median(np.abs(levels)))
    odd = (np.abs(levels) > ODD * spread).astype(np.float32)
    side_px = max(3, round(AROUND * min(levels.shape)))
    strange = cv2.blur(odd, (side_px, side_px)) > CROWDED
    return np.where(strange, np.float32(0), np.clip(levels, -CLIPPED * spread, CLIPPED * spread))


def textured(picture: Fine) -> bool:
    """Whether a picture without what is smooth shows more than noise."""
    if np.ptp(picture) < 1e-6:
        return False
    ahead = [(picture[:, :-2], picture[:, 2:]), (picture[:-2], picture[2:])]
    alike = [np.corrcoef(one.ravel(), other.ravel())[0, 1] for one, other in ahead]
    return bool(np.mean(alike) > LEAST_TEXTURE)


def _aligned(old: Fine, new: Fine, start_px: Sequence[float]) -> tuple[float, Affine]:
    """How alike the pictures are under the best motion near a shift, and that motion."""
    height, width = old.shape
    motion = np.array([[1, 0, start_px[0]], [0, 1, start_px[1]]], np.float32)
    alike = 0.0
    for scale in SCALES:
        if scale > 1 and min(width, height) < scale * LEAST_SIDE_PX:
            continue
        size_px = width // scale, height // scale
        pair = [cv2.resize(x, size_px, interpolation=cv2.INTER_AREA) for x in (old, new)]
        everywhere = np.full(size_px[::-1], 255, np.uint8)
        motion[:, 2] /= scale
        end = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, STEPS, ENOUGH)
        try:
            alike, found = cv2.findTransformECC(
                pair[0], pair[1], motion, cv2.MOTION_AFFINE, end, everywhere, BLUR_PX
            )
        except cv2.error:  # it found no way
            return 0.0, motion
        motion = np.asarray(found, np.float32)
        motion[:, 2] *= scale
    return float(alike), motion


def _farthest_px(motion: Affine, shape: tuple[int, int]) -> float:
    right, bottom = shape[1] - 1, shape[0] - 1
    corners: Float64[np.ndarray, "4 2"] = np.array(
        [[0, 0], [right, 0], [right, bottom], [0, bottom]], float
    )
    moved = corners @ motion[:, :2].T + motion[:, 2]
    return float(np.hypot(*(moved - corners).T).max())
