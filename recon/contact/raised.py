# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Whether gel stands out, as it does against a blank frame on which something touched."""

from collections.abc import Mapping

import numpy as np

from recon.arrays import ContactMask, Difference
from recon.lights import channel_indices

LEAST_LIKE = 0.3
"""Correlation of colours with those of a bump. 204 ball presses of six sets, real and rendered, are
told by it from their blank frames held against them. In the circles of a third of them colours
correlate by -0.66 at most, also of one or two lights; where colours changed, by -0.17."""


def is_raised(difference: Difference, where: ContactMask, lights_deg: Mapping[str, float]) -> bool:
    """Whether colours are those of a bump rather than of a dent.

    The skin of a dent bulges toward the camera, so its side that faces a light brightens; of a bump
    the other side does.

    Args:
        difference: (h, w, 3), frame minus background in the gel plane.
        where: the dent or bump.
        lights_deg: azimuth that the light of each colour comes from.
    """
    y, x = (places - places.mean() for places in np.nonzero(where))
    colors = difference[where][:, channel_indices("".join(lights_deg))].astype(float)
    angles = np.radians(list(lights_deg.values()))
    facing = x[:, None] * np.cos(angles) + y[:, None] * np.sin(angles)
    colors -= colors.mean(0)
    of_all = float(np.linalg.norm(colors) * np.linalg.norm(facing))
    return -float((colors * facing).sum()) > LEAST_LIKE * of_all
