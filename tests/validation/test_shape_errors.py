# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""`wedge evaluate` on frames without a circle, whose truth is off by a known amount."""

import json
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy import stats

from recon.calibration import load_calibration
from recon.images import read_frame
from recon.pipeline import Reconstructor
from recon.presses import read_background
from sensor.dataset import Dataset, read_dataset, write_labels
from tests.app.commands import run
from tests.synthetic import KEYSTONE_PX, make_dataset
from tests.validation.sensors import change_frames, dotted_set, unit_of
from validation.depth import truth_file

OFF_MM = 0.01, 0.02, 0.06
DENT_MM = 0.08
"""Deeper than this is the dent: what is left of it by any of ``OFF_MM`` is over 5 % of it all."""


def shape_set(dataset: Dataset, unit: Path, labelled: int = 0) -> Path:
    """Keep the first circles; what ``unit`` finds of later frames, less ``OFF_MM``, is the truth.

    Of the last frame it is not known.
    """
    reconstruct = Reconstructor(load_calibration(unit), read_background(dataset))
    (dataset.folder / "truth").mkdir()
    for label, off_mm in zip(dataset.labels[labelled:], OFF_MM, strict=False):
        found_mm = reconstruct(read_frame(dataset.folder, label.file)).depth_mm
        truth_mm = np.where(found_mm > DENT_MM, found_mm - np.float32(off_mm), 0)
        np.save(truth_file(dataset.folder, label.file), truth_mm)
    write_labels(dataset.folder / "labels.csv", dataset.labels[:labelled])
    return dataset.folder


