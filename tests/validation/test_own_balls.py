# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""A ball's radius counts as much where a press states it as where the card does."""

from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from recon.presses import press_reader
from sensor.dataset import Dataset, read_dataset, write_card, write_labels
from tests.synthetic import BALL_RADIUS_MM, make_dataset
from validation import untouched
from validation.circles import look
from validation.error_table import error_table
from validation.examples import held_out
from validation.label_noise import label_shift_deg
from validation.table_text import caption, table_document


def stated_by_presses(folder: Path, count: int) -> tuple[Dataset, Dataset]:
    """The same presses of one ball twice: by the card, and by each press against the card."""
    plain = make_dataset(folder / "plain", presses=count)
    make_dataset(folder / "own", presses=count)
    write_card(
        folder / "own" / "dataset.toml", replace(plain.card, ball_radius_mm=2 * BALL_RADIUS_MM)
    )
    labels = [replace(label, ball_radius_mm=BALL_RADIUS_MM) for label in plain.labels]
    write_labels(folder / "own" / "labels.csv", labels)
    return plain, read_dataset(folder / "own")


def test_the_error_table_and_its_words_are_the_same(tmp_path: Path) -> None:
    with ThreadPoolExecutor(1) as executor:
        plain, own = (
            error_table(dataset.folder, ("table",), folds=1, seed=0, executor=executor)
            for dataset in stated_by_presses(tmp_path, 6)
        )
    assert table_document(own) == table_document(plain)
    assert caption(own) == caption(plain)


def test_a_set_of_several_balls_names_them_all(tmp_path: Path) -> None:
    dataset = make_dataset(tmp_path / "set", presses=6)
    first, *others = dataset.labels
    write_labels(tmp_path / "set" / "labels.csv", [replace(first, ball_radius_mm=2.5), *others])
    with ThreadPoolExecutor(1) as executor:
        table = error_table(dataset.folder, ("table",), folds=3, seed=0, executor=executor)
    assert "2.5 and 4 mm" in caption(table)
    fold = table.folds_fitted["table"][0]
    held = held_out(dataset.folder, fold, 0)
    for press in np.unique(held.pixels.press):
        (ball_mm,) = np.unique(held.ball_radius_mm[held.pixels.press == press])
        assert ball_mm == (2.5 if press == 0 else 4.0)


def test_a_label_s_shift_is_the_mean_over_balls() -> None:
    slopes = np.array([[0.4, 0.1], [0.7, -0.2]], np.float32)
    balls_mm = np.array([2.0, 5.0], np.float32)
    each = [label_shift_deg(slopes[i : i + 1], float(balls_mm[i]), 0.05) for i in (0, 1)]
    assert label_shift_deg(slopes, balls_mm, 0.05) == pytest.approx(np.mean(each))


def test_balls_are_looked_for_by_their_own_radius(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    plain, own = stated_by_presses(tmp_path, 2)
    label = own.labels[0]
    assert look(press_reader(own), label) == look(press_reader(plain), plain.labels[0])
    monkeypatch.setattr(untouched, "LEAST_SIDE", 0.01)
    monkeypatch.setattr(untouched, "find_circle", lambda _, ball_mm, __: ball_mm != BALL_RADIUS_MM)
    row = untouched.beside_presses(str(own.folder))
    assert row.searches and not row.found
