# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Where a sensor's lights are, measured from its ball presses, and which colours have one."""

from collections.abc import Sequence

import numpy as np

from recon.pixels import BallPress, join
from validation.lighting import response_to_slope, seen_contact

LEAST_SHARE = 0.03
"""Of the strongest colour's slope: the weakest light of seven sets has 0.38, a dark colour 0.001.

What a camera lets through of other colours may be more: it comes from where their lights sit.
"""
LEAST_CLEAR = 0.2
"""What slopes explain beside the residual, standard deviations: lights 1.1 to 5.3, noise 0.02."""


def measure_lights_deg(presses: Sequence[BallPress]) -> dict[str, float]:
    """Azimuth that each colour's light comes from, in whole degrees, -179 to 180.

    The ball's skin bulges toward the camera, so its side that faces a light brightens, and
    depth rises away from that side: the azimuth is that of minus the response of colour to
    gradient, over the contact pixels of all presses. A colour that does not answer to slopes has
    no light and is left out, unless none does and nothing can be told.
    """
    contact = join([seen_contact(press) for press in presses])
    response = response_to_slope(contact)
    azimuths = np.round(np.degrees(np.arctan2(-response[:, 1], -response[:, 0])))
    azimuths = np.where(azimuths == -180, 180, azimuths)
    strength = np.linalg.norm(response, axis=1)
    explained = contact.gradient @ response.T
    left_over = (contact.color - explained).std(0)
    shows = (strength > LEAST_SHARE * strength.max()) & (explained.std(0) > LEAST_CLEAR * left_over)
    kept = shows | ~shows.any()
    found = zip("RGB", azimuths, kept, strict=True)
    return {name: float(angle) for name, angle, is_lit in found if is_lit}