@pytest.fixture(scope="module")
def unit(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("taught")
    unit_of(make_dataset(folder / "set", presses=8)).save(folder / "unit")
    return folder / "unit"


@pytest.fixture(scope="module")
def shown(unit: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Three shapes and a frame of unknown depth."""
    return shape_set(make_dataset(tmp_path_factory.mktemp("shown"), presses=4, seed=1), unit)


@pytest.fixture
def other(shown: Path, tmp_path: Path) -> Path:
    """A copy to damage."""
    return shutil.copytree(shown, tmp_path / "other")


def judged(unit: Path, *folders: Path, out: Path, status: int = 0) -> dict:
    assert run("evaluate", unit, *folders, "--json", out) == status
    return json.loads(out.read_text())


@pytest.mark.parametrize("kind", ["as taught", "in an archive", "in other light", "with dots"])
def test_a_truth_that_is_off_by_so_much_is_the_error(kind: str, unit: Path, tmp_path: Path) -> None:
    if kind == "with dots":
        unit = tmp_path / "unit"
        unit_of(dotted_set(tmp_path / "taught")).save(unit)
        dataset = dotted_set(tmp_path / "set", seed=1, presses=4)
    else:
        archive = kind == "in an archive"
        dataset = make_dataset(tmp_path / "set", presses=4, seed=1, in_npz=archive)
    if kind == "in other light":
        change_frames(dataset, lambda frame, _: frame * [0.7, 1, 1])
    (found,) = judged(unit, shape_set(dataset, unit), out=tmp_path / "n.json")["shapes"]
    assert [press["file"] for press in found["presses"]] == [x.file for x in dataset.labels[:3]]
    for press, off_mm in zip(found["presses"], OFF_MM, strict=True):
        peak_mm = press["peak_mm"] - press["peak_truth_mm"]
        assert (press["rmse_mm"], press["bias_mm"], peak_mm) == pytest.approx(
            (off_mm,) * 3, abs=1e-5
        )
    assert found["n_presses"] == 3
    means = (np.mean(OFF_MM),) * 2
    assert (found["rmse_mm"], found["bias_mm"]) == pytest.approx(means, abs=1e-5)
    bounds = stats.t.interval(0.95, 2, np.mean(OFF_MM), stats.sem(OFF_MM))
    assert found["ci95"]["bias_mm"] == pytest.approx(bounds, abs=1e-4)
    low, high = found["ci95"]["rmse_mm"]
    assert 0 < low < found["rmse_mm"] < high
    (left_out,) = found["left_out"]
    assert left_out["file"] == dataset.labels[3].file


def test_every_shape_and_the_mean_are_printed(
    unit: Path, shown: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run("evaluate", unit, shown) == 0
    printed = capsys.readouterr()
    rows = [line.split() for line in printed.out.splitlines() if ".png" in line]
    assert [row[0] for row in rows] == ["press00.png", "press01.png", "press02.png"]
    assert [row[2] for row in rows] == [f"{off_mm:+.3f}" for off_mm in OFF_MM]
    assert "mean over 3 presses against the truth file: RMSE 0.030 mm [" in printed.out
    assert "bias +0.030 mm [" in printed.out
    assert "left out 1 press:\n  press03.png: " in printed.err


def test_presses_are_told_as_before_and_shapes_after_them(
    unit: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = shape_set(make_dataset(tmp_path / "set", presses=7, seed=1), unit, labelled=3)
    both = judged(unit, folder, out=tmp_path / "both.json")
    told = capsys.readouterr()
    shutil.rmtree(folder / "truth")
    presses = judged(unit, folder, out=tmp_path / "presses.json")
    before = capsys.readouterr()
    assert both.pop("shapes")[0]["n_presses"] == 3
    assert both == presses and presses["presses"]["test"] == 3
    assert told.out.startswith(before.out) and before.out in told.out
    assert "press03.png" in told.out and "press03.png" not in before.out


def test_a_set_of_neither_is_refused_as_before(
    unit: Path, other: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    shutil.rmtree(other / "truth")
    assert run("evaluate", unit, other) == 2
    assert "names no press that can be used (0 labelled): press the ball" in capsys.readouterr().err


@pytest.mark.parametrize("damage", ["cut", "another size", "no frame"])
def test_a_damaged_truth_is_refused_in_one_sentence(
    damage: str, unit: Path, other: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    truth, numbers = other / "truth" / "press01.npy", other / "n.json"
    if damage == "cut":
        truth.write_bytes(truth.read_bytes()[:1000])
    elif damage == "another size":
        np.save(truth, np.ones((3, 4), np.float32))
    else:
        (other / "press01.png").unlink()
    assert run("evaluate", unit, other, "--json", numbers) == 2
    printed = capsys.readouterr()
    (said,) = [line for line in printed.err.splitlines() if line.startswith("wedge: ")]
    assert str(truth) in said and not printed.out and not numbers.exists()


def test_sets_of_presses_and_of_shapes_stand_beside_each_other(
    unit: Path, shown: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    presses = make_dataset(tmp_path / "presses", presses=6, corners_px=KEYSTONE_PX)
    askew = unit_of(presses)
    replace(askew, card=replace(askew.card, serial="askew")).save(tmp_path / "unit")
    page, numbers = tmp_path / "page", tmp_path / "n.json"
    both = [unit, tmp_path / "unit", shown, presses.folder]
    # Each unit fits one set: that neither fits the other's is no failure.
    assert run("evaluate", *both, "--json", numbers, "--out", page) == 0
    found, printed = json.loads(numbers.read_text()), capsys.readouterr()
    assert [(x["unit"], x["n_presses"]) for x in found["shapes"]] == [("wedge-007", 3)]
    assert [x["unit"] for x in found["evaluations"]] == ["askew"]
    assert [x["unit"] for x in found["left_out"]] == ["wedge-007", "askew"]
    assert f"synthetic ({shown})" in printed.out and " 0.03 " in printed.out
    assert "press02.png" in (page / "index.html").read_text()
    assert run("evaluate", unit, shown, presses.folder) == 2


def test_other_lights_are_said_of_shapes_too(
    unit: Path, other: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    card = other / "dataset.toml"
    text = card.read_text()
    assert "R = 90.0" in text
    card.write_text(text.replace("R = 90.0", "R = 20.0"))
    assert read_dataset(other).card.lights_deg["R"] == 20
    assert run("evaluate", unit, other) == 0
    assert "by lights_deg, the data set has no light of R" in capsys.readouterr().err
