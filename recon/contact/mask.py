# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Where the gel is disturbed, where something touches it, and whether that reaches the border."""

from functools import partial

import cv2
import numpy as np
from jaxtyping import Bool, Float, Float32, Int
from scipy import ndimage

from recon.arrays import ContactMask, DepthMap, Difference, GradientField
from recon.contact.network import held
from recon.integration.poisson import Boundary
from recon.medians import median
from sensor.toml import Pair

SMOOTHING_PX = 2.0
FINE_PX = 200
"""Of the shorter side: contacts in smaller frames have fewer pixels, so less is smoothed."""
NOISE_FACTOR = 8.0
"""A contact must change the colour by this many standard deviations of the blank gel..."""
LEAST_CHANGE = 0.03
"""...and by this share of full scale: seven grey levels of 255."""
WIDEST_STAINS = 0.1
"""More change than this is asked for by the frame's grain alone, not by its spread.

A grip of half the pad spreads the colours too. On 124 real presses of three sensors the spread
asked for 0.03 to 0.12, on six clips of grips for up to 0.3.
"""
BEYOND_ANY_GRIP = 0.9
"""Of the frame: with more disturbed gel it is dark, another sensor's, or of a camera that moved."""
LEAST_AREA = 8e-4
"""Smaller patches, as a share of the frame, are dust..."""
LEAST_PX = 12.0
"""...and in small frames, such ones are noise..."""
BESIDE_PX = 5
"""...unless a larger one lies so near: one light sees a small contact as two halves."""
HAIR_PX = 2
"""What is not wider than twice this is a hair."""
CROSS = np.array([[0, 1, 0], [1, 1, 1], [0, 1, 0]], np.uint8)
"""A pixel and its four neighbours."""
DEVIATION = 1.4826
"""Standard deviations in a median absolute deviation, of normal noise."""
BORDER_PX = 3
COLLAR_MM = 0.4
"""Over this length gel that nothing holds springs back, in a bonded layer some mm thick."""
SHALLOWEST = 0.1
"""Of the deepest point: what lies shallower is gel that follows, or a drift of the slopes."""
LEVELS = np.arange(0.02, 0.8125, 0.02)
"""Of its patch's depth: the pressures at which a contact's edge is looked for."""
LEVEL_SMOOTHING = 3.0
"""In levels."""
WITHIN, CROWN = (0.70, 0.76), (0.75, 0.84)
"""Mean slope within the steepest contour over that on it, and of what is pressed on hardest over
that on the middle contour: above both ranges flanks are plane, below either an object is round."""
AS_STEEP = (0.99, 0.7)
"""What share of the steepest contour's slope the last one must have, of round objects and of plane
flanks. On the former slopes grow toward the edge and the steepest contour is the edge; the latter
are as steep all the way, but for the errors of an estimator."""
FALLS = 0.8
"""The lowest contours' slope over the steepest one's: a collar that shows is less steep than this;
where none shows, pressure ends where the contact does."""
LOWEST_LEVELS = 4
CREST_SLOPE, CREST_SMOOTHING_PX = 0.3, 2.5
"""A crest beside a deeper contact is flatter than this share of the slopes there."""
CREST_PRESS = 0.15
"""More presses on a crest than its depth says, by this share of it. Where collars run out the two
differ by 0.03 to 0.09, on crests by 0.3 to 0.75 (averages of 9 patches on balls and shapes)."""


def disturbed_mask(difference: Difference) -> ContactMask:
    """Pixels whose colour changed by more than the gel's noise, holes filled, specks removed.

    The noise is estimated from the frame itself. Its median absolute deviation also sees stains
    wider than a pixel, but takes a contact that covers half of the pad for noise, so it counts up
    to ``WIDEST_STAINS`` only; what neighbours differ by is noise however much it is.
    """
    return disturbed_in_planes(np.ascontiguousarray(np.moveaxis(difference, -1, 0)))


def disturbed_in_planes(colors: Float32[np.ndarray, "3 h w"]) -> ContactMask:
    """``disturbed_mask`` of a difference image that comes as planes."""
    changed = np.zeros(colors.shape[1:], bool)
    if not (lit := lit_planes(colors)):
        return changed
    smoothing_px = SMOOTHING_PX * _fineness(changed)
    colors = colors[lit]
    smooth = np.zeros_like(colors)
    for plane, blurred in zip(colors, smooth, strict=True):
        cv2.GaussianBlur(plane, (0, 0), smoothing_px, dst=blurred)
    middle = np.array([median(plane) for plane in smooth], np.float32)
    away = smooth - middle[:, None, None]
    spread = spread_of(np.abs(away, out=away))
    steps = np.diff(colors, axis=2)
    grain = DEVIATION * median(np.abs(steps, out=steps)) / np.sqrt(2)
    smooth_grain = grain / (2 * np.sqrt(np.pi) * smoothing_px)  # white noise after the blur
    least = least_change(spread, smooth_grain)
    for plane, drift in zip(smooth, drift_of(middle), strict=True):
        plane -= drift
        changed |= np.abs(plane, out=plane) > least
    return large_patches(changed)


