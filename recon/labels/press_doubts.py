# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""What is to be doubted of a set of ball presses that is learnt from, or judged on."""

from collections.abc import Sequence

import numpy as np

from recon.labels.ball_size import doubtful_ball
from recon.labels.circle_width import circles_of_other_width
from recon.labels.circles import START, refit_circle
from recon.labels.find_circle import (
    CENTER_REACH,
    DOUBTFUL,
    find_circle,
    refuse_ball,
    search_image,
)
from recon.pixels import BallPress
from recon.presses import PressSet, deep_presses, few_presses, left_out_places
from sensor.dataset import BallLabel
from sensor.errors import WedgeError

NAMED = 5
DISPLACED = 0.3
"""Contact radii from circle to ball: of 204 presses of six sets, real and rendered, 199 balls are
found for certain, and lie 0.17 off at most."""
NEAR = 0.2
"""Contact radii that a right circle is moved by a fit that begins there: 0.14 at most on 160
presses of four sets, whose circles moved by 0.35 radii come back by 0.3; and where they were moved
by 1.3 to 3, quality stays below 0.65."""


def press_doubts(presses: PressSet, labels: Sequence[BallLabel]) -> tuple[str, ...]:
    """Sentences on circles, on how many presses there are, where and how deep, and on the ball.

    Args:
        presses: of a dataset.
        labels: of that dataset.
    """
    of_other_width = circles_of_other_width(presses.presses)
    doubts = (
        doubtful_circles(labels),
        displaced_circles(presses.presses),
        of_other_width,
        few_presses(presses),
        left_out_places(presses),
        # Neither depth nor ball can be judged by circles of another width.
        *(() if of_other_width else (deep_presses(presses), doubtful_ball(presses.presses))),
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
    return (
        f"{len(doubtful)} of {len(labels)} circles are doubtful ({_named(doubtful)}): check them "
        "with `wedge label`, then calibrate again."
    )


def displaced_circles(presses: Sequence[BallPress]) -> str:
    """A sentence that names circles which lie beside their balls; empty if there are none.

    Most lie beside them where the pad's size, the scale or the corners were changed by hand, as
    circles are in pixels of the unwarped frame. Where no ball is found for certain, none is named.
    """
    apart = [_apart(press) for press in presses]
    known = [share for share in apart if share is not None]
    if 2 * len(known) >= max(len(presses), 1) and np.median(known) >= DISPLACED:
        return (
            f"Circles lie beside the balls, by {np.median(known):.1f} contact radii: if "
            "pad_size_mm, mm_per_px or corners_px were changed since they were found, move "
            "labels.csv aside, find them anew with `wedge label DATASET`, then calibrate again."
        )
    beside = [x.file for x, share in zip(presses, apart, strict=True) if (share or 0) >= DISPLACED]
    if not beside:
        return ""
    one = len(beside) == 1
    lie = "lies beside its ball" if one else "lie beside their balls"
    return (
        f"{len(beside)} of {len(presses)} circles {lie} ({_named(beside)}): check "
        f"{'it' if one else 'them'} with `wedge label`, then calibrate again."
    )


def _apart(press: BallPress) -> float | None:
    """Contact radii from a circle to its ball; ``None`` where no ball is found for certain.

    A circle that a ball explains where it lies is right. For all others the ball is searched for,
    which takes eight times as long.
    """
    height, width = press.difference.shape[:2]
    try:
        refuse_ball((width, height), press.ball_radius_mm, press.mm_per_px)
    except WedgeError:  # no ball is so large: that is said elsewhere
        return None
    small, ball_px = search_image(press.difference, press.ball_radius_mm, press.mm_per_px)
    scale = np.array([small.shape[1] / width, small.shape[0] / height])
    x_px, y_px = (np.array(press.center_px) + 0.5) * scale - 0.5
    radius_px = press.contact_radius_px * float(np.sqrt(scale.prod()))
    fit = refit_circle(small, (x_px, y_px), radius_px / START, ball_px, CENTER_REACH)
    shift = float(np.hypot(*np.subtract(fit.center_px, (x_px, y_px)))) / radius_px
    if fit.quality >= DOUBTFUL and shift <= NEAR:
        return shift
    ball = find_circle(press.difference, press.ball_radius_mm, press.mm_per_px)
    if ball is None or ball.quality < DOUBTFUL:
        return None
    apart_mm = np.subtract(ball.center_px, press.center_px) * press.mm_per_px
    return float(np.hypot(*apart_mm)) / press.contact_radius_mm


def _named(files: Sequence[str]) -> str:
    return ", ".join(files[:NAMED]) + (" ..." if len(files) > NAMED else "")
