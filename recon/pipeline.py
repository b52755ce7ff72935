# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""A frame through a calibrated unit: difference, gradients, depth, contact."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

import numpy as np
from jaxtyping import Float32

from recon.arrays import ContactMask, DepthMap, Difference, Frame, GradientField
from recon.calibration import Calibration, load_calibration
from recon.contact.mask import contact_mask, disturbed_mask
from recon.contact.patches import ContactPatch, contact_patches
from recon.contact.shadows import cast_shadows
from recon.depth import depth_of
from recon.depth_error import slope_error
from recon.estimators import GradientEstimator, gradient_field
from recon.integration.poisson import Boundary
from recon.markers.detection import unexpected_dots
from recon.markers.filling import fill_gradients
from recon.markers.tracking import Tracked, marker_tracker, misfit
from sensor.toml import Pair
from sensor.unit import MissingAxis


@dataclass(frozen=True, kw_only=True)
class Reconstruction:
    """What one frame says."""

    difference: Difference
    """(h, w, 3) float32: unwarped frame minus unwarped background, in shares of full scale."""
    gradient: GradientField
    """(h, w, 2): slopes of the depth along x and y, mm/mm."""
    depth_mm: DepthMap
    """(h, w) float32, mm, positive where pushed in; noise may leave some below zero."""
    disturbed: ContactMask
    """(h, w): where the colour changed."""
    boundary: Boundary
    """``"dirichlet"``: the border was held at zero; ``"neumann"``: left free as gel moved there."""
    mm_per_px: Pair
    """Pixel pitch along x and y."""
    lights_deg: Mapping[str, float] | None = None
    """Where the lights sit; ``None`` where nobody said."""
    doubt: Float32[np.ndarray, "h w"] | None = None
    """How far off an inferred slope is expected to be, mm/mm; ``None`` where both were measured."""
    estimator: GradientEstimator | None = None
    """That read the slopes; ``None`` where nobody said."""
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
    def slope_error(self) -> GradientField | None:
        """Standard deviation expected of each slope's error; ``None`` where it is not known."""
        return slope_error(self.estimator, self.gradient, self.lights_deg, self.doubt)

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
        self._misfit = misfit(calibration.card.markers, self._tracker)

    @classmethod
    def load(cls, folder: str | Path, background: Frame | None = None) -> "Reconstructor":
        """Read a unit folder and prepare its maps.

        Raises:
            WedgeError: the folder is not a unit folder or is damaged.
        """
        return cls(load_calibration(folder), background)

    def __call__(self, frame: Frame) -> Reconstruction:
        """Reconstruct one frame (h, w, 3) uint8 RGB.

        Raises:
            WedgeError: the frame has another size than the unit's frames.
        """
        card = self.calibration.card
        image = self.unwarp(frame)
        difference, dots, hidden, word = image - self._blank, None, None, self._misfit
        if self._tracker is not None:
            dots = self._tracker.track(image)
            hidden = self._tracker.hidden(dots)
            difference = fill_gradients(difference, hidden, "harmonic")
        elif not word:
            word = unexpected_dots(image, self._blank)
        found = reconstruct(
            difference,
            self.calibration.estimator,
            missing=card.missing_axis,
            lights_deg=card.lights_deg,
            mm_per_px=card.mm_per_px,
            hidden=hidden,
        )
        word = word or ("none" if dots is None else dots.word)
        return replace(found, dots=dots, markers=word)


def reconstruct(
    difference: Difference,
    estimator: GradientEstimator,
    *,
    missing: MissingAxis,
    lights_deg: Mapping[str, float] | None,
    mm_per_px: Pair,
    hidden: ContactMask | None = None,
    repeatable: bool = False,
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
        repeatable: as in ``recon.markers.filling.fill_gradients``.
    """
    lit = np.array([channel in estimator.channels for channel in "RGB"], np.float32)
    disturbed = disturbed_mask(difference * lit)
    found = depth_of(
        gradient_field(estimator, difference),
        disturbed,
        estimator,
        missing=missing,
        lights_deg=lights_deg,
        mm_per_px=mm_per_px,
        hidden=hidden,
        repeatable=repeatable,
    )
    return Reconstruction(
        difference=difference,
        gradient=found.gradient,
        depth_mm=found.depth_mm,
        disturbed=disturbed,
        boundary=found.boundary,
        mm_per_px=mm_per_px,
        lights_deg=lights_deg,
        doubt=found.doubt,
        estimator=estimator,
    )
