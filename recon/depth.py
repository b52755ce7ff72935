# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Slopes to depth: an unseen axis is inferred, slopes count by their doubt, gel is pressed in."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial

import cv2
import numpy as np
from jaxtyping import Float32

from recon import unet
from recon.arrays import ContactMask, DepthMap, GradientField
from recon.contact.disturbed import boundary_of
from recon.estimators import GradientEstimator
from recon.integration.poisson import Boundary, integrate
from recon.integration.pressed import Support, nearest_pressed
from recon.integration.weighed import (
    inferred_doubts,
    resting,
    shorter_side_mm,
    weighed_depth,
)
from recon.lights import Axis, line_turn_deg, unseen_axis
from recon.markers.filling import fill_gradients
from recon.medians import median
from recon.missing_axis.columns import weigh_columns
from recon.missing_axis.inference import (
    LONGEST_SIDE_PX,
    infer_missing_axis,
    resampled,
    working_size,
)
from recon.missing_axis.mirrored import mirrored, rows_beyond, within
from recon.missing_axis.moved import may_have_moved
from recon.missing_axis.turned import Turn
from recon.still import without_still
from sensor.toml import Pair
from sensor.unit import MissingAxis

SEEN_SHARE = 0.5
"""Share of the measured slope that is kept; the rest is the network's, which steepens walls that
were read too gentle, but also crests that were not."""

HINT_SHARE = 0.25
"""Share of an unseen slope that an estimator that looks around gives; the rest is the network's."""

LEAST_UNTOUCHED = 1e-3
"""Share of a frame below which its untouched pixels do not tell where the gel rests."""


@dataclass(frozen=True, kw_only=True)
class Depth:
    """Depth, and the slopes that it has."""

    gradient: GradientField
    """(h, w, 2): slopes of the depth along x and y, mm/mm."""
    depth_mm: DepthMap
    """(h, w), mm, positive where pushed in; noise may leave some below zero."""
    boundary: Boundary
    """``"dirichlet"``: the border was held at zero; ``"neumann"``: left free as gel moved there."""
    doubt: Float32[np.ndarray, "h w"] | None = None
    """How far off an inferred slope is expected to be, mm/mm; ``None`` where none was."""


@dataclass(frozen=True, kw_only=True)
class InferredField:
    """A gradient field of which the slope along one axis was inferred."""

    gradient: GradientField
    unseen: Axis
    """The axis whose slope was inferred."""
    doubt: Float32[np.ndarray, "h w"]
    """How far off the inferred slope is expected to be, mm/mm."""
    network_doubt: Float32[np.ndarray, "h w"]
    """The same as the network alone tells it; slopes count by it when they are integrated."""
    support: Support
    """Where the gel may have moved, as far as the lights tell."""


FreeDepth = Callable[[InferredField, Boundary], DepthMap]


def depth_of(
    gradient: GradientField,
    disturbed: ContactMask,
    estimator: GradientEstimator,
    *,
    missing: MissingAxis,
    lights_deg: Mapping[str, float] | None,
    mm_per_px: Pair,
    hidden: ContactMask | None = None,
    infer: Callable[[GradientField, ContactMask], Depth] | None = None,
) -> Depth:
    """Depth by an estimator's slopes.

    Args:
        gradient: (h, w, 2), mm/mm, of the estimator.
        disturbed: where the colour changed.
        estimator: that the slopes are of.
        missing: what stands in for a gradient that its channels' lights cannot see.
        lights_deg: where the lights sit; ``None`` where nobody said.
        mm_per_px: pixel pitch along x and y.
        hidden: where dots hid the colour; slopes are filled anew from slopes around them.
        infer: stands in for ``inferred_depth``, with all that the frames of a unit share prepared.
    """
    unseen = unseen_axis(lights_deg, estimator.channels)
    if hidden is not None:
        gradient = beneath_dots(gradient, hidden, unseen, mm_per_px)
    if missing == "network" and unseen is not None:
        hinted = estimator.looks_around
        if by_deg := line_turn_deg(lights_deg, estimator.channels):
            turn = Turn(size_px=disturbed.shape[::-1], mm_per_px=mm_per_px, by_deg=by_deg)
            return turned_depth(gradient, disturbed, unseen, turn, hinted=hinted)
        if infer is None:
            infer = partial(inferred_depth, unseen=unseen, mm_per_px=mm_per_px, hinted=hinted)
        return infer(gradient, disturbed)
    gradient = of_moved_gel(gradient, disturbed, estimator, missing, unseen)
    boundary = boundary_of(disturbed if estimator.reach is None else np.asarray(gradient.any(-1)))
    depth_mm = integrate(gradient, mm_per_px, boundary)
    rests = np.zeros_like(disturbed)
    if estimator.reach is not None:
        rests = resting(gradient, depth_mm, shorter_side_mm(disturbed.shape, mm_per_px))
        depth_mm = weighed_depth(depth_mm, gradient, mm_per_px, boundary, rests=rests)
    level_mm = 0.0 if rests.any() else untouched_depth(depth_mm, disturbed, boundary)
    return Depth(gradient=gradient, depth_mm=depth_mm - level_mm, boundary=boundary)


