# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Where something touches the disturbed gel, and what only follows."""

from functools import partial

import cv2
import numpy as np
from jaxtyping import Float, Int
from scipy import ndimage

from recon.arrays import ContactMask, DepthMap, GradientField
from recon.contact.network import held
from sensor.toml import Pair

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
