# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""A frame through a calibrated unit: difference, gradients, depth, contact."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

import numpy as np
from jaxtyping import Float32

from recon.arrays import ContactMask, DepthMap, Difference, Frame, GradientField
from recon.calibration import Calibration, load_calibration
from recon.columns import weigh_columns
from recon.contact import boundary_of, contact_mask, disturbed_mask
from recon.contact_patches import ContactPatch, contact_patches
from recon.estimators import GradientEstimator, gradient_field
from recon.lights import Axis, unseen_axis
from recon.markers.detection import unexpected_dots
from recon.markers.filling import fill_gradients
from recon.markers.tracking import MarkerTracker, Tracked, marker_tracker
from recon.missing_axis import infer_missing_axis
from recon.moved import may_have_moved
from recon.poisson import Boundary, integrate
from recon.pressed import Support, nearest_pressed
from recon.shadows import cast_shadows
from recon.still import without_still
from recon.weighed import inferred_doubts, weighed_depth
from sensor.toml import Pair
from sensor.unit import MissingAxis

SEEN_SHARE = 0.5
"""Of the slope that was measured is kept, the rest is what the network makes of it: it steepens
walls that were read too gentle, and crests that were not."""
FieldNear = Callable[[GradientEstimator, Difference, ContactMask], GradientField]
"""Slopes of an estimator, of a difference image that is disturbed somewhere."""

HINT_SHARE = 0.25
"""Of an unseen slope is taken from an estimator that looks around, the rest from the network."""


@dataclass(frozen=True, kw_only=True)
class Reconstruction:
    """What one frame says."""

    difference: Difference
    gradient: GradientField
    depth_mm: DepthMap
    disturbed: ContactMask
    """Where the colour changed."""
    boundary: Boundary
    mm_per_px: Pair
    lights_deg: Mapping[str, float] | None = None
    """Where the lights sit; ``None`` where nobody said."""
    doubt: Float32[np.ndarray, "h w"] | None = None
    """How far off an inferred slope is expected to be, mm/mm; ``None`` where both were measured."""
    dots: Tracked | None = None
    """Of a marker gel: where each dot is now."""
    markers: str = "none"
    """A word on the dots: "none", "tracked", "jumped", "lost", or what does not fit the unit."""

    @cached_property
    def contact(self) -> ContactMask:
        """Where something touches; worked out when first asked for."""
        return contact_mask(self.disturbed, self.depth_mm, self.gradient, self.mm_per_px)

    @property
    def patches(self) -> tuple[ContactPatch, ...]:
        """The separate places of contact, the largest first."""
        return contact_patches(self.contact, self.depth_mm, self.mm_per_px)

    @property
    def shadow(self) -> ContactMask:
        """Where dented skin keeps a light off: the slopes there are to be doubted."""
        lights = self.lights_deg or {}
        shadows = cast_shadows(self.difference, self.depth_mm, lights, self.mm_per_px)
        return np.asarray(shadows.any(-1))


class Reconstructor:
    """Frames of one unit to depth.

    Once per unit, then for each frame:

        reconstruct = Reconstructor.load("units/wedge-001", background)
        depth_mm = reconstruct(frame).depth_mm
    """

    def __init__(self, calibration: Calibration, background: Frame | None = None) -> None:
        """Prepare the maps for a unit.

        Args:
            calibration: the unit.
            background: a blank frame of today; by default the one of the calibration.

        Raises:
            WedgeError: the background has another size than the unit's frames.
        """
        self.calibration = calibration
        self.unwarp = calibration.unwarp
        self._blank = self.unwarp(calibration.background if background is None else background)
        self._tracker = marker_tracker(self._blank)
        self._misfit = _misfit(calibration.card.markers, self._tracker)
        self._seen_frame = False

    @classmethod
    def load(cls, folder: str | Path, background: Frame | None = None) -> "Reconstructor":
        """Read a unit folder and prepare its maps.

        Raises:
            WedgeError: the folder is not a unit folder or is damaged.
        """
        return cls(load_calibration(Path(folder)), background)

    def __call__(self, frame: Frame) -> Reconstruction:
        """Reconstruct one frame (h, w, 3) uint8 RGB.

        Raises:
            WedgeError: the frame has another size than the unit's frames.
        """
        card = self.calibration.card
        image = self.unwarp(frame)
        difference, dots, hidden = image - self._blank, None, None
        if self._tracker is not None:
            dots = self._tracker.track(image)
            hidden = self._tracker.hidden(dots)
            difference = fill_gradients(difference, hidden, "harmonic")
        elif not self._seen_frame:
            self._seen_frame = True
            self._misfit = self._misfit or unexpected_dots(image)
        found = reconstruct(
            difference,
            self.calibration.estimator,
            missing=card.missing_axis,
            lights_deg=card.lights_deg,
            mm_per_px=card.mm_per_px,
            hidden=hidden,
        )
        word = self._misfit or ("none" if dots is None else dots.word)
        return replace(found, dots=dots, markers=word)


def field_everywhere(
    estimator: GradientEstimator, difference: Difference, _: ContactMask
) -> GradientField:
    """All slopes, wherever the gel is disturbed."""
    return gradient_field(estimator, difference)


