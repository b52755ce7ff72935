# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Doubtful circles are named to whoever calibrates on them."""

from dataclasses import replace

import pytest

from recon.labels.find_circle import DOUBTFUL
from recon.labels.press_doubts import NAMED, doubtful_circles
from sensor.dataset import BallLabel

LABEL = BallLabel(file="a.png", center_x_px=5.0, center_y_px=5.0, contact_radius_px=3.0)


def labels(qualities: list[float | None]) -> list[BallLabel]:
    return [replace(LABEL, file=f"{i}.png", quality=q) for i, q in enumerate(qualities)]


@pytest.mark.parametrize("quality", [None, 1.0, DOUBTFUL])
def test_drawn_and_certain_circles_are_not_doubtful(quality: float | None) -> None:
    assert doubtful_circles(labels([quality])) == ""


def test_doubtful_circles_are_named_but_not_all_of_many() -> None:
    few = doubtful_circles(labels([0.9, 0.5, None, 0.6]))
    assert "2 of 4 circles are doubtful (1.png, 3.png)" in few and "wedge label" in few
    many = doubtful_circles(labels([0.5] * (NAMED + 1)))
    assert f"{NAMED - 1}.png ...)" in many
