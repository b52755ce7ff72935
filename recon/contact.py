# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Where something touches, from the difference image, and whether it reaches the border."""

import cv2
import numpy as np
from scipy import ndimage

from recon.arrays import ContactMask, Difference
from recon.poisson import Boundary

SMOOTHING_PX = 2.0
NOISE_FACTOR = 8.0
"""A contact must change the colour by this many standard deviations of the blank gel..."""
LEAST_CHANGE = 0.03
"""...and by this share of full scale: seven grey levels of 255."""
LEAST_AREA = 2e-4
"""Smaller patches, as a share of the frame, are dust."""
BORDER_PX = 3


def contact_mask(difference: Difference) -> ContactMask:
    """Pixels whose colour changed by more than the gel's noise, holes filled, specks removed.

    The noise is estimated from the frame itself: the median absolute deviation is not moved by
    a contact that covers less than half of the pad.
    """
    smooth = cv2.GaussianBlur(difference, (0, 0), SMOOTHING_PX)
    change = np.abs(smooth).max(-1)
    noise = 1.4826 * float(np.median(np.abs(smooth - np.median(smooth, axis=(0, 1)))))
    mask = change > max(LEAST_CHANGE, NOISE_FACTOR * noise)
    filled = ndimage.binary_fill_holes(ndimage.binary_opening(mask, iterations=2))
    patches, count = ndimage.label(filled)
    areas = np.bincount(patches.ravel(), minlength=count + 1)
    large = areas >= LEAST_AREA * mask.size
    large[0] = False
    contact: ContactMask = large[patches]
    return contact


def boundary_of(contact: ContactMask) -> Boundary:
    """The border that suits a contact: free where it reaches the frame's edge, else zero.

    A zero border resists a constant bias of the slopes but flattens what touches the edge; a
    free border is the reverse.
    """
    inner = contact[BORDER_PX:-BORDER_PX, BORDER_PX:-BORDER_PX]
    return "neumann" if contact.sum() > inner.sum() else "dirichlet"