def spread_of(away: Float32[np.ndarray, "lit *pixels"]) -> float:
    """Standard deviation of lit colours that are so far from their medians.

    Colours without a light count as well, as zeros: of one colour or two a wide grip changes more
    than half, and would pass for stains of the blank gel.
    """
    unlit = np.zeros((3 - len(away), *away.shape[1:]), np.float32)
    return DEVIATION * median(np.concatenate([away, unlit]))


def lit_planes(colors: Float32[np.ndarray, "3 h w"]) -> list[int]:
    """Which colours have a light: the others are zero, and tell nothing of the noise."""
    return [index for index, plane in enumerate(colors) if plane.any()]


def large_patches(mask: ContactMask) -> ContactMask:
    """The mask without hairs, holes filled, and without specks that lie alone."""
    if not mask.size:
        return mask
    whole = np.pad(mask, 1).view(np.uint8)  # beyond the frame nothing is changed
    steps = round(HAIR_PX * _fineness(mask))
    inside = cv2.morphologyEx(whole, cv2.MORPH_OPEN, CROSS, iterations=steps)[1:-1, 1:-1]
    least_px = max(LEAST_AREA * mask.size, LEAST_PX)
    return filled_patches(inside.view(bool), BESIDE_PX, least_px)


def _fineness(mask: ContactMask) -> float:
    """How far to smooth a frame, from half for the smallest ones to 1."""
    return float(np.clip(min(mask.shape) / FINE_PX, 0.5, 1))


def filled_patches(mask: ContactMask, beside_px: int, least_px: float) -> ContactMask:
    """The mask with holes filled, without smaller specks that lie farther away from all patches."""
    whole = np.pad(mask, 1).view(np.uint8)
    _, gaps = cv2.connectedComponents(1 - whole, connectivity=4)
    filled = (gaps != gaps[0, 0]).view(np.uint8)[1:-1, 1:-1]
    _, patches, boxes, _ = cv2.connectedComponentsWithStats(filled, connectivity=4)
    large = boxes[:, cv2.CC_STAT_AREA] >= least_px
    large[0] = False
    near = cv2.dilate(large[patches].view(np.uint8), CROSS, iterations=beside_px)
    large[patches[near > 0]] = True
    large[0] = False
    disturbed: ContactMask = large[patches]
    return disturbed


def drift_of(middle: np.ndarray) -> np.ndarray:
    """How far each colour has drifted since the blank frame, from its median over the frame.

    Lights warm up, and a camera balances its white anew. More than the least change is no drift:
    a wide grip moves the median too.
    """
    return np.clip(middle, -LEAST_CHANGE, LEAST_CHANGE).astype(np.float32)


def least_change(spread: float, grain: float) -> float:
    """Change of a smoothed colour that tells a contact, in units of full scale.

    Args:
        spread: standard deviation of the smoothed colours over the frame.
        grain: of their white noise alone.
    """
    return max(LEAST_CHANGE, NOISE_FACTOR * grain, min(NOISE_FACTOR * spread, WIDEST_STAINS))


def contact_mask(
    disturbed: ContactMask, depth: DepthMap, gradient: GradientField, mm_per_px: Pair
) -> ContactMask:
    """Where something presses on the gel; the rest, the collar, only follows.

    A network tells what is held (``recon.contact.network``). It takes a collar that begins gently,
    as those of real gels do, for the object's flank; so each patch of dented gel ends besides where
    its pressure falls to the level of ``edge_levels``.

    Args:
        disturbed: where the colour changed; a dent counts where it holds some of it.
        depth: (h, w), mm.
        gradient: (h, w, 2), mm/mm.
        mm_per_px: pixel pitch along x and y.
    """
    patches, count = dents(disturbed, depth)
    inside = patches > 0
    if not inside.any():
        return inside
    owner = patches[inside]
    deepest = np.zeros(count)
    np.maximum.at(deepest, owner, depth[inside])
    pressure = pressure_mm(depth, gradient, mm_per_px)
    share = pressure[inside] / deepest[owner]
    steep = np.hypot(gradient[..., 0], gradient[..., 1])[inside]
    within = np.zeros_like(disturbed)
    within[inside] = share > edge_levels(owner, share, steep, count)[owner]
    found = held(depth, gradient, mm_per_px, inside)
    return with_crests(within, found, gradient, depth, pressure)


def dents(disturbed: ContactMask, depth: DepthMap) -> tuple[Int[np.ndarray, "h w"], int]:
    """The patches of dented gel that hold some that is disturbed, numbered, and one more than all.

    Elsewhere 0. What lies shallower than ``SHALLOWEST`` belongs to none.
    """
    dented = depth > SHALLOWEST * max(float(depth.max(initial=0)), 0.0)
    count, patches = cv2.connectedComponents(dented.astype(np.uint8), connectivity=8)
    touched = np.zeros(count, bool)
    touched[patches[disturbed & dented]] = True
    return np.where(touched[patches], patches, 0), count


