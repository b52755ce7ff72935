# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""A frame through a calibrated unit: difference, gradients, depth, contact."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from recon.arrays import ContactMask, Difference, Frame
from recon.calibration import Calibration, load_calibration
from recon.contact.disturbed import disturbed_mask
from recon.depth import depth_of
from recon.estimators import GradientEstimator, gradient_field
from recon.markers.filling import fill_gradients
from recon.markers.tracking import Tracked
from recon.markers.watch import DotWatch
from recon.same_light import in_same_light, light_of
from recon.touched import Touched
from sensor.toml import Pair
from sensor.unit import MissingAxis


@dataclass(frozen=True, kw_only=True)
class Reconstruction(Touched):
    """What one frame says."""

    markers: str = "none"
    """A word on the dots: "none", "tracked", "jumped", "lost", or what does not fit the unit."""


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
            WedgeError: the background has another size than the unit's frames, or is grey.
        """
        self.calibration = calibration
        self.unwarp = calibration.unwarp
        if background is not None:
            self.unwarp.check_colored(background)
        own = self.unwarp(calibration.background)
        blank = own if background is None else self.unwarp(background)
        self._light = light_of(blank - own, own)
        self._blank = blank / self._light
        self._watch = DotWatch(self._blank, calibration.card.markers)

    @classmethod
    def load(cls, folder: str | Path, background: Frame | None = None) -> "Reconstructor":
        """Read a unit folder and prepare its maps.

        Raises:
            WedgeError: the folder is not a unit folder or is damaged.
        """
        return cls(load_calibration(folder), background)

    def __call__(self, frame: Frame, before: Tracked | None = None) -> Reconstruction:
        """Reconstruct one frame (h, w, 3) uint8 RGB.

        Args:
            frame: as the camera gave it.
            before: the ``dots`` of the frame before, of a marker gel that is followed; by default
                they are sought from rest, which suits single pictures.

        Raises:
            WedgeError: the frame has another size than the unit's frames, or is grey.
        """
        card = self.calibration.card
        self.unwarp.check_colored(frame)
        image = self.unwarp(frame) / self._light
        difference = in_same_light(image - self._blank, self._blank)
        image = difference + self._blank
        dots, hidden = None, None
        tracker = self._watch.tracker
        if tracker is not None:
            dots = tracker.track(image, before)
            hidden = tracker.hidden(dots)
            difference = fill_gradients(difference, hidden, "harmonic")
        found = reconstruct(
            difference,
            self.calibration.estimator,
            missing=card.missing_axis,
            lights_deg=card.lights_deg,
            mm_per_px=card.mm_per_px,
            hidden=hidden,
        )
        word = self._watch.word(dots) or self._watch.unexpected(image)
        return replace(found, dots=dots, markers=word)


def reconstruct(
    difference: Difference,
    estimator: GradientEstimator,
    *,
    missing: MissingAxis,
    lights_deg: Mapping[str, float] | None,
    mm_per_px: Pair,
    hidden: ContactMask | None = None,
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
    """
    disturbed = disturbed_in(difference, estimator)
    found = depth_of(
        gradient_field(estimator, difference),
        disturbed,
        estimator,
        missing=missing,
        lights_deg=lights_deg,
        mm_per_px=mm_per_px,
        hidden=hidden,
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


def disturbed_in(difference: Difference, estimator: GradientEstimator) -> ContactMask:
    """Where the colours changed that an estimator looks at."""
    lit = np.array([channel in estimator.channels for channel in "RGB"], np.float32)
    return disturbed_mask(difference * lit)
