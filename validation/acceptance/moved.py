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
from jaxtyping import Bool, Float32, Float64

from recon.arrays import Unwarped
from recon.medians import PER_MAD
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
END = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, STEPS, ENOUGH)
BLUR_PX = 5
LEAST_ALIKE = 0.25
"""Correlation of two pictures of one gel: 0.8 to 1 with noise of 1.5 grey levels; below this they
are strangers."""
TILE_PX = 16
APART_PX, APART = 1.2, 0.4
"""Pixels, or share of the motion if that is more, that halves of a picture may differ by: 0.1 on
three real gels at rest, 1.1 with JPEG of quality 40, and 2.0 where they moved by 11; 3.3 and more
where quality 60 has swallowed the film of a smooth rendered one."""
FAINT = 0.6 / 255
"""Standard deviation below which a film may be lost to a codec: 0.4 grey levels on rendered gels,
0.7 to 3 on five real ones."""
DARK = 1 / 255
LEAST_TEXTURE = 0.1
"""Correlation of pixels two apart: white noise has none, films and dots 0.3 to 0.9."""

Fine = Float32[np.ndarray, "h w"]
Affine = Float32[np.ndarray, "2 3"]
Corners = Float64[np.ndarray, "4 2"]
Half = Bool[np.ndarray, "h w"]


def moved_px(before: Unwarped, now: Float32[np.ndarray, "_ _ 3"]) -> float | None:
    """How far the corner that moved most is from where it was; ``None`` where nothing shows it.

    Infinite where the picture has another size or is not to be known again. Where the pictures as
    they are do not tell, as where the lights flicker, they are compared without bands.
    """
    if before.shape != now.shape:
        return float("inf")
    known = False
    for levels in (without_smooth, without_bands):
        old, new = fine(levels(before)), fine(levels(now))
        if not textured(old):
            return None
        alike, motion = _most_alike(old, new)
        if alike < LEAST_ALIKE:
            continue
        known = True
        moved = _farthest_px(motion, old.shape)
        if _halves_apart_px(old, new, motion) <= max(APART_PX, APART * moved):
            return moved
    faint = spread_of(without_bands(before)) < FAINT
    return None if known or faint else float("inf")


def without_smooth(image: Unwarped) -> Fine:
    """A picture's grey levels without what is smooth in them."""
    return np.asarray((image - smooth(image, HIGH_PASS_PX)).mean(-1), np.float32)


def without_bands(image: Unwarped) -> Fine:
    """And without what rows and columns share: a rolling shutter sees lights that flicker so.

    In proportion to the light, and by the median, which dots do not move.
    """
    levels = without_smooth(image)
    light = np.maximum(smooth(image, HIGH_PASS_PX).mean(-1), DARK).astype(np.float32)
    for axis in (1, 0):
        levels = levels - light * np.median(levels / light, axis=axis, keepdims=True)
    return np.asarray(levels, np.float32)


def spread_of(levels: Fine) -> float:
    """Their standard deviation, by the median."""
    return float(PER_MAD * np.median(np.abs(levels)))


def fine(levels: Fine) -> Fine:
    """Levels without what is smooth in them, and none of them outstanding.

    A speck, a scratch or glare would outweigh all of the film: levels are cut off, and where most
    around are, as on a worn patch, there is nothing to be recognised.
    """
    spread = np.float32(spread_of(levels))
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


def _most_alike(old: Fine, new: Fine) -> tuple[float, Affine]:
    """As ``_aligned``, from no motion or from the one shift that fits best."""
    window = cv2.createHanningWindow(old.shape[::-1], cv2.CV_64F)
    shift, _ = cv2.phaseCorrelate(old.astype(np.float64), new.astype(np.float64), window)
    found = [_aligned(old, new, start_px) for start_px in ((0.0, 0.0), shift)]
    return max(found, key=lambda item: item[0])


def _halves_apart_px(old: Fine, new: Fine, motion: Affine) -> float:
    """How far apart two halves of the picture put the same corner; root mean square of three ways.

    The halves are every second row of tiles, column of tiles, and tile of a chessboard. What a
    codec leaves of a faint film differs from block to block, and so the motions do.
    """
    rows, columns = np.indices(old.shape) // TILE_PX
    apart_px = []
    for tiles in (rows, columns, rows + columns):
        one, other = (_half_moved(old, new, motion, tiles % 2 == k) for k in (0, 1))
        if one is None or other is None:
            return float("inf")
        apart_px.append(np.hypot(*(one - other).T).max())
    return float(np.sqrt(np.mean(np.square(apart_px))))


def _half_moved(old: Fine, new: Fine, motion: Affine, half: Half) -> Corners | None:
    """Where the corners went by the motion, near one that is known, of part of a picture."""
    mask = np.where(half, 255, 0).astype(np.uint8)
    try:
        _, found = cv2.findTransformECC(
            old, new, motion.copy(), cv2.MOTION_AFFINE, END, mask, BLUR_PX
        )
    except cv2.error:  # it found no way
        return None
    return _moved_corners(np.asarray(found, np.float32), old.shape)


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
        try:
            alike, found = cv2.findTransformECC(
                pair[0], pair[1], motion, cv2.MOTION_AFFINE, END, everywhere, BLUR_PX
            )
        except cv2.error:  # it found no way
            return 0.0, motion
        motion = np.asarray(found, np.float32)
        motion[:, 2] *= scale
    return float(alike), motion


def _farthest_px(motion: Affine, shape: tuple[int, int]) -> float:
    still = _moved_corners(np.eye(2, 3, dtype=np.float32), shape)
    return float(np.hypot(*(_moved_corners(motion, shape) - still).T).max())


def _moved_corners(motion: Affine, shape: tuple[int, int]) -> Corners:
    right, bottom = shape[1] - 1, shape[0] - 1
    corners = np.array([[0, 0], [right, 0], [right, bottom], [0, bottom]], float)
    return np.asarray(corners @ motion[:, :2].T + motion[:, 2])
