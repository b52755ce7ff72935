# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Where colours changed, so that gel may have moved, and whether that reaches the border."""

from collections.abc import Callable

import cv2
import numpy as np
from jaxtyping import Bool, Float32, UInt8

from recon.arrays import ContactMask, Difference
from recon.integration.poisson import Boundary
from recon.medians import PER_MAD, median
from recon.windows import window_about

SMOOTHING_PX = 2.0
FINE_PX = 200
"""Frames with a shorter side below this are smoothed less: contacts have fewer pixels there."""
NOISE_FACTOR = 8.0
"""A contact must change the colour by this many standard deviations of the blank gel..."""
LEAST_CHANGE = 0.03
"""...and by this share of full scale: seven grey levels of 255."""
WIDEST_STAINS = 0.1
"""The frame's spread asks for no more change than this; its grain may.

A grip of half the pad spreads the colours too. On 124 real presses of three sensors the spread
asked for 0.03 to 0.12, on six clips of grips for up to 0.3.
"""
WIDE, GENTLE = 0.05, (0.45, 0.5)
"""A face as wide as the pad makes a spread itself. So where more than the share ``WIDE`` of the
frame has changed, and the spread asks for more than the second share of the largest change, the
least change is enough; below the first share, what the spread asks for stands. Balls change colours
by 2.5 to 10 times what their spread asks for (160 real presses), and the marks that a grip leaves
cover less of a frame."""
FAINT, FAINTEST = 0.15, 0.01
"""Wide flanks of what is found reach down to this share of the largest change, but not below this
share of full scale."""
RIM_PX = 4
"""Flanks narrower than about one and a half times this are the blur's."""
ENOUGH_PX = 1000
"""Pixels from which the median of what did not change is taken, about."""
BEYOND_ANY_GRIP = 0.9
"""A frame with a larger share disturbed is dark, another sensor's, or of a camera that moved."""
STRANGE = "nearly all of the frame differs from the blank gel"
"""What is said of such a frame."""
LEAST_AREA = 8e-4
"""Smaller patches, as a share of the frame, are dust..."""
LEAST_PX = 12.0
"""...and in small frames, patches of fewer pixels are noise..."""
BESIDE_PX = 5
"""...unless a larger patch lies this near: one light sees a small contact as two halves."""
HAIR_PX = 2
"""What is not wider than twice this is a hair."""
CROSS = np.array([[0, 1, 0], [1, 1, 1], [0, 1, 0]], np.uint8)
"""A pixel and its four neighbours."""
OUTSIDE = 2
"""Fills what is beyond all patches; holes stay."""
BORDER_PX = 3


def disturbed_mask(difference: Difference) -> ContactMask:
    """Pixels whose colour changed by more than the gel's noise, holes filled, specks removed.

    The noise is estimated from the frame itself. Its median absolute deviation also sees stains
    wider than a pixel, but takes a contact that covers half of the pad for noise, so it counts up
    to ``WIDEST_STAINS`` only; what neighbours differ by is noise however much it is.
    """
    return disturbed_in_planes(np.ascontiguousarray(np.moveaxis(difference, -1, 0)))


def disturbed_in_planes(colors: Float32[np.ndarray, "3 h w"]) -> ContactMask:
    """``disturbed_mask`` of a difference image that comes as planes."""
    if not (lit := lit_planes(colors)):
        return np.zeros(colors.shape[1:], bool)
    colors = colors[lit]
    smoothing_px = SMOOTHING_PX * _fineness(colors.shape[1:])
    smooth = np.stack([cv2.GaussianBlur(plane, (0, 0), smoothing_px) for plane in colors])
    steps = np.diff(colors, axis=2)
    grain = PER_MAD * median(np.abs(steps, out=steps)) / np.sqrt(2)
    smooth_grain = grain / (2 * np.sqrt(np.pi) * smoothing_px)  # white noise after the blur
    rim_px = round(RIM_PX * _fineness(colors.shape[1:]))
    return disturbed_in_smooth(smooth, smooth_grain, large_patches, rim_px)


