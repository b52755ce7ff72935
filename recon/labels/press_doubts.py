# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""What is to be doubted of a set of ball presses that is learnt from, or judged on."""

from collections.abc import Sequence

from recon.labels.ball_size import doubtful_ball
from recon.labels.find_circle import DOUBTFUL
from recon.presses import PressSet, deep_presses, few_presses, left_out_places
from sensor.dataset import BallLabel

NAMED = 5


def press_doubts(presses: PressSet, labels: Sequence[BallLabel]) -> tuple[str, ...]:
    """Sentences on circles, on how many presses there are, where and how deep, and on the ball.

    Args:
        presses: of a dataset.
        labels: of that dataset.
    """
    doubts = (
        doubtful_circles(labels),
        few_presses(presses),
        left_out_places(presses),
        deep_presses(presses),
        doubtful_ball(presses.presses),
    )
    return tuple(doubt for doubt in doubts if doubt)


def doubtful_circles(labels: Sequence[BallLabel]) -> str:
    """A sentence that names circles which somebody should look at; empty if there are none."""
    doubtful = [x.file for x in labels if x.quality is not None and x.quality < DOUBTFUL]
    if not doubtful:
        return ""
    names = ", ".join(doubtful[:NAMED]) + (" ..." if len(doubtful) > NAMED else "")
    return (
        f"{len(doubtful)} of {len(labels)} circles are doubtful ({names}): check them with "
        "`wedge label`, then calibrate again."
    )
