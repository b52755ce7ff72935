# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Whether a reconstruction can be what a sensor felt.

An estimator answers any colours with slopes, those of a mirrored picture too, and of one whose red
and blue were swapped. But slopes of a skin are those of one surface, and a skin is neither pressed
in farther than its gel is thick nor bulges out far. ``python -m validation.plausible`` counts which
frames the limits call implausible.
"""

import math
from typing import Protocol

import cv2
import numpy as np
from jaxtyping import Float32

from recon.arrays import ContactMask, GradientField
from recon.calibration import Calibration
from recon.cloud import Skin
from recon.contact.disturbed import STRANGE, is_strange
from recon.integration.weighed import shorter_side_mm
from recon.lights import Axis, unseen_axis
from recon.missing_axis.mirrored import is_cut_twice
from recon.windows import window_about

Plane = Float32[np.ndarray, "part_h part_w"]
Window = tuple[slice, slice]
NOISE_PX = 1.0
"""Standard deviation of the Gaussian that takes single pixels' errors off the slopes."""
REACH_PX = 5
"""What lies farther changes none of them: four of OpenCV's Gaussian, one of a difference."""
AROUND = 1 / 20
"""Of the frame's shorter side: standard deviation of the Gaussian over which squares are averaged.
A mirrored picture beside a blank one that is not has gentle slopes all over, of a surface or nearly
so, and in the midst of them a contact whose slopes are of none."""
CELLS = 60
"""Along the shorter side, by which they are: enough for that Gaussian."""
MOST_OFF = 0.12
"""Of the squared slopes, what no surface has..."""
LEAST_OFF = 0.13
"""...where its root mean square is at least this, in mm/mm: the noise of gel that something hardly
touches is of no surface either."""
DEEPEST = 1 / 4
"""Of the frame's shorter side; right frames of five sets reach 0.150."""
HIGHEST = 1 / 10
"""The same, out of the gel: 0.066."""
IMPLAUSIBLE = "no gel is so deep, or its slopes are not those of one surface"
"""What it says of a mirrored picture, or of one whose red and blue were swapped."""
CUT_TWICE = "a contact runs over both edges that the lights shine along"
"""What ``cut_word`` says."""


class Dated(Skin, Protocol):
    """A touch that knows whether its arrays are still its own frame's."""

    def refuse_if_overwritten(self) -> None:
        """Refuse to tell anything of arrays that are another frame's by now, with a WedgeError."""


def doubt_word(touch: Dated, unit: Calibration) -> str:
    """Why a frame's depth means little: ``STRANGE`` or ``IMPLAUSIBLE``; empty where it is a touch.

    Args:
        touch: what was reconstructed of it.
        unit: with which.

    Raises:
        WedgeError: the next frame has overwritten the touch.
    """
    touch.refuse_if_overwritten()
    if is_strange(touch.disturbed):
        return STRANGE
    unseen = unseen_axis(unit.card.lights_deg, unit.estimator.channels)
    return IMPLAUSIBLE if is_implausible(touch, unseen) else ""


def cut_word(touch: Dated, unit: Calibration) -> str:
    """Why a plausible depth is too small: ``CUT_TWICE``; empty where it is not.

    Of lights on one line only slopes along it are seen, which say how much deeper one place is than
    another; how deep, they say where the contact ends.

    Args:
        touch: what was reconstructed, ``disturbed`` in pixels.
        unit: with which.

    Raises:
        WedgeError: the next frame has overwritten the touch.
    """
    touch.refuse_if_overwritten()
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
    off, share = (0.0, 0.0) if unseen else slopes_of_no_surface(touch)
    return off > LEAST_OFF and share > MOST_OFF


def slopes_of_no_surface(touch: Skin) -> tuple[float, float]:
    """What the slopes of the depth lack: its root mean square, and its share of all squares.

    Both are of the place where most is lacking, of those where the colour changed: means over what
    lies around it (``AROUND``). Central differences of the depth are held against the slopes where
    the gel is dented. Both are 0 on flat gel, and of one row or column of pixels, whose slopes are
    always of some surface.
    """
    dented = _dented(touch.gradient)
    if not dented.any():
        return 0.0, 0.0
    window = window_about(dented, REACH_PX)
    if min(dented[window].shape) < 2:
        return 0.0, 0.0
    shape = dented.shape
    cells = tuple(min(n, max(1, round(CELLS * n / min(shape)))) for n in reversed(shape))
    squares = _squares(touch, dented, window)
    off2, slopes2 = (_averaged(plane, window, shape, cells) for plane in squares)
    changed = cv2.resize(touch.disturbed.astype(np.float32), cells, interpolation=cv2.INTER_AREA)
    off2 *= changed > 0
    where = off2.argmax()
    most, all_there = float(off2.flat[where]), float(slopes2.flat[where])
    return math.sqrt(most), most / all_there if all_there else 0.0


def _squares(touch: Skin, dented: ContactMask, window: Window) -> tuple[Plane, Plane]:
    """What the slopes lack, and the slopes: squared, and smoothed, in a window.

    Single planes, of which OpenCV and NumPy are many times as quick.
    """
    depth_mm, gradient = touch.depth_mm[window].astype(np.float32), touch.gradient[window]
    along_y, along_x = np.gradient(depth_mm, *touch.mm_per_px[::-1])
    off2, slopes2 = np.zeros_like(depth_mm), np.zeros_like(depth_mm)
    for along, axis in ((along_x, 0), (along_y, 1)):
        slope = gradient[..., axis].astype(np.float32)
        lack = np.where(dented[window], along - slope, np.float32(0))
        off2 += np.square(cv2.GaussianBlur(lack, (0, 0), NOISE_PX))
        slopes2 += np.square(cv2.GaussianBlur(slope, (0, 0), NOISE_PX))
    return off2, slopes2


def _averaged(
    plane: Plane, window: Window, shape: tuple[int, ...], cells: tuple[int, ...]
) -> Float32[np.ndarray, "rows columns"]:
    """The mean around each of so many (columns, rows) of a frame that is zero beside a window."""
    whole = np.zeros(shape, np.float32)
    whole[window] = plane
    coarse = cv2.resize(whole, cells, interpolation=cv2.INTER_AREA)
    return np.asarray(cv2.GaussianBlur(coarse, (0, 0), AROUND * min(cells)), np.float32)


def _dented(gradient: GradientField) -> ContactMask:
    return (gradient[..., 0] != 0) | (gradient[..., 1] != 0)
