# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""A frame through a calibrated unit: difference, gradients, depth, contact."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from recon.arrays import ContactMask, DepthMap, Difference, Frame, GradientField
from recon.calibration import Calibration, load_calibration
from recon.contact import boundary_of, contact_mask
from recon.estimators import gradient_field
from recon.lights import unseen_axis
from recon.missing_axis import infer_missing_axis
from recon.poisson import Boundary, integrate
from sensor.toml import Pair
from sensor.unit import MissingAxis


@dataclass(frozen=True, kw_only=True)
class Reconstruction:
    """What one frame says."""

    difference: Difference
    gradient: GradientField
    depth_mm: DepthMap
    contact: ContactMask
    boundary: Boundary
    mm_per_px: Pair


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
        difference = self.unwarp(frame) - self._blank
        gradient = complete_gradient(
            gradient_field(self.calibration.estimator, difference),
            card.missing_axis,
            unseen_axis(card.lights_deg, card.channels),
            card.mm_per_px,
        )
        contact = contact_mask(difference)
        boundary = boundary_of(contact)
        return Reconstruction(
            difference=difference,
            gradient=gradient,
            depth_mm=depth_map(gradient, contact, boundary, card.mm_per_px),
            contact=contact,
            boundary=boundary,
            mm_per_px=card.mm_per_px,
        )


def complete_gradient(
    gradient: GradientField, missing: MissingAxis, unseen: str | None, mm_per_px: Pair
) -> GradientField:
    """The gradient field with its unseen axis replaced by zero or by the network's inference."""
    if missing == "none" or unseen is None:
        return gradient
    complete = gradient.copy()
    lost, known = (0, 1) if unseen == "x" else (1, 0)
    complete[..., lost] = (
        0
        if missing == "zero"
        else infer_missing_axis(gradient[..., known], "x" if lost == 0 else "y", mm_per_px)
    )
    return complete


def depth_map(
    gradient: GradientField, contact: ContactMask, boundary: Boundary, mm_per_px: Pair
) -> DepthMap:
    """Depth in mm; with a free border, the untouched gel is put at zero."""
    depth = integrate(gradient, mm_per_px, boundary)
    if boundary == "neumann" and not contact.all():
        depth -= np.median(depth[~contact])
    return depth
