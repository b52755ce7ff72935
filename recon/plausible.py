# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Whether a reconstruction can be what a sensor felt.

An estimator answers any colours with slopes, those of a mirrored picture too, and of one whose red
and blue were swapped. But slopes of a skin are those of one surface, and a skin is neither pressed
in farther than its gel is thick nor bulges out far. ``python -m validation.plausible`` counts which
frames the limits call implausible.
"""

import math

import cv2
import numpy as np
from jaxtyping import Float32

from recon.arrays import ContactMask, GradientField
from recon.calibration import Calibration
from recon.cloud import Skin
from recon.contact.disturbed import is_strange
from recon.integration.weighed import shorter_side_mm
from recon.lights import Axis, unseen_axis
from recon.missing_axis.mirrored import is_cut_twice
from recon.quarters import in_pixels

Plane = Float32[np.ndarray, "part_h part_w"]
Window = tuple[slice, slice]
NOISE_PX = 1.0
"""Standard deviation of the Gaussian that takes single pixels' errors off the slopes."""
REACH_PX = 5
"""What lies farther changes none of them: four of OpenCV's Gaussian, one of a difference."""
MOST_OFF = 0.12
"""Of the squared slopes, what no surface has. Right frames of five sets have 0.101 at most..."""
LEAST_OFF = 0.087
"""...where its root mean square is at least this, in mm/mm: the noise of gel that something hardly
touches is of no surface either, but is 0.083 at most; altered frames have 0.092 and more."""
DEEPEST = 1 / 4
"""Of the frame's shorter side; right frames of five sets reach 0.150."""
HIGHEST = 1 / 10
"""The same, out of the gel: 0.066."""
STRANGE = "nearly all of the frame differs from the blank gel"
"""What ``doubt_word`` says of a frame of something else than this gel."""
IMPLAUSIBLE = "no gel is so deep, or its slopes are not those of one surface"
"""What it says of a mirrored picture, or of one whose red and blue were swapped."""
CUT_TWICE = "a contact runs over both edges that the lights shine along"
"""What ``cut_word`` says."""


def doubt_word(touch: Skin, unit: Calibration) -> str:
    """Why a frame's depth means little: ``STRANGE`` or ``IMPLAUSIBLE``; empty where it is a touch.

    Args:
        touch: what was reconstructed of it.
        unit: with which.
    """
    if is_strange(touch.disturbed):
        return STRANGE
    unseen = unseen_axis(unit.card.lights_deg, unit.estimator.channels)
    return IMPLAUSIBLE if is_implausible(touch, unseen) else ""


def cut_word(touch: Skin, unit: Calibration) -> str:
    """Why a plausible depth is too small: ``CUT_TWICE``; empty where it is not.

    Of lights on one line only slopes along it are seen, which say how much deeper one place is than
    another; how deep, they say where the contact ends.

    Args:
        touch: what was reconstructed, ``disturbed`` in pixels.
        unit: with which.
    """
    unseen = unseen_axis(unit.card.lights_deg, unit.estimator.channels)
    if unseen is None or unit.card.missing_axis != "network":
        return ""
    return CUT_TWICE if is_cut_twice(touch.disturbed, touch.gradient, unseen) else ""


def is_implausible(touch: Skin, unseen: Axis | None) -> bool:
    """Whether depth is none that a gel can have, or its slopes are not those of one surface.

    Args:
        touch: what was reconstructed.
        unseen: the slope that no light shows. Where there is one, slopes are not judged: with a
            zero in its place those of a touch are of no surface, and with an inferred one those of
            many a mirrored picture are of one.
    """
    side_mm = shorter_side_mm(touch.depth_mm.shape, touch.mm_per_px)
    if touch.depth_mm.max() > DEEPEST * side_mm or -touch.depth_mm.min() > HIGHEST * side_mm:
        return True
    return unseen is None and _off(touch) > LEAST_OFF and _share_off(touch) > MOST_OFF


def slopes_of_no_surface(touch: Skin) -> tuple[float, float]:
    """What the slopes of the depth lack: its root mean square, and its share of all squares.

    Central differences of the depth, where the gel is dented; the mean is taken where it is
    disturbed besides, and is 0 where it is so nowhere. Both are 0 on flat gel, and of one row or
    column of pixels, whose slopes are always of some surface.
    """
    return _off(touch), _share_off(touch)


def _off(touch: Skin) -> float:
    """The first of ``slopes_of_no_surface``: few pixels, so that it is known quickly."""
    touched = _dented(touch.gradient) & _disturbed(touch)
    off2, _, window = _squares(touch, touched)
    return math.sqrt(_mean(off2, touched[window]))


def _share_off(touch: Skin) -> float:
    """The second."""
    dented = _dented(touch.gradient)
    off2, slopes2, window = _squares(touch, dented)
    whole = _mean(slopes2, dented[window])
    return _mean(off2, dented[window]) / whole if whole else 0.0


def _squares(touch: Skin, of: ContactMask) -> tuple[Plane, Plane, Window]:
    """What the slopes lack, and the slopes: squared and smoothed, around the gel that is asked for.

    Single planes, of which OpenCV and NumPy are many times as quick.
    """
    window = _around(of)
    depth_mm, gradient = touch.depth_mm[window].astype(np.float32), touch.gradient[window]
    if min(depth_mm.shape) < 2:
        return np.zeros_like(depth_mm), np.zeros_like(depth_mm), window
    along_y, along_x = np.gradient(depth_mm, *touch.mm_per_px[::-1])
    dented = _dented(gradient)
    off2, slopes2 = np.zeros_like(depth_mm), np.zeros_like(depth_mm)
    for along, axis in ((along_x, 0), (along_y, 1)):
        slope = gradient[..., axis].astype(np.float32)
        lack = np.where(dented, along - slope, np.float32(0))
        off2 += np.square(cv2.GaussianBlur(lack, (0, 0), NOISE_PX))
        slopes2 += np.square(cv2.GaussianBlur(slope, (0, 0), NOISE_PX))
    return off2, slopes2, window


def _dented(gradient: GradientField) -> ContactMask:
    return (gradient[..., 0] != 0) | (gradient[..., 1] != 0)


def _mean(squares: Plane, where: ContactMask) -> float:
    """0 where there is nothing."""
    return cv2.mean(squares, where.view(np.uint8))[0] if where.size else 0.0


def _around(of: ContactMask) -> Window:
    """All that is set, and beside it what is smoothed into it."""
    if not of.any():
        return slice(0), slice(0)
    left, top, width, height = cv2.boundingRect(of.view(np.uint8))
    return (
        slice(max(0, top - REACH_PX), top + height + REACH_PX),
        slice(max(0, left - REACH_PX), left + width + REACH_PX),
    )


def _disturbed(touch: Skin) -> ContactMask:
    """In pixels."""
    height, width = touch.depth_mm.shape
    if touch.disturbed.shape == (height, width):
        return touch.disturbed
    return in_pixels(touch.disturbed, (width, height))
