# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Doubtful circles are named to whoever calibrates on them."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from recon.labels.find_circle import DOUBTFUL
from recon.labels.press_doubts import NAMED, displaced_circles, doubtful_circles
from recon.pixels import BallPress
from recon.presses import read_presses
from sensor.dataset import BallLabel, read_dataset
from tests.synthetic import KEYSTONE_PX, make_dataset
from validation.datasets import dataset_folder

LABEL = BallLabel(file="a.png", center_x_px=5.0, center_y_px=5.0, contact_radius_px=3.0)


@pytest.fixture(scope="module")
def presses_of(tmp_path_factory: pytest.TempPathFactory) -> Callable[[int], Sequence[BallPress]]:
    """So many, made when they are first asked for."""
    folder = tmp_path_factory.mktemp("sets")
    return cache(
        lambda count: read_presses(make_dataset(folder / str(count), presses=count)).presses
    )


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


def test_circles_that_lie_beside_their_balls_are_said(presses_of) -> None:
    presses = presses_of(5)
    assert displaced_circles(presses) == ""
    for share, said in ((0.15, False), (0.6, True)):
        moved = [
            replace(press, center_px=(press.center_px[0] + share * press.contact_radius_px, y))
            for press in presses
            for y in [press.center_px[1]]
        ]
        assert ("Circles lie beside the balls, by 0.6" in displaced_circles(moved)) == said
    assert displaced_circles([]) == ""
    assert displaced_circles([replace(press, ball_radius_mm=500.0) for press in presses]) == ""


def test_a_pad_that_is_said_to_be_larger_displaces_its_circles(tmp_path: Path) -> None:
    dataset = make_dataset(tmp_path / "set", presses=5, corners_px=KEYSTONE_PX)
    assert displaced_circles(read_presses(dataset).presses) == ""
    pad_mm = dataset.card.pad_size_mm
    assert pad_mm is not None
    larger = replace(dataset.card, pad_size_mm=(1.1 * pad_mm[0], 1.1 * pad_mm[1]))
    said = displaced_circles(read_presses(replace(dataset, card=larger)).presses)
    assert "move labels.csv aside, find them anew with `wedge label DATASET`" in said


def beside(press: BallPress, radii: float, angle_deg: float = 0.0) -> BallPress:
    """The press, its circle moved by so many contact radii."""
    toward = np.array([np.cos(np.radians(angle_deg)), np.sin(np.radians(angle_deg))])
    x_px, y_px = press.center_px + radii * press.contact_radius_px * toward
    return replace(press, center_px=(float(x_px), float(y_px)))


def test_a_ball_that_is_found_once_among_many_presses_does_not_blame_the_scale(presses_of) -> None:
    presses = presses_of(5)
    faint = [
        replace(press, difference=(0.01 * press.difference).astype(np.float32))
        for press in presses[1:]
    ]
    said = displaced_circles([beside(presses[0], 0.9), *faint])
    assert said.startswith(f"1 of 5 circles lies beside its ball ({presses[0].file}): check it")
    assert displaced_circles([presses[0], *faint]) == ""


@pytest.mark.parametrize("radii", [0.4, 1.0, 2.0])
@pytest.mark.parametrize("angle_deg", [20, 200])
def test_each_circle_beside_its_ball_is_named_and_no_other(
    presses_of, radii: float, angle_deg: float
) -> None:
    presses = list(presses_of(5))
    for index, turned_deg in ((2, 0), (4, 90)):
        presses[index] = beside(presses[index], radii, angle_deg + turned_deg)
    names = f"{presses[2].file}, {presses[4].file}"
    said = displaced_circles(presses)
    assert said.startswith(f"2 of 5 circles lie beside their balls ({names}): check them")


@pytest.mark.parametrize("name", ["taxim-gelsight", "twin-standard", "twin-finger"])
def test_no_circle_of_a_set_that_is_known_is_named(name: str) -> None:
    dataset = read_dataset(dataset_folder(name))
    few = replace(dataset, labels=dataset.labels[::6])
    assert displaced_circles(read_presses(few).presses) == ""
