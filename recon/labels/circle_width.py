# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Are the circles of a set as wide as the contacts that a search finds?

Circles that are all too small or too large by one factor lie where their balls are, and explain
themselves on held-out presses: only a search that does not begin at them tells.
"""

from collections.abc import Sequence

import numpy as np

from recon.labels.find_circle import DOUBTFUL, find_circle, refuse_ball
from recon.pixels import BallPress
from sensor.errors import WedgeError

SEARCHED = 5
"""Presses, spread over the set: each search takes eight times as long as a fit to a circle."""
LEAST_TIMES, MOST_TIMES = 0.8, 1.4
"""Drawn radius over found one: medians are 0.98 to 1.25 on six sets, real and rendered, and 1.3
where circles were drawn round the visible disc (the published ones of ``known-depth``)."""


def circles_of_other_width(presses: Sequence[BallPress]) -> str:
    """A sentence where circles are all too small or too large; empty where nothing says so.

    Nothing says so where fewer than half of the balls that are searched for are found for certain.
    """
    places = np.linspace(0, len(presses) - 1, SEARCHED).round().astype(int)
    searched = [presses[index] for index in sorted(set(places.tolist()))] if presses else []
    known = [times for press in searched if (times := _times_as_wide(press)) is not None]
    if not known or 2 * len(known) < len(searched):
        return ""
    times = float(np.median(known))
    if LEAST_TIMES <= times <= MOST_TIMES:
        return ""
    return (
        f"The circles are {times:.2f} times as wide as the contacts that are found: if "
        "contact_radius_px is not the contact's radius in pixels of the unwarped frame, move "
        "labels.csv aside, find them anew with `wedge label DATASET`, then calibrate again."
    )


def _times_as_wide(press: BallPress) -> float | None:
    """As the contact that is found; ``None`` where no ball is found for certain."""
    try:
        refuse_ball(press.size_px, press.ball_radius_mm, press.mm_per_px)
    except WedgeError:  # no ball is so large: that is said elsewhere
        return None
    ball = find_circle(press.difference, press.ball_radius_mm, press.mm_per_px)
    if ball is None or ball.quality < DOUBTFUL:
        return None
    return press.contact_radius_px / ball.radius_px
