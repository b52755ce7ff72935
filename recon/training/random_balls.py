# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Balls in closed form at random places: what an answer for an unseen slope is first held against.

All lengths are in pixels.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from recon.ball import ball_cap, offsets_mm
from sensor.toml import Pair

SQUARE: Pair = (1.0, 1.0)
CONTACTS = (0.1, 0.4)
"""Radii of contacts, in shares of the frame's shorter side."""
PRESSED = (0.3, 0.9)
"""Contacts' radii, in shares of the ball's; the table judges none beyond 0.9."""
BESIDE, BESIDE_SHARE = 1.3, 0.05
"""Contact radii from which a pixel counts as untouched, and which share of those is judged."""


@dataclass(frozen=True, kw_only=True)
class RandomBall:
    """A ball somewhere in a frame, wholly visible."""

    center_px: Pair
    contact_radius_px: float
    ball_radius_px: float
    gradient: Float[np.ndarray, "h w 2"]

    def judged(self, random: np.random.Generator) -> Bool[np.ndarray, "h w"]:
        """The error table's pixels: in the contact by a pixel, and 5 % of the untouched ones."""
        height, width = self.gradient.shape[:2]
        distance = np.hypot(*offsets_mm((width, height), self.center_px, SQUARE))
        beside = distance > BESIDE * self.contact_radius_px
        chosen: np.ndarray = beside & (random.random(distance.shape) < BESIDE_SHARE)
        return chosen | (distance < self.contact_radius_px - 1)


def random_ball(random: np.random.Generator, size_px: tuple[int, int]) -> RandomBall:
    """A ball pressed somewhere into a frame of ``size_px`` (width, height)."""
    contact_px = random.uniform(*CONTACTS) * min(size_px)
    ball_px = contact_px / random.uniform(*PRESSED)
    x_px, y_px = (random.uniform(1.05 * contact_px, s - 1.05 * contact_px) for s in size_px)
    return RandomBall(
        center_px=(x_px, y_px),
        contact_radius_px=contact_px,
        ball_radius_px=ball_px,
        gradient=ball_cap(size_px, (x_px, y_px), contact_px, ball_px, SQUARE).gradient,
    )
