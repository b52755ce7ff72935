# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Dots of a marker gel in frames of one size: what they hide is filled from around them."""

import numpy as np
from jaxtyping import Float32

from recon.arrays import ContactMask, Unwarped
from recon.markers.filling import fill_planes
from recon.markers.tracking import MarkerTracker
from sensor.toml import Pair

Planes = Float32[np.ndarray, "c h w"]


class FrameDots:
    """Follows the dots of one gel, and fills in place what they hide."""

    def __init__(self, tracker: MarkerTracker, blank: Unwarped) -> None:
        """Prepare for frames of the gel.

        Args:
            tracker: of the dots on the blank frame.
            blank: the unwarped blank frame.
        """
        self._tracker, self._blank = tracker, blank

    def hidden(self, difference: Planes) -> ContactMask:
        """What the dots hide of a frame, whose difference to the blank frame is filled there."""
        image = np.moveaxis(difference, 0, -1) + self._blank
        hidden = self._tracker.hidden(self._tracker.track(image))
        fill_planes(difference, hidden, "harmonic")
        return hidden

    def fill_slopes(self, gradient: Planes, hidden: ContactMask, mm_per_px: Pair) -> None:
        """Fill gradients as the two slopes of one surface."""
        fill_planes(gradient, hidden, "surface", mm_per_px)
