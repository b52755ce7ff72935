# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""What is to be doubted of a set of ball presses that is learnt from, or judged on."""

from collections.abc import Sequence

import numpy as np

from recon.labels.ball_size import doubtful_ball
from recon.labels.find_circle import DOUBTFUL, find_circle
from recon.pixels import BallPress
from recon.presses import PressSet, deep_presses, few_presses, left_out_places
from sensor.dataset import BallLabel
from sensor.errors import WedgeError

NAMED = 5
LOOKED_AT = 7
DISPLACED = 0.3
"""Contact radii from circle to ball; on real sets those found anew lie 0.1 off at most."""


def press_doubts(presses: PressSet, labels: Sequence[BallLabel]) -> tuple[str, ...]:
    """Sentences on circles, on how many presses there are, where and how deep, and on the ball.

    Args:
        presses: of a dataset.
        labels: of that dataset.
    """
    doubts = (
        doubtful_circles(labels),
        displaced_circles(presses.presses),
        few_presses(presses),
        left_out_places(presses),
        deep_presses(presses),
        doubtful_ball(presses.presses),
    )
    return tuple(doubt for doubt in doubts if doubt)


def is_doubtful(label: BallLabel) -> bool:
    """Whether somebody should look at a circle that was found."""
    return label.quality is not None and label.quality < DOUBTFUL


def doubtful_circles(labels: Sequence[BallLabel]) -> str:
    """A sentence that names circles which somebody should look at; empty if there are none."""
    doubtful = [x.file for x in labels if is_doubtful(x)]
    if not doubtful:
        return ""
    names = ", ".join(doubtful[:NAMED]) + (" ..." if len(doubtful) > NAMED else "")
    return (
        f"{len(doubtful)} of {len(labels)} circles are doubtful ({names}): check them with "
        "`wedge label`, then calibrate again."
    )


def displaced_circles(presses: Sequence[BallPress]) -> str:
    """A sentence where most circles lie beside their balls; empty if they do not.

    So it is where the pad's size, the scale or the corners were changed by hand, as circles are in
    pixels of the unwarped frame. Some presses are looked at, spread over the list.
    """
    count = min(len(presses), LOOKED_AT)
    off: list[float] = []
    for index in np.linspace(0, len(presses) - 1, count).round().astype(int):
        press = presses[index]
        try:
            ball = find_circle(press.difference, press.ball_radius_mm, press.mm_per_px)
        except WedgeError:  # no ball is so large: that is said elsewhere
            return ""
        if ball is not None and ball.quality >= DOUBTFUL:
            apart_mm = np.subtract(ball.center_px, press.center_px) * press.mm_per_px
            off.append(float(np.hypot(*apart_mm)) / press.contact_radius_mm)
    if 2 * len(off) < max(count, 1) or np.median(off) < DISPLACED:
        return ""
    return (
        f"Circles lie beside the balls, by {np.median(off):.1f} contact radii: if pad_size_mm, "
        "mm_per_px or corners_px were changed since they were found, move labels.csv aside, find "
        "them anew with `wedge label DATASET`, then calibrate again."
    )
