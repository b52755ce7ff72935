# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Whether a reconstruction can be what a sensor felt.

An estimator answers any colours with slopes, those of a mirrored picture too, of one whose red and
blue were swapped, and of another camera's. But slopes of a skin are those of one surface, and a
skin is pressed in by less than its gel is thick.
"""

import numpy as np

from recon.lights import unseen_axis
from recon.pipeline import Reconstruction

MOST_OFF = 0.15
"""Of the squared slopes, what no surface has. Right frames have 0.14 at most (the twins' eight
shapes and tools, half of the presses of five sets; table, mlp and default), mirrored ones and such
with red and blue swapped 0.09 to 0.51 on three real sensors."""
DEEPEST = 1 / 3
"""Of the frame's shorter side: it is 13 mm or more of sensors whose gel is 2 to 5 mm thick."""


def share_of_no_surface(touch: Reconstruction) -> float:
    """Of the slopes' squares, what the slopes of the depth lack; 0 on flat gel.

    Central differences of the depth, where the gel is dented.
    """
    x_mm, y_mm = touch.mm_per_px
    along_y, along_x = np.gradient(touch.depth_mm, y_mm, x_mm)
    off = np.stack([along_x, along_y], -1) - touch.gradient
    dented = touch.gradient.any(-1)
    whole = float(np.square(touch.gradient[dented]).sum())
    return float(np.square(off[dented]).sum()) / whole if whole else 0.0


def is_implausible(touch: Reconstruction) -> bool:
    """Whether depth is deeper than a gel, or its slopes are not those of one surface.

    Slopes of which one is not seen are not judged: a zero in its place is of no surface.
    """
    height, width = touch.depth_mm.shape
    shorter_mm = min(width * touch.mm_per_px[0], height * touch.mm_per_px[1])
    if float(touch.depth_mm.max()) > DEEPEST * shorter_mm:
        return True
    channels = "RGB" if touch.estimator is None else touch.estimator.channels
    seen = unseen_axis(touch.lights_deg, channels) is None
    return seen and share_of_no_surface(touch) > MOST_OFF
