# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Whether a reconstruction can be what a sensor felt.

An estimator answers any colours with slopes, those of a mirrored picture too, and of one whose red
and blue were swapped. But slopes of a skin are those of one surface, and a skin is neither pressed
in farther than its gel is thick nor bulges out far. ``python -m validation.plausible`` counts which
frames the limits call implausible.
"""

import cv2
import numpy as np

from recon.arrays import ContactMask
from recon.calibration import Calibration
from recon.cloud import Skin
from recon.contact.mask import is_strange
from recon.fast.disturbance import in_pixels
from recon.lights import Axis, unseen_axis
from recon.pipeline import Reconstruction

NOISE_PX = 1.0
"""Standard deviation of the Gaussian that takes single pixels' errors off the slopes."""
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
IMPLAUSIBLE = "no gel is so deep, or its slopes are not those of one surface"


def doubt_word(touch: Skin, unit: Calibration) -> str:
    """Why a frame's depth means little: ``STRANGE`` or ``IMPLAUSIBLE``; empty where it is a touch.

    Args:
        touch: what was reconstructed of it.
        unit: with which.
    """
    if is_strange(touch.disturbed):
        return STRANGE
    unseen = unseen_axis(unit.card.lights_deg, unit.estimator.channels)
    return IMPLAUSIBLE if _is_of_no_gel(touch, unseen) else ""


def slopes_of_no_surface(touch: Skin) -> tuple[float, float]:
    """What the slopes of the depth lack: its root mean square, and its share of all squares.

    Central differences of the depth, where the gel is dented; the mean is taken where it is
    disturbed besides, and is 0 where it is so nowhere. Both are 0 on flat gel, and of one row or
    column of pixels, whose slopes are always of some surface.
    """
    if min(touch.depth_mm.shape) < 2:
        return 0.0, 0.0
    x_mm, y_mm = touch.mm_per_px
    along_y, along_x = np.gradient(touch.depth_mm, y_mm, x_mm)
    dented = np.asarray(touch.gradient.any(-1))
    off = np.where(dented[..., None], np.stack([along_x, along_y], -1) - touch.gradient, 0)
    off2, slopes2 = (
        np.square(cv2.GaussianBlur(field.astype(np.float32), (0, 0), NOISE_PX)).sum(-1)
        for field in (off, touch.gradient)
    )
    touched, whole = dented & _disturbed(touch), float(slopes2[dented].sum())
    return (
        float(np.sqrt(off2[touched].mean())) if touched.any() else 0.0,
        float(off2[dented].sum()) / whole if whole else 0.0,
    )


def shorter_side_mm(touch: Skin) -> float:
    """Of the frame."""
    height, width = touch.depth_mm.shape
    return min(width * touch.mm_per_px[0], height * touch.mm_per_px[1])


def is_implausible(touch: Reconstruction) -> bool:
    """Whether depth is none that a gel can have, or its slopes are not those of one surface.

    Slopes of which one is not seen are not judged: a zero in its place is of no surface.
    """
    channels = "RGB" if touch.estimator is None else touch.estimator.channels
    return _is_of_no_gel(touch, unseen_axis(touch.lights_deg, channels))


def _is_of_no_gel(touch: Skin, unseen: Axis | None) -> bool:
    side_mm = shorter_side_mm(touch)
    if touch.depth_mm.max() > DEEPEST * side_mm or -touch.depth_mm.min() > HIGHEST * side_mm:
        return True
    if unseen is not None:
        return False
    off, share = slopes_of_no_surface(touch)
    return off > LEAST_OFF and share > MOST_OFF


def _disturbed(touch: Skin) -> ContactMask:
    """In pixels."""
    height, width = touch.depth_mm.shape
    if touch.disturbed.shape == (height, width):
        return touch.disturbed
    return in_pixels(touch.disturbed, (width, height))
