# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Circles that are all too small or too large are noticed, and nothing else is asked instead."""

from dataclasses import replace

import numpy as np
import pytest

from recon.labels.ball_size import doubtful_ball
from recon.labels.circle_width import circles_of_other_width
from recon.labels.press_doubts import press_doubts
from recon.presses import PressSet, deep_presses, read_presses
from tests.synthetic import make_dataset


@pytest.fixture(scope="module")
def dataset(tmp_path_factory: pytest.TempPathFactory):
    return make_dataset(tmp_path_factory.mktemp("sets") / "set", presses=7)


@pytest.fixture(scope="module")
def presses(dataset) -> PressSet:
    return read_presses(dataset)


def drawn(presses: PressSet, times: float) -> PressSet:
    """The same presses, each circle so many times as wide."""
    wide = (replace(x, contact_radius_px=times * x.contact_radius_px) for x in presses.presses)
    return replace(presses, presses=tuple(wide))


def test_right_circles_of_any_depth_raise_no_doubt(presses: PressSet) -> None:
    assert circles_of_other_width(presses.presses) == ""
    assert circles_of_other_width(presses.presses[:1]) == ""
    assert circles_of_other_width([]) == ""


@pytest.mark.parametrize("times", [0.5, 0.6, 1.6])
def test_the_factor_is_said_by_which_all_circles_are_too_small_or_too_large(
    presses: PressSet, times: float
) -> None:
    said = circles_of_other_width(drawn(presses, times).presses)
    assert said.startswith("The circles are ") and "`wedge label DATASET`" in said
    assert float(said.split()[3]) == pytest.approx(times, rel=0.1)


@pytest.mark.parametrize("times", [0.9, 1.2])
def test_circles_that_are_drawn_by_hand_may_stray(presses: PressSet, times: float) -> None:
    assert circles_of_other_width(drawn(presses, times).presses) == ""


def test_a_single_circle_of_another_width_does_not_blame_all(presses: PressSet) -> None:
    one, *others = presses.presses
    wide = replace(one, contact_radius_px=2 * one.contact_radius_px)
    assert circles_of_other_width([wide, *others]) == ""


def test_nothing_is_said_where_most_balls_are_not_found(presses: PressSet) -> None:
    narrow = drawn(presses, 0.5).presses
    faint = [
        replace(press, difference=(0.01 * press.difference).astype(np.float32))
        for press in narrow[1:]
    ]
    assert circles_of_other_width([narrow[0], *faint]) == ""
    assert circles_of_other_width([replace(x, ball_radius_mm=500.0) for x in narrow]) == ""


@pytest.mark.parametrize(("times", "ball_mm"), [(0.5, 4.0), (1.6, 3.0)])
def test_neither_depth_nor_ball_is_blamed_for_circles_of_another_width(
    dataset, presses: PressSet, times: float, ball_mm: float
) -> None:
    wrong = drawn(presses, times)
    wrong = replace(wrong, presses=tuple(replace(x, ball_radius_mm=ball_mm) for x in wrong.presses))
    assert deep_presses(wrong) or doubtful_ball(wrong.presses)  # each blames what is right
    doubts = press_doubts(wrong, dataset.labels)
    assert sum("times as wide as the contacts" in doubt for doubt in doubts) == 1
    assert not any("diameter" in doubt or "gently" in doubt for doubt in doubts)
