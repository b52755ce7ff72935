# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""What is measured beyond the lesson: other shapes, other balls, fewer presses, intervals."""

import json
import shutil
import sys

import numpy as np
import pytest

from recon.calibration import lit_channels
from recon.coverage import Coverage
from recon.images import read_image, write_image
from sensor.errors import WedgeError
from tests.synthetic import make_dataset, make_rendered_set
from validation import generalization
from validation.depth import cap_of


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Twelve presses; one of them once more as a shape with its truth."""
    folder = tmp_path_factory.mktemp("beyond") / "set"
    dataset = make_dataset(folder, presses=12)
    presses, _ = generalization._read(str(folder))
    write_image(folder / "cap.jpg", read_image(folder / dataset.labels[0].file))
    (folder / "truth").mkdir()
    np.save(folder / "truth" / "cap.npy", cap_of(presses[0]).depth_mm.astype(np.float32))
    return folder


def test_a_shapes_ratio_is_to_the_papers_error_of_that_shape(folder, monkeypatch):
    monkeypatch.setattr(generalization, "REFERENCE", "table")
    rows = generalization.shapes(str(folder), str(folder), ["table"])
    assert [row["shape"] for row in rows] == ["cap"] and rows[0]["ratio"] == 1.0
    assert rows[0]["rmse_mm"] >= abs(rows[0]["bias_mm"])
    few = generalization.shapes(str(folder), str(folder), ["table"], count=6)
    assert [row["presses"] for row in few] == [6, 6, 6]
    assert [row["chosen"] for row in few] == list(generalization.CHOICES)


def test_shapes_of_a_second_set_are_read_as_the_first_one_taught(folder, tmp_path):
    second = make_dataset(tmp_path / "set", presses=8, seed=3)
    with pytest.raises(WedgeError, match="truth"):
        generalization.shapes(str(folder), str(second.folder), ["table"])
    for name in ("cap.png", "cap.jpg"):
        if (folder / name).exists():
            shutil.copy(folder / name, second.folder)
    shutil.copytree(folder / "truth", second.folder / "truth")
    (own,) = generalization.shapes(str(folder), str(folder), ["table"])
    (row,) = generalization.shapes(str(folder), str(second.folder), ["table"])
    assert row["shape"] == "cap" and row["presses"] == own["presses"] == 12
    assert row["rmse_mm"] == pytest.approx(own["rmse_mm"], rel=0.3)


def test_another_set_is_judged_by_what_one_set_taught_and_by_its_own_folds(folder, tmp_path):
    second = make_dataset(tmp_path / "set", presses=10, seed=5)
    across, own = generalization.other(str(folder), str(second.folder), ["table"])
    assert across["judged"] == own["judged"] == 10
    assert across["contact theta_deg"] < 3 * own["contact theta_deg"] < 20
    assert across["depth"]["truth"] == "ball cap"
    assert len(across["depth"]["peaks_off_mm"]) == 10


def test_depth_of_another_set_is_judged_wherever_its_truth_is_pressed_in(folder, tmp_path):
    second = make_rendered_set(tmp_path / "set", presses=4, seed=5)
    (before,) = generalization.other(str(folder), str(second.folder), ["table"])
    for file in (second.folder / "truth").iterdir():
        deep = np.load(file)
        np.save(file, np.where(deep > 0, deep, 1.0).astype(np.float32))  # all gel has moved
    (after,) = generalization.other(str(folder), str(second.folder), ["table"])
    assert before["depth"]["truth"] == after["depth"]["truth"] == "truth file"
    assert after["depth"]["peaks_off_mm"] == pytest.approx(
        before["depth"]["peaks_off_mm"], abs=1e-6
    )
    assert after["depth"]["bias_mm"] < before["depth"]["bias_mm"] - 0.5


def test_a_quarter_of_the_pad_is_judged_by_presses_of_the_others(folder, monkeypatch):
    taught, fit = [], generalization._fit

    def told(name, presses, *others):
        taught.append({press.file for press in presses})
        return fit(name, presses, *others)

    monkeypatch.setattr(generalization, "_fit", told)
    by_place, by_press = generalization.places(str(folder), ["table"])
    assert by_place["judged"] == by_press["judged"] == 12
    presses, _ = generalization._read(str(folder))
    middle_px = np.divide(presses[0].size_px, 2)
    places = {press.file: tuple(press.center_px > middle_px) for press in presses}
    count = len(set(places.values()))
    assert len(taught) == 2 * count
    for train in taught[:count]:
        held_out = {places[file] for file in places.keys() - train}
        assert len(held_out) == 1 and not held_out & {places[file] for file in train}


def test_presses_of_one_quarter_are_not_held_out_by_place(folder):
    presses, _ = generalization._read(str(folder))
    with pytest.raises(WedgeError, match="press the ball all over it"):
        generalization._quarters_of_the_pad(presses[:1])


def test_fewer_presses_are_as_many_as_asked_for(folder):
    *few, every = generalization.fewer(str(folder), ["table"], 4)
    assert [row["presses"] for row in few] == [4, 4, 4]
    assert 4 < every["presses"] < 12
    for row in few:
        assert row["judged"] == every["judged"] == 12
        assert row["contact theta_deg"] >= every["contact theta_deg"]


def test_presses_chosen_over_the_pad_leave_no_press_far_from_them(folder):
    presses, _ = generalization._read(str(folder))
    places = np.array([press.center_px for press in presses])
    farthest = {}
    for how in generalization.CHOICES:
        chosen = np.array([press.center_px for press in generalization._chosen(presses, 5, how)])
        assert len(np.unique(chosen, axis=0)) == 5
        away = np.linalg.norm(places[:, None] - chosen, axis=-1)
        farthest[how] = away.min(1).max()
    assert farthest["over the pad"] < farthest["as listed"]


def test_presses_chosen_as_captured_lie_where_a_capture_points(folder):
    presses, _ = generalization._read(str(folder))
    (first,) = generalization._chosen(presses, 1, "as captured")
    middle_px = Coverage(first.size_px, first.mm_per_px).next_px
    away = [np.linalg.norm(np.subtract(press.center_px, middle_px)) for press in presses]
    assert first is presses[int(np.argmin(away))]
    few, more = (generalization._chosen(presses, count, "as captured") for count in (3, 4))
    (added,) = [press for press in more if all(press is not one for one in few)]
    coverage = Coverage(first.size_px, first.mm_per_px)
    for press in few:
        coverage.add(press.center_px)
    left = [press for press in presses if all(press is not one for one in few)]
    away = [np.linalg.norm(np.subtract(press.center_px, coverage.next_px)) for press in left]
    assert added is left[int(np.argmin(away))]


def test_depth_of_presses_held_out_is_off_by_about_what_is_expected(folder, monkeypatch):
    pytest.importorskip("torch")
    from recon.estimators import default_training

    monkeypatch.setattr(generalization, "FOLDS", 2)
    monkeypatch.setattr(default_training, "STEPS", 200)
    monkeypatch.setattr(default_training, "BATCH", 128)
    (row,) = generalization.intervals(str(folder))
    assert row["presses"] == 12 and row["covered"] > 0.8
    assert 0.1 < row["deviations, median press"] < 2


def test_another_seed_teaches_other_networks(folder, monkeypatch, capsys):
    pytest.importorskip("torch")
    from recon.estimators import default_training

    monkeypatch.setattr(default_training, "STEPS", 20)
    monkeypatch.setattr(default_training, "BATCH", 64)
    printed = []
    for seed in ("1", "2", "1"):
        words = ["beyond", "shapes", str(folder), "--estimator", "default", "--seed", seed]
        monkeypatch.setattr(sys, "argv", words)
        generalization.main()
        printed.append(capsys.readouterr().out)
    assert printed[0] == printed[2] != printed[1]
    one, other, again = (
        generalization.fewer(str(folder), ["table"], 4, seed) for seed in (1, 2, 1)
    )
    assert one == again != other
    monkeypatch.setattr(sys, "argv", ["beyond", "intervals", str(folder), "--seed", "1"])
    with pytest.raises(SystemExit, match="2"):
        generalization.main()


def test_lights_that_are_left_out_teach_nothing_and_leave_their_axis_unseen(folder, monkeypatch):
    _, dataset = generalization._read(str(folder))
    assert generalization._lit_by(None, dataset) == dataset
    some = generalization._lit_by("BR", dataset)
    assert lit_channels(some)[0] == "RB" and lit_channels(dataset)[0] == "RGB"
    for lights in ("", "RX"):
        with pytest.raises(WedgeError, match="lights"):
            generalization._lit_by(lights, dataset)
    (every,) = generalization.shapes(str(folder), str(folder), ["table"])
    (one,) = generalization.shapes(str(folder), str(folder), ["table"], lights="R")
    assert one["rmse_mm"] > 1.2 * every["rmse_mm"]
    monkeypatch.setattr(sys, "argv", ["beyond", "fewer", str(folder), "--lights", "R"])
    with pytest.raises(SystemExit, match="2"):
        generalization.main()


def test_the_command_prints_and_keeps_the_rows(folder, tmp_path, monkeypatch, capsys):
    kept = tmp_path / "rows.json"
    arguments = ["beyond", "shapes", str(folder), "--estimator", "table", "--json", str(kept)]
    monkeypatch.setattr(sys, "argv", arguments)
    generalization.main()
    assert "shape cap" in capsys.readouterr().out
    assert json.loads(kept.read_text())["rows"][0]["shape"] == "cap"
    monkeypatch.setattr(sys, "argv", ["beyond", "shapes", str(tmp_path / "none")])
    with pytest.raises(SystemExit, match="2"):
        generalization.main()
    assert "none' is neither a folder" in capsys.readouterr().err
