# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Where a sensor's lights are, measured from its ball presses."""

from collections.abc import Sequence

import numpy as np

from recon.pixels import BallPress, join, label_pixels


def measure_lights_deg(presses: Sequence[BallPress]) -> dict[str, float]:
    """Azimuth that each colour's light comes from, in whole degrees, -179 to 180.

    The ball's skin bulges toward the camera, so its side that faces a light brightens, and
    depth rises away from that side: the azimuth is that of minus the slope of colour against
    gradient, by least squares over the contact pixels of all presses.
    """
    pixels = join([label_pixels(press, index, seed=0) for index, press in enumerate(presses)])
    gradient, color = pixels.gradient[pixels.contact], pixels.color[pixels.contact]
    terms = np.column_stack([gradient, np.ones(len(gradient))])
    slopes = np.linalg.lstsq(terms, color, rcond=None)[0][:2]
    azimuths = np.round(np.degrees(np.arctan2(-slopes[1], -slopes[0])))
    azimuths = np.where(azimuths == -180, 180, azimuths)
    return {name: float(angle) for name, angle in zip("RGB", azimuths, strict=True)}
