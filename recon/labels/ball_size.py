# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Can the stated radius of a ball be right?

Inside a contact the skin's normal leans by ``offset / R``, and what colour a lean has is what is
to be learnt: presses of one ball explain themselves as well with any other radius, all slopes
scaled. What speaks against a radius is geometry, and a second ball: a contact is never as wide as
its ball, so that a diameter given as the radius leaves every contact within half of it; and one
lean has one colour, whichever ball it is.
"""

from collections.abc import Sequence

import numpy as np

from recon.pixels import RIM_PX, BallPress
from sensor.dataset import BallLabel, DatasetCard
from sensor.errors import WedgeError

NARROW = 0.55
"""Of the stated radius: no contact is wider than half where that is the diameter, but circles
found with a ball too large come out wider, up to 0.52 on a real Wedge."""
WIDEST = 0.95
"""Quantile of the contacts' radii: hand-drawn circles stray."""
LEAST_WIDE = 0.05
"""Of the ball's radius: where no contact is wider, the scale or the ball is wrong, as it would be
pressed in by hardly more than a thousandth of its radius."""
FEWEST_CONTACTS = 5
UPRIGHT = 0.45
"""Leans are compared up to this sine, where colours still follow them in proportion."""
DISAGREEMENT = 1.25
"""Between two balls' colours for one lean; halves of real sets differ by up to 1.1."""

CLAMPED, MOST_CLAMPED = 0.93, 0.5
"""Contacts this near to the ball's radius, and the share of presses from which it must be wrong."""


def refuse_wrong_ball(labels: Sequence[BallLabel], card: DatasetCard) -> None:
    """Refuse a ball's radius, or a scale, by which contacts cannot be as wide as they are.

    That is most of them as wide as their ball, or all of them specks.

    Raises:
        WedgeError: names both lengths and the scale.
    """
    pitch_mm = np.sqrt(np.prod(card.mm_per_px))
    radii_mm = np.array([x.contact_radius_px for x in labels]) * pitch_mm
    balls_mm = np.array([x.ball_radius_mm or card.ball_radius_mm for x in labels])
    clamped = radii_mm > CLAMPED * balls_mm
    if len(labels) and clamped.mean() > MOST_CLAMPED:
        raise WedgeError(
            f"most contacts are as wide as the ball of radius {np.median(balls_mm):g} mm "
            f"({np.median(radii_mm):.2f} mm at {pitch_mm:.4g} mm/px): are its radius "
            "and the scale right?"
        )
    if len(labels) and (radii_mm / balls_mm).max() < LEAST_WIDE:
        raise WedgeError(
            f"the widest contact reaches {(radii_mm / balls_mm).max():.2g} of its ball's radius "
            f"({radii_mm.max():.2g} mm at {pitch_mm:.4g} mm/px, its ball {np.median(balls_mm):g} "
            "mm): are ball_radius_mm and mm_per_px right, and in millimetres?"
        )


def doubtful_ball(presses: Sequence[BallPress]) -> str | None:
    """A sentence where a ball's radius may be wrong; ``None`` where nothing speaks against it."""
    by_radius: dict[float, list[BallPress]] = {}
    for press in presses:
        by_radius.setdefault(press.ball_radius_mm, []).append(press)
    enough = {r: x for r, x in sorted(by_radius.items()) if len(x) >= FEWEST_CONTACTS}
    for radius_mm, alike in enough.items():
        widest = float(np.quantile([x.contact_radius_mm for x in alike], WIDEST)) / radius_mm
        if widest <= NARROW:
            return (
                f"The widest contacts reach {widest:.2f} of the ball's radius, {radius_mm:g} mm: "
                "is that its radius, not its diameter, and is mm_per_px right? If both are, press "
                f"deeper, as no press has slopes beyond {np.degrees(np.arcsin(widest)):.0f}°."
            )
    answers = {radius_mm: answer_to_lean(alike) for radius_mm, alike in enough.items()}
    if len(answers) > 1:
        least, most = min(answers, key=answers.__getitem__), max(answers, key=answers.__getitem__)
        times = answers[most] / max(answers[least], 1e-9)
        if times > DISAGREEMENT:
            return (
                f"Where the balls of radius {least:g} and {most:g} mm have the same slope, colours "
                f"of the second change {times:.1f} times as much: one of the two radii is wrong."
            )
    return None


def answer_to_lean(presses: Sequence[BallPress]) -> float:
    """How strongly colours change with the lean of the normal, in full scale; the median press.

    Root of the summed squares of all colours' answers along both axes, by least squares over the
    pixels of a contact whose normal leans little.
    """
    answers = []
    for press in presses:
        x_mm, y_mm = press.offsets_mm
        rim_mm = RIM_PX * press.contact_radius_mm / press.contact_radius_px
        reach_mm = min(press.contact_radius_mm - rim_mm, UPRIGHT * press.ball_radius_mm)
        inside = np.hypot(x_mm, y_mm) < reach_mm
        if press.hidden is not None:
            inside &= ~press.hidden
        lean = np.stack([x_mm[inside], y_mm[inside], press.ball_radius_mm + 0 * x_mm[inside]], 1)
        color = press.difference[inside].astype(float)
        share = np.linalg.lstsq(lean / press.ball_radius_mm, color, rcond=None)[0]
        answers.append(float(np.linalg.norm(share[:2])))
    return float(np.median(answers))
