# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Dots of a marker gel in frames of one size: what they hide is filled from around them."""

import numpy as np
from jaxtyping import Float32

from recon.arrays import ContactMask, Unwarped
from recon.markers.filling import fill_planes
from recon.markers.tracking import MarkerTracker, Tracked
from sensor.toml import Pair

Planes = Float32[np.ndarray, "c h w"]


class FrameDots:
    """Finds the dots of one gel, each frame from rest, and fills in place what they hide."""

    def __init__(self, tracker: MarkerTracker, blank: Unwarped) -> None:
        """Prepare for frames of the gel.

        Args:
            tracker: of the dots on the blank frame.
            blank: the unwarped blank frame.
        """
        self._tracker, self._blank = tracker, blank

    def followed(self, difference: Planes) -> tuple[Tracked, ContactMask]:
        """The dots of a frame and what they hide, where its difference to the blank is filled."""
        dots = self._tracker.track(np.moveaxis(difference, 0, -1) + self._blank)
        hidden = self._tracker.hidden(dots)
        fill_planes(difference, hidden, "harmonic")
        return dots, hidden

    def fill_slopes(self, gradient: Planes, hidden: ContactMask, mm_per_px: Pair) -> None:
        """Fill gradients as the two slopes of one surface."""
        fill_planes(gradient, hidden, "surface", mm_per_px)