def beneath_dots(
    gradient: GradientField,
    hidden: ContactMask,
    unseen: Axis | None,
    mm_per_px: Pair,
) -> GradientField:
    """The gradient field, filled where dots hid the colour from slopes around them."""
    # Slopes of which one is not seen are not yet those of one surface.
    method = "surface" if unseen is None else "biharmonic"
    return fill_gradients(gradient, hidden, method, mm_per_px)


def of_moved_gel(
    gradient: GradientField,
    disturbed: ContactMask,
    estimator: GradientEstimator,
    missing: MissingAxis,
    unseen: Axis | None,
) -> GradientField:
    """The gradient field, zero where gel rests and, if that stands in for it, where unseen."""
    if estimator.reach is not None:
        gradient = without_still(gradient, disturbed, estimator.reach)
    if missing == "zero" and unseen is not None:
        gradient = without(unseen, gradient)
    return gradient


def turned_depth(
    gradient: GradientField, disturbed: ContactMask, unseen: Axis, turn: Turn, *, hinted: bool
) -> Depth:
    """Depth where the slope across an oblique line of lights is inferred.

    Args:
        gradient: (h, w, 2), mm/mm, of the estimator.
        disturbed: where the colour changed.
        unseen: the axis that no light shows, once the frame is turned.
        turn: of the frame, that lays the line along the other axis.
        hinted: as in ``infer_gradient``.
    """
    pitch_mm = (turn.pitch_mm, turn.pitch_mm)
    found = inferred_depth(
        turn.slopes(gradient), turn.mask(disturbed), unseen, pitch_mm, hinted=hinted
    )
    return Depth(
        gradient=turn.slopes_back(found.gradient),
        depth_mm=turn.back(found.depth_mm),
        boundary=found.boundary,
        doubt=None if found.doubt is None else turn.back(found.doubt),
    )


def inferred_depth(
    gradient: GradientField,
    disturbed: ContactMask,
    unseen: Axis,
    mm_per_px: Pair,
    *,
    hinted: bool,
    weights: unet.Weights | None = None,
    free_depth: FreeDepth | None = None,
) -> Depth:
    """Depth where the slope along one axis is inferred.

    Frames longer than the network sees are shrunk (``fewer_px``) before anything else; gradient,
    depth and doubt are interpolated from there, the slope that was measured as well.

    Where the edge cuts a contact along the lights, all this is done with the frame's mirror image
    beyond that edge (``recon.missing_axis.mirrored``), and takes two to three times as long.

    Args:
        gradient: (h, w, 2), mm/mm, of the estimator.
        disturbed: where the colour changed.
        unseen: the axis that no light shows.
        mm_per_px: pixel pitch along x and y.
        hinted: as in ``infer_gradient``.
        weights: of the network, which may bring its own layers (``unet.Layers``); the shipped ones
            unless given.
        free_depth: of a field of ``fewer_px``, before gel is pressed in; it is written into.
            ``weighed_integral`` with that pitch unless given, and for a frame that is mirrored.
    """
    height, width = disturbed.shape
    rows, columns, pitch_mm = fewer_px(height, width, mm_per_px)
    boundary, shrunk = boundary_of(disturbed), (rows, columns) != (height, width)
    if shrunk:
        gradient = resampled(gradient.astype(np.float32, copy=False), rows, columns)
        share = resampled(disturbed.astype(np.float32)[..., None], rows, columns)
        disturbed = share[..., 0] >= 0.5
    beyond = rows_beyond(disturbed, gradient, unseen, hinted=hinted)
    border = boundary
    if any(beyond):
        disturbed, gradient = mirrored(disturbed, gradient, unseen, beyond)
        boundary, border, free_depth = "neumann", boundary_of(disturbed), None
    field = infer_gradient(gradient, disturbed, unseen, pitch_mm, hinted=hinted, weights=weights)
    solve = free_depth or partial(weighed_integral, mm_per_px=pitch_mm)
    free_mm = solve(field, border)
    free_mm -= untouched_depth(free_mm, disturbed, border)
    depth_mm = nearest_pressed(free_mm, field.support, pitch_mm, border)

    def every(found: np.ndarray) -> np.ndarray:
        if any(beyond):
            found = within(found, unseen, beyond)
        return cv2.resize(found, (width, height)) if shrunk else found

    return Depth(
        gradient=every(field.gradient),
        depth_mm=every(depth_mm),
        boundary=boundary,
        doubt=every(field.doubt),
    )