def reconstruct(
    difference: Difference,
    estimator: GradientEstimator,
    *,
    missing: MissingAxis,
    lights_deg: Mapping[str, float] | None,
    mm_per_px: Pair,
    hidden: ContactMask | None = None,
    field: FieldNear = field_everywhere,
) -> Reconstruction:
    """A difference image to gradients, depth and contact.

    Args:
        difference: unwarped frame minus unwarped background.
        estimator: from colour to gradient, fitted for some channels.
        missing: what stands in for a gradient that those channels' lights cannot see.
        lights_deg: where the lights sit; ``None`` where nobody said.
        mm_per_px: pixel pitch along x and y.
        hidden: where dots hid the colour; the difference is filled there, and slopes are filled
            anew from slopes around them.
        field: takes the estimator's slopes of a difference image, disturbed where it is told.
    """
    lit = np.array([channel in estimator.channels for channel in "RGB"], np.float32)
    disturbed = disturbed_mask(difference * lit)
    unseen = unseen_axis(lights_deg, estimator.channels)
    gradient = field(estimator, difference, disturbed)
    if hidden is not None:
        # Slopes of which one is not seen are not yet those of one surface.
        method = "surface" if unseen is None else "biharmonic"
        gradient = fill_gradients(gradient, hidden, method, mm_per_px)
    # What infers an axis finds by itself what cannot have moved.
    knows_still = estimator.flattens and missing != "network"
    if knows_still:
        gradient = without_still(gradient, disturbed)
    completed = complete_gradient(
        gradient, disturbed, missing, unseen, mm_per_px, hinted=estimator.looks_around
    )
    gradient = completed.gradient
    boundary = boundary_of(disturbed)
    depth = integrate(gradient, mm_per_px, boundary)
    if knows_still:
        depth = weighed_depth(depth, gradient, mm_per_px, boundary)
    elif unseen is not None and completed.doubt is not None:
        doubts = inferred_doubts(gradient, unseen, completed.doubt)
        depth = weighed_depth(depth, gradient, mm_per_px, boundary, doubts)
    if boundary == "neumann" and not disturbed.all():
        depth -= np.median(depth[~disturbed])  # untouched gel lies at zero
    if completed.support is not None:
        depth = nearest_pressed(depth, completed.support, mm_per_px, boundary)
    return Reconstruction(
        difference=difference,
        gradient=gradient,
        depth_mm=depth,
        disturbed=disturbed,
        boundary=boundary,
        mm_per_px=mm_per_px,
        lights_deg=lights_deg,
        doubt=completed.doubt,
    )


def _misfit(recorded: Mapping[str, float] | None, found: MarkerTracker | None) -> str:
    """What is wrong where the unit's record and the blank gel disagree about dots; else empty."""
    if recorded is not None and found is None:
        return f"none, but the unit has {recorded['count']:g}: is this its gel, in focus?"
    if recorded is None and found is not None:
        return f"{len(found.markers)} dots, but the unit was calibrated without: calibrate it anew"
    return ""


@dataclass(frozen=True, kw_only=True)
class CompletedField:
    """A gradient field whose unseen axis was replaced, and what goes with an inference."""

    gradient: GradientField
    doubt: Float32[np.ndarray, "h w"] | None = None
    """How far off the inferred slope is expected to be; ``None`` where nothing was inferred."""
    support: Support | None = None
    """Where the gel may have moved, as far as the lights tell; ``None`` likewise."""


def complete_gradient(
    gradient: GradientField,
    disturbed: ContactMask,
    missing: MissingAxis,
    unseen: Axis | None,
    mm_per_px: Pair,
    *,
    hinted: bool = False,
) -> CompletedField:
    """The gradient field with its unseen axis replaced by zero or by what is inferred of it.

    The inference is the network's, and that of plain integrals as far as they close. Where the gel
    cannot have moved, the network is shown flat gel and answers with it. Of the axis that was
    measured a share is kept (``SEEN_SHARE``), the rest is as the network corrects it. What the
    gradient field itself says of the unseen axis counts as a hint by ``HINT_SHARE`` where it is one
    (``hinted``), and else not at all.
    """
    if missing == "none" or unseen is None:
        return CompletedField(gradient=gradient)
    known = 1 if unseen == "x" else 0
    if missing == "zero":
        complete = np.zeros_like(gradient)
        complete[..., known] = gradient[..., known]
        return CompletedField(gradient=complete)
    seen = gradient[..., known]
    support = (
        may_have_moved(disturbed, seen) if unseen == "x" else may_have_moved(disturbed.T, seen.T).T
    )
    found = infer_missing_axis(seen, unseen, mm_per_px, support=support)
    joined = weigh_columns(found.gradient, seen, unseen, support, mm_per_px)
    joined[..., known] += SEEN_SHARE * (seen * support - joined[..., known])
    if hinted:
        hint = gradient[..., 1 - known] * support
        joined[..., 1 - known] += HINT_SHARE * (hint - joined[..., 1 - known])
    return CompletedField(gradient=joined, doubt=found.doubt, support=support)
