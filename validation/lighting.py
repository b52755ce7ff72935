# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""How well a gel is lit: where, how evenly, how a dent stands out, and what a slope changes."""

import numpy as np
from jaxtyping import Float64

from recon.arrays import ContactMask, Difference, Unwarped
from recon.lights import channel_indices
from recon.pixels import BallPress, Pixels, label_pixels

GRAY_LEVELS = 255
GAMMA = 2.2
LIT = 0.5
"""Share of a colour's own mean from which a pixel counts as lit by it."""


def linear(image: Unwarped) -> np.ndarray:
    """Light behind a frame in full scale, by the usual gamma."""
    return np.asarray(image, np.float64) ** GAMMA


def lit_area(background: Unwarped, channels: str = "RGB") -> float:
    """Share of the untouched gel that every one of these colours reaches."""
    light = linear(background)[..., channel_indices(channels)]
    return float((light >= LIT * light.mean((0, 1))).all(-1).mean())


def unevenness(background: Unwarped) -> float:
    """Standard deviation of the untouched gel's light over its mean, mean over the colours."""
    light = linear(background)
    return float((light.std((0, 1)) / light.mean((0, 1))).mean())


def contrast(difference: Difference, contact: ContactMask) -> float:
    """Root mean square of the difference in a contact, all colours, in grey levels."""
    return float(GRAY_LEVELS * np.sqrt(np.mean(difference[contact] ** 2)))


def seen_contact(press: BallPress) -> Pixels:
    """The contact pixels whose colour was seen: under dots it is only filled in."""
    pixels = label_pixels(press, index=0, seed=0)
    return pixels[pixels.contact & ~pixels.hidden]


def response_to_slope(contact: Pixels) -> Float64[np.ndarray, "3 2"]:
    """Change of R, G and B, in full scale, with the gradient along x and y, by least squares."""
    terms = np.column_stack([contact.gradient, np.ones(len(contact))]).astype(float)
    fitted: np.ndarray = np.linalg.lstsq(terms, contact.color.astype(float), rcond=None)[0]
    return fitted[:2].T


def axes_ratio(response: Float64[np.ndarray, "colors 2"]) -> float:
    """How many times as strongly colours answer to the slope that they show best as across it."""
    of_both = (*np.linalg.svd(response, compute_uv=False), 0.0)  # one colour alone shows one slope
    return float(of_both[0] / max(of_both[1], 1e-9))
