# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Where the gel may have moved, as far as lights on one line tell.

Skin that tilts across the lights hardly changes its colour. So a contact appears to such lights as
two halves, one on the near side and one on the far side, often with a gap or a notch between them;
what lies between the two has moved as well. For the same reason its flanks to the left and right
of the lights reach farther than their colour tells.
"""

import cv2
import numpy as np
from jaxtyping import Bool, Float

from recon.contact.disturbed import CROSS
from recon.lights import Axis
from recon.windows import window_about

Mask = Bool[np.ndarray, "h w"]

MARGIN_PX = 3
"""The disturbed gel's outline is smoothed: gel may have moved this far around it."""
FLANK = 1 / 30
"""Of the frame's shorter side: gel may have moved this far across the lights beside what shows."""
STILL_DOWN = 0.35
"""Of a column's deepest: gel this deep by the slopes above it and by those below it is dented."""


def near_disturbed(disturbed: Mask) -> Mask:
    """Disturbed gel with its margin."""
    return cv2.dilate(disturbed.astype(np.uint8), CROSS, iterations=MARGIN_PX).astype(bool)


def widest_support(disturbed: Mask, unseen: Axis) -> Mask:
    """All that ``may_have_moved`` could name, whatever the slopes along the lights are.

    Of a frame that is mirrored (``recon.missing_axis.mirrored``) it may name more.

    Args:
        disturbed: where the colour changed.
        unseen: the axis across the lights.
    """
    if unseen == "y":
        return widest_support(disturbed.T, "x").T
    near = near_disturbed(disturbed)
    if near.any():
        window = window_about(near, 0)
        near[window] = _filled_along(near[window])
    return _with_flanks(near)


def may_have_moved(disturbed: Mask, known: Float[np.ndarray, "h w"]) -> Mask:
    """Disturbed gel with a margin, its flanks, and what lies between its parts along the lights.

    Between means: where the slopes above lead down and those below lead up again, whatever patch
    they belong to; and in a column between two pixels of one patch.

    Args:
        disturbed: where the colour changed.
        known: ∂depth/∂y, the lights being along y.
    """
    moved = near_disturbed(disturbed)
    if moved.any():
        lines = window_about(moved, 0)[1]
        moved[:, lines] = _joined_along(moved[:, lines], known[:, lines])
    return _with_flanks(moved)


def _joined_along(near: Mask, known: Float[np.ndarray, "h w"]) -> Mask:
    """``may_have_moved`` but for the flanks, of disturbed gel with its margin."""
    bounded = np.where(near, known, 0)
    from_above = np.cumsum(bounded, axis=0)
    from_below = from_above - from_above[-1:]  # both are depths, if nothing lies in between
    down = np.minimum(from_above, from_below)
    deepest = np.maximum(from_above, from_below).max(axis=0, initial=0)
    moved = near | (down > STILL_DOWN * deepest)
    count, patches, boxes, _ = cv2.connectedComponentsWithStats(moved.astype(np.uint8))
    for patch in range(1, count):
        left, top, width, height = boxes[patch, :4]
        box = np.s_[top : top + height, left : left + width]
        moved[box] |= _filled_along(patches[box] == patch)
    return moved


def _filled_along(mask: Mask) -> Mask:
    """What lies in a column between two pixels of the mask, and they."""
    return np.maximum.accumulate(mask) & np.maximum.accumulate(mask[::-1])[::-1]


def _with_flanks(moved: Mask) -> Mask:
    flanks = np.ones((1, 2 * round(FLANK * min(moved.shape, default=0)) + 1), np.uint8)
    return np.asarray(cv2.dilate(moved.astype(np.uint8), flanks), bool)
