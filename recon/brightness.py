# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Whether the blank gel is as bright as it was: slopes are read from brightness at each place."""

import cv2
import numpy as np

from recon.arrays import Unwarped
from recon.markers.filling import fill_gradients
from recon.markers.tracking import MarkerTracker, marker_tracker

BROAD = 1 / 20
"""Of the frame's shorter side: standard deviation of a Gaussian that leaves what a light does."""
DIM = 0.25
"""Of a colour's mean: what is darker is held against this."""
MARGIN = 0.04
"""Of the frame: its edge is no gel on every sensor."""


def brightness_change(before: Unwarped, now: Unwarped, channels: str) -> dict[str, float]:
    """By what share each light over the blank gel is another, its dots left out.

    As all but a twentieth of the pad is at most: a light that is dimmer on one side and brighter
    on the other has the mean it had, and slopes are read from its brightness at each place. Clips
    of a Wedge that were taken on one day (three times two) begin with gels up to 0.07 apart.

    Args:
        before: blank, unwarped: of the calibration.
        now: the same of today.
        channels: the colours with a light.
    """
    sigma_px = BROAD * min(now.shape[:2])
    was, is_now = (
        cv2.GaussianBlur(without_dots(gel, marker_tracker(gel)), (0, 0), sigma_px)[inner(gel.shape)]
        for gel in (before, now)
    )
    least = DIM * was.mean((0, 1)) + 1e-6
    change = np.quantile(np.abs(is_now - was) / np.maximum(was, least), 0.95, axis=(0, 1))
    return {channel: float(change["RGB".index(channel)]) for channel in channels}


def without_dots(blank: Unwarped, dots: MarkerTracker | None) -> Unwarped:
    """A blank frame with its dots filled in from around them."""
    if dots is None:
        return blank
    return fill_gradients(blank, dots.hidden(dots.track(blank)), "harmonic")


def inner(shape: tuple[int, ...]) -> tuple[slice, slice]:
    """The frame without its margin."""
    rows, columns = (max(1, round(MARGIN * count)) for count in shape[:2])
    return slice(rows, -rows), slice(columns, -columns)