def with_crests(
    within: ContactMask,
    found: ContactMask,
    gradient: GradientField,
    depth: DepthMap,
    pressure: DepthMap,
) -> ContactMask:
    """Held gel within the contours, and beyond them what rises to a crest or a face of its own.

    Their level is a share of a patch's deepest point, too high for what is shallow and hangs
    together with it: a bolt's shank beside its head. A collar has no crest: where it is flat it
    hollows, so that less presses on it than its depth says. What is beyond belongs to a crest
    where that is nearer than gel within. What the frame cuts is not told from a drift.

    Args:
        within: the contours.
        found: what is held, by the network.
        gradient: mm/mm.
        depth: mm.
        pressure: of ``pressure_mm``.
    """
    kept = within & found
    _, parts = cv2.connectedComponents((found & ~within).astype(np.uint8), connectivity=8)
    cut = np.unique(np.concatenate([parts[[0, -1]].ravel(), parts[:, [0, -1]].ravel()]))
    beyond = ~np.isin(parts, np.append(cut, 0))
    if not beyond.any() or not kept.any():
        return kept
    steep = cv2.GaussianBlur(np.hypot(gradient[..., 0], gradient[..., 1]), (0, 0), 1.0)
    level = beyond & (steep < CREST_SLOPE * np.quantile(steep[kept], 0.9))
    level &= cv2.GaussianBlur(pressure - depth, (0, 0), CREST_SMOOTHING_PX) > CREST_PRESS * depth
    crest = cv2.morphologyEx(level.astype(np.uint8), cv2.MORPH_OPEN, np.ones((3, 3), np.uint8))
    if not crest.any():
        return kept
    to_crest, to_kept = (
        cv2.distanceTransform((place == 0).astype(np.uint8), cv2.DIST_L2, 5)
        for place in (crest, kept)
    )
    return kept | (beyond & (to_crest < to_kept))


def edge_levels(
    owner: Int[np.ndarray, " n"],
    share: Float[np.ndarray, " n"],
    steep: Float[np.ndarray, " n"],
    count: int,
) -> Float[np.ndarray, " count"]:
    """The pressure at which each patch's contact ends, as a share of its depth.

    It is that of the last contour along which the skin is about as steep on average as along the
    steepest. -inf where slopes do not fall toward the patch's rim: no collar shows.

    Args:
        owner: the patch that each pixel belongs to.
        share: pressure there over the patch's greatest depth.
        steep: slope there.
        count: of patches.
    """
    bins = len(LEVELS) + 1
    place = owner * bins + np.digitize(share, LEVELS)
    pixels, slopes = (
        np.bincount(place, weights, minlength=count * bins)
        .reshape(count, bins)[:, 1:]
        .astype(float)
        for weights in (None, steep)
    )
    along_levels = partial(ndimage.gaussian_filter1d, sigma=LEVEL_SMOOTHING, axis=1)
    mean_slope = along_levels(slopes[:, :-1]) / np.maximum(along_levels(pixels[:, :-1]), 1e-9)
    peak, patch = mean_slope.argmax(1), np.arange(count)
    steepest = np.maximum(mean_slope[patch, peak], 1e-9)
    above_peak = np.arange(bins - 1) >= peak[:, None]
    enclosed = (slopes * above_peak).sum(1) / np.maximum((pixels * above_peak).sum(1), 1)
    crown = (
        slopes[:, -1] / np.maximum(pixels[:, -1], 1) / np.maximum(np.median(mean_slope, 1), 1e-9)
    )
    plane = np.minimum(
        np.interp(enclosed / steepest, WITHIN, (0, 1)), np.interp(crown, CROWN, (0, 1))
    )
    enough = np.interp(plane, (0, 1), AS_STEEP) * steepest
    last = (mean_slope >= enough[:, None]).argmax(1)
    level = (LEVELS[:-1] + np.diff(LEVELS) / 2)[last]
    falls = mean_slope[:, :LOWEST_LEVELS].mean(1) < FALLS * steepest
    return np.where(falls, level, -np.inf)


def pressure_mm(depth: DepthMap, gradient: GradientField, mm_per_px: Pair) -> DepthMap:
    """Pressure on the gel, as the depth that it would hold down alone.

    A thin bonded gel is springs that drag their neighbours along (Vlasov's foundation): the
    pressure is ``k (w - s^2 laplace(w))``, and zero where the gel only follows.
    """
    along_x, along_y = (
        cv2.GaussianBlur(np.ascontiguousarray(gradient[..., axis]), (0, 0), 1.0) for axis in (0, 1)
    )
    bend_x = cv2.Sobel(along_x, -1, 1, 0, ksize=1) / (2 * mm_per_px[0])
    bend_y = cv2.Sobel(along_y, -1, 0, 1, ksize=1) / (2 * mm_per_px[1])
    return np.asarray(depth - COLLAR_MM**2 * (bend_x + bend_y))


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
