# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Circles wider than their balls: one is its own fault, most are the ball's or the scale's."""

from dataclasses import replace
from pathlib import Path

import pytest

from sensor.dataset import BallLabel, Dataset, DatasetCard
from sensor.errors import WedgeError

CARD = DatasetCard(
    name="set",
    source="test",
    licence="CC0-1.0",
    mm_per_px=(24.6, 24.6),
    ball_radius_mm=2.4,
    background=("background.png",),
)


def labels(radii_px: list[float]) -> tuple[BallLabel, ...]:
    return tuple(
        BallLabel(file=f"{i}.png", center_x_px=50.0, center_y_px=50.0, contact_radius_px=radius_px)
        for i, radius_px in enumerate(radii_px)
    )


def test_the_scale_is_named_where_most_circles_are_wider_than_their_ball() -> None:
    of_px_per_mm = Dataset(folder=Path("set"), card=CARD, labels=labels([28.8, 30.0]))
    with pytest.raises(WedgeError, match=r"ball_radius_mm or mm_per_px \(now \[24\.6, 24\.6\]\)"):
        of_px_per_mm.refuse_wide_circles()


def test_the_scale_is_not_blamed_for_a_single_wide_circle() -> None:
    right = replace(CARD, mm_per_px=(1 / 24.6, 1 / 24.6))
    one_of_three = Dataset(folder=Path("set"), card=right, labels=labels([28.8, 30.0, 80.0]))
    with pytest.raises(WedgeError, match=r"^(?!.*mm_per_px).*correct ball_radius_mm, or remove"):
        one_of_three.refuse_wide_circles()
    replace(one_of_three, labels=one_of_three.labels[:2]).refuse_wide_circles()
