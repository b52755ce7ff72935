# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""What is to be doubted of a set of ball presses that is learnt from, or judged on."""

from recon.labels.ball_size import doubtful_ball
from recon.presses import PressSet, deep_presses, few_presses, left_out_places


def press_doubts(presses: PressSet) -> tuple[str, ...]:
    """Sentences: too few presses, places left out, too deep, a ball's radius that may be wrong."""
    doubts = (
        few_presses(presses),
        left_out_places(presses),
        deep_presses(presses),
        doubtful_ball(presses.presses),
    )
    return tuple(doubt for doubt in doubts if doubt)
