# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Where a sensor's lights are, measured from its ball presses, and which colours have one."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float64

from recon.pixels import BallPress, Pixels, join
from validation.lighting import response_to_slope, seen_contact

LEAST_SHARE = 0.03
"""Of the strongest colour's slope: the weakest light of seven sets has 0.38, a dark colour 0.001.

What a camera lets through of other colours may be more: it comes from where their lights sit.
"""
LEAST_CLEAR = 0.2
"""What slopes explain beside the residual, standard deviations: lights 1.1 to 5.3, noise 0.02."""
SURE_SHARE, SURE_CLEAR, SURE_PRESSES = 0.3, 0.5, 6
"""The like, below which a place is not held against what somebody stated, and fewest presses."""
SURE_DEG = 30.0
"""By which every other press may show a light elsewhere than the rest: lights 0 to 7."""


@dataclass(frozen=True, kw_only=True)
class _Shown:
    """What contact pixels show of the light of red, green and blue."""

    azimuth_deg: Float64[np.ndarray, "3"]
    share: Float64[np.ndarray, "3"]
    """Of the strongest colour's answer to slope."""
    clear: Float64[np.ndarray, "3"]
    """Standard deviation of what slopes explain, of the residual's."""


def measure_lights_deg(presses: Sequence[BallPress]) -> dict[str, float]:
    """Azimuth that each colour's light comes from, in whole degrees, -179 to 180.

    The ball's skin bulges toward the camera, so its side that faces a light brightens, and
    depth rises away from that side: the azimuth is that of minus the response of colour to
    gradient, over the contact pixels of all presses. A colour that does not answer to slopes has
    no light and is left out, unless none does and nothing can be told.
    """
    shown = _shown(join([seen_contact(press) for press in presses]))
    lit = (shown.share > LEAST_SHARE) & (shown.clear > LEAST_CLEAR)
    return _named_deg(shown, lit | ~lit.any())


def sure_lights_deg(presses: Sequence[BallPress]) -> dict[str, float]:
    """Of ``measure_lights_deg``, the colours whose place is beyond doubt; none of few presses.

    They answer to slopes clearly, and every other press shows them where the rest do.
    """
    if len(presses) < SURE_PRESSES:
        return {}
    parts = [seen_contact(press) for press in presses]
    shown, some, others = (_shown(join(half)) for half in (parts, parts[::2], parts[1::2]))
    apart_deg = np.abs((some.azimuth_deg - others.azimuth_deg + 180) % 360 - 180)
    sure = (shown.share > SURE_SHARE) & (shown.clear > SURE_CLEAR) & (apart_deg < SURE_DEG)
    return _named_deg(shown, sure)


def _shown(contact: Pixels) -> _Shown:
    response = response_to_slope(contact)
    strength = np.linalg.norm(response, axis=1)
    explained = contact.gradient @ response.T
    left_over = (contact.color - explained).std(0)
    tiny = np.finfo(np.float64).tiny
    return _Shown(
        azimuth_deg=np.degrees(np.arctan2(-response[:, 1], -response[:, 0])),
        share=strength / max(strength.max(), tiny),
        clear=explained.std(0) / np.maximum(left_over, tiny),
    )


def _named_deg(shown: _Shown, kept: np.ndarray) -> dict[str, float]:
    azimuths = np.round(shown.azimuth_deg)
    azimuths = np.where(azimuths == -180, 180, azimuths)
    found = zip("RGB", azimuths, kept, strict=True)
    return {name: float(angle) for name, angle, is_kept in found if is_kept}