def disturbed_in_smooth(
    smooth: Float32[np.ndarray, "lit h w"],
    grain: float,
    patches: Callable[[ContactMask], ContactMask],
    rim_px: int,
    every: int = 1,
) -> ContactMask:
    """What is disturbed by smoothed colours.

    Args:
        smooth: planes of all colours that have a light.
        grain: standard deviation of their white noise.
        patches: leaves out what is too small in a mask of such pixels, and fills holes.
        rim_px: narrower flanks than about one and a half times this are the blur's.
        every: medians are told by every so many rows and columns.
    """
    some = smooth[:, ::every, ::every]
    middle = _medians(some)
    least = least_change(np.abs(some - middle), grain)
    changed = patches(_farthest(smooth, drift_of(middle)) > least)
    rest = np.flatnonzero(~changed[::every, ::every])
    if not changed.any() or not rest.size:
        return changed
    few = some.reshape(len(some), -1)[:, rest[:: max(1, rest.size // ENOUGH_PX)]]
    change = _farthest(smooth, _medians(few[..., None]))
    faint = max(FAINT * float(change.max()), FAINTEST, NOISE_FACTOR * grain)
    return with_flanks(changed, patches(change > faint), rim_px) if faint < least else changed


def with_flanks(changed: ContactMask, faintly: ContactMask, rim_px: int) -> ContactMask:
    """What changed, and the wide flanks that hang together with it and changed faintly.

    A flat face on a domed gel has flanks so gentle that hardly more than its corners changes much.
    Around a contact with a rim the faint flank is as narrow as the blur.
    """
    if not changed.any():
        return changed
    window = window_about(changed | faintly, 1)
    core = changed[window]
    beside = (faintly[window] & ~core).view(np.uint8)
    wide = cv2.morphologyEx(beside, cv2.MORPH_OPEN, CROSS, iterations=rim_px) > 0
    count, parts = cv2.connectedComponents((core | wide).view(np.uint8), connectivity=4)
    joined = np.zeros(count, bool)
    joined[parts[core]] = True
    joined[0] = False
    return _put_back(core | joined[parts], window, changed)


def _medians(planes: Float32[np.ndarray, "lit h w"]) -> Float32[np.ndarray, "lit 1 1"]:
    """Of each plane, to be taken off it."""
    return np.array([median(plane) for plane in planes], np.float32)[:, None, None]


def _farthest(
    planes: Float32[np.ndarray, "lit h w"], middle: Float32[np.ndarray, "lit 1 1"]
) -> Float32[np.ndarray, "h w"]:
    """How far any plane is from its middle."""
    return np.asarray(np.abs(planes - middle).max(0))


def spread_of(away: Float32[np.ndarray, "lit *pixels"]) -> float:
    """Standard deviation of lit colours that are so far from their medians.

    Colours without a light count as well, as zeros: of one colour or two a wide grip changes more
    than half, and would pass for stains of the blank gel.
    """
    unlit = np.zeros((3 - len(away), *away.shape[1:]), np.float32)
    return PER_MAD * median(np.concatenate([away, unlit]))


def lit_planes(colors: Float32[np.ndarray, "3 h w"]) -> list[int]:
    """Which colours have a light: the others are zero, and tell nothing of the noise."""
    # The first row tells nearly always, in no time.
    return [index for index, plane in enumerate(colors) if plane[:1].any() or plane.any()]


def large_patches(mask: ContactMask) -> ContactMask:
    """The mask without hairs, holes filled, and without specks that lie alone."""
    if not mask.any():
        return mask
    window = window_about(mask, 0)
    whole = _ringed(mask[window])  # beyond it nothing is changed
    steps = round(HAIR_PX * _fineness(mask.shape))
    inside = cv2.morphologyEx(whole, cv2.MORPH_OPEN, CROSS, iterations=steps)[1:-1, 1:-1]
    least_px = max(LEAST_AREA * mask.size, LEAST_PX)
    return filled_patches(_put_back(inside.view(bool), window, mask), BESIDE_PX, least_px)


def _fineness(shape: tuple[int, ...]) -> float:
    """How far to smooth a frame, from half for the smallest ones to 1."""
    return float(np.clip(min(shape) / FINE_PX, 0.5, 1))


def filled_patches(mask: ContactMask, beside_px: int, least_px: float) -> ContactMask:
    """The mask with holes filled, without smaller specks that lie farther away from all patches."""
    if not mask.any():
        return mask
    window = window_about(mask, 0)
    whole = _ringed(mask[window])
    cv2.floodFill(whole, None, (0, 0), OUTSIDE)
    filled = whole[1:-1, 1:-1] != OUTSIDE
    _, patches, boxes, _ = cv2.connectedComponentsWithStats(filled.view(np.uint8), connectivity=4)
    large = boxes[:, cv2.CC_STAT_AREA] >= least_px
    if large[1:].all():
        return _put_back(filled, window, mask)
    large[0] = False
    near = cv2.dilate(large[patches].view(np.uint8), CROSS, iterations=beside_px)
    large[patches[near > 0]] = True
    large[0] = False
    return _put_back(large[patches], window, mask)


def _ringed(
    part: Bool[np.ndarray, "rows columns"],
) -> UInt8[np.ndarray, "ringed_rows ringed_columns"]:
    """With a pixel of nothing all around."""
    ringed: np.ndarray = cv2.copyMakeBorder(part.view(np.uint8), 1, 1, 1, 1, cv2.BORDER_CONSTANT)
    return ringed


def _put_back(
    part: Bool[np.ndarray, "rows columns"], window: tuple[slice, slice], like: ContactMask
) -> ContactMask:
    """A frame's mask that is empty but for a window; work on all of a frame would cost more."""
    whole = np.zeros_like(like)
    whole[window] = part
    return whole


def drift_of(middle: Float32[np.ndarray, "lit 1 1"]) -> Float32[np.ndarray, "lit 1 1"]:
    """How far each colour has drifted since the blank frame, from its median over the frame.

    Lights warm up, and a camera balances its white anew. More than the least change is no drift:
    a wide grip moves the median too.
    """
    return np.clip(middle, -LEAST_CHANGE, LEAST_CHANGE)


def least_change(around: Float32[np.ndarray, "lit h w"], grain: float) -> float:
    """Change of a smoothed colour that tells a contact, in units of full scale.

    Args:
        around: how far smoothed colours are from their medians.
        grain: standard deviation of their white noise.
    """
    asked = min(NOISE_FACTOR * spread_of(around), WIDEST_STAINS)
    if asked > LEAST_CHANGE:
        change = around.max(0)
        if np.count_nonzero(change > LEAST_CHANGE) > WIDE * change.size:
            share = asked / float(change.max())
            asked = float(np.interp(share, GENTLE, (asked, LEAST_CHANGE)))
    return max(LEAST_CHANGE, NOISE_FACTOR * grain, asked)


def is_strange(disturbed: Bool[np.ndarray, "_ _"]) -> bool:
    """Whether more gel is disturbed than any touch does, so that slopes mean little."""
    return bool(disturbed.mean() > BEYOND_ANY_GRIP)


def boundary_of(disturbed: ContactMask) -> Boundary:
    """The border that suits a frame: free where the disturbance reaches the edge, else zero.

    A zero border resists a constant bias of the slopes but flattens what touches the edge; a
    free border is the reverse.
    """
    inner = disturbed[BORDER_PX:-BORDER_PX, BORDER_PX:-BORDER_PX]
    return "neumann" if disturbed.sum() > inner.sum() else "dirichlet"