def fewer_px(height: int, width: int, mm_per_px: Pair) -> tuple[int, int, Pair]:
    """Rows, columns and pitch of a frame: as the network sees it, if it is longer than that."""
    if max(height, width) <= LONGEST_SIDE_PX:
        return height, width, mm_per_px
    rows, columns = working_size(height, width, mm_per_px)
    return rows, columns, (mm_per_px[0] * width / columns, mm_per_px[1] * height / rows)


def weighed_integral(field: InferredField, boundary: Boundary, mm_per_px: Pair) -> DepthMap:
    """The depth of an inferred field, its slopes counting by their doubt."""
    plain_mm = integrate(field.gradient, mm_per_px, boundary)
    doubts = inferred_doubts(field.gradient, field.unseen, field.network_doubt)
    return weighed_depth(plain_mm, field.gradient, mm_per_px, boundary, doubts)


def untouched_depth(depth_mm: DepthMap, disturbed: ContactMask, boundary: Boundary) -> float:
    """The depth of gel that nothing touches, by which a free border's depth is levelled.

    A zero border holds it at zero; where hardly any is left, nothing is known of it.
    """
    untouched = ~disturbed
    known = np.count_nonzero(untouched)
    if boundary == "dirichlet" or known < LEAST_UNTOUCHED * untouched.size:
        return 0.0
    return median(depth_mm[untouched])


def without(unseen: Axis, gradient: GradientField) -> GradientField:
    """The gradient field with zero for the slope along an axis."""
    return np.where([unseen != "x", unseen != "y"], gradient, gradient.dtype.type(0))


def infer_gradient(
    gradient: GradientField,
    disturbed: ContactMask,
    unseen: Axis,
    mm_per_px: Pair,
    *,
    hinted: bool = False,
    weights: unet.Weights | None = None,
) -> InferredField:
    """The gradient field with what is inferred for its unseen axis.

    The inference is the network's, and that of plain integrals as far as they close. Where the gel
    cannot have moved, the network is shown flat gel and answers with it. Of the axis that was
    measured a share is kept (``SEEN_SHARE``), the rest is as the network corrects it. What the
    gradient field itself says of the unseen axis counts as a hint by ``HINT_SHARE`` where it is one
    (``hinted``), and else not at all.
    """
    known = 1 if unseen == "x" else 0
    seen = gradient[..., known]
    support = (
        may_have_moved(disturbed, seen) if unseen == "x" else may_have_moved(disturbed.T, seen.T).T
    )
    found = infer_missing_axis(
        seen,
        unseen,
        mm_per_px,
        support=support,
        weights=weights,
        longest_px=max(LONGEST_SIDE_PX, *seen.shape),
    )
    joined = weigh_columns(found, seen, unseen, support, mm_per_px)
    slopes = joined.gradient
    slopes[..., known] += SEEN_SHARE * (seen * support - slopes[..., known])
    if hinted:
        hint = gradient[..., 1 - known] * support
        slopes[..., 1 - known] += HINT_SHARE * (hint - slopes[..., 1 - known])
    return InferredField(
        gradient=slopes,
        unseen=unseen,
        doubt=joined.doubt,
        network_doubt=found.doubt,
        support=support,
    )
