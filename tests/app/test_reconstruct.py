# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""`wedge reconstruct` says how deep, and writes over neither what it reads nor what it wrote."""

import json
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from recon.calibration import Calibration
from recon.cloud import point_cloud
from recon.estimators import GradientEstimator
from recon.images import read_image, write_image
from recon.pipeline import Reconstructor
from tests.app.commands import run
from tests.recon.fast.units import make_unit, pressed, random_default
from tests.synthetic import LIGHTS_DEG, make_dataset

WITHOUT_NUMBA = "import sys; sys.modules['numba'] = None; from app.__main__ import main; main()"


@pytest.mark.parametrize("way", ["beside itself", "as numbers", "over the blank gel"])
def test_an_image_is_not_written_over(
    way: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    dataset = make_dataset(tmp_path / "set", presses=10)
    unit = tmp_path / "unit"
    assert run("calibrate", dataset.folder, "--estimator", "table", "--out", unit) == 0
    press, blank = dataset.folder / dataset.labels[0].file, dataset.folder / "background.png"
    words: list[object] = ["reconstruct", unit, press, "--background", blank, "--out"]
    words += {
        "beside itself": [dataset.folder],
        "as numbers": [tmp_path / "depth", "--json", press],
        "over the blank gel": [tmp_path / "depth", "--json", blank],
    }[way]
    before = {path.name: path.read_bytes() for path in dataset.folder.iterdir()}
    capsys.readouterr()
    assert run(*words) == 2
    said = capsys.readouterr().err
    assert "is an input and would be overwritten" in said and len(said.splitlines()) == 1
    assert {path.name: path.read_bytes() for path in dataset.folder.iterdir()} == before


@pytest.mark.parametrize(
    ("lights", "status"), [({"R": 90.0, "B": -90.0}, 2), (LIGHTS_DEG, 0)], ids=["two", "three"]
)
def test_a_doubt_and_a_depth_of_one_name_are_refused_where_both_are_written(
    lights: dict[str, float], status: int, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    dataset = make_dataset(tmp_path / "set", presses=8, lights_deg=lights)
    unit = tmp_path / "unit"
    assert run("calibrate", dataset.folder, "--estimator", "table", "--out", unit) == 0
    press = dataset.folder / dataset.labels[0].file
    doubt = shutil.copy(press, tmp_path / f"{press.stem}-doubt.png")
    capsys.readouterr()
    assert run("reconstruct", unit, press, doubt, "--out", tmp_path / "depth") == status
    said = capsys.readouterr().err
    assert ("would be written to press00-doubt.png" in said) == bool(status)
    assert (tmp_path / "depth").exists() != bool(status)


def reconstructed(
    calibration: Calibration, folder: Path, capsys: pytest.CaptureFixture[str]
) -> tuple[dict[str, Any], str]:
    """A press by a unit: its line of the JSON file, and what was printed."""
    calibration.save(folder / "unit")
    write_image(folder / "press.png", pressed(calibration.background, (80, 60)))
    numbers = folder / "numbers.json"
    words = ["reconstruct", folder / "unit", folder / "press.png", "--out", folder / "depth"]
    assert run(*words, "--json", numbers) in (0, None)
    (row,) = json.loads(numbers.read_text())["images"]
    said = capsys.readouterr()
    return row, said.out + said.err


@pytest.mark.parametrize("estimator", [None, random_default()], ids=["mlp", "default"])
def test_the_deepest_point_has_a_deviation_where_the_estimator_knows_one(
    estimator: GradientEstimator | None,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    # Networks of random weights answer with slopes of no surface.
    monkeypatch.setattr("recon.plausible.doubt_word", lambda *_: "")
    calibration = make_unit(estimator=estimator)
    row, said = reconstructed(calibration, tmp_path, capsys)
    sigma_mm = row["deepest_sigma_mm"]
    assert (sigma_mm is None) == (estimator is None) and row["remark"] is None
    if sigma_mm is not None:
        assert f"{row['deepest_mm']:.3f} ± {sigma_mm:.3f}" in said
        result = Reconstructor(calibration)(read_image(tmp_path / "press.png"))
        sigma = point_cloud(result).sigma_mm[result.depth_mm.argmax()]
        assert sigma_mm == pytest.approx(float(sigma), rel=1e-5) and sigma_mm > 0


def test_a_contact_over_both_edges_is_told_of(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("recon.plausible.doubt_word", lambda *_: "")
    monkeypatch.setattr("recon.plausible.is_cut_twice", lambda *_: True)
    lights = {"lights_deg": {"R": 90.0, "B": -90.0}, "missing_axis": "network"}
    unit = make_unit(estimator=random_default(channels="RB"), channels="RB", **lights)
    row, said = reconstructed(unit, tmp_path, capsys)
    assert "press.png: a contact runs over both edges" in said and "cannot be trusted" in said
    assert row["remark"].startswith("a contact runs over") and row["deepest_sigma_mm"] is None


def test_a_depth_that_no_gel_has_is_called_so_and_has_no_deviation(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    row, said = reconstructed(make_unit(estimator=random_default()), tmp_path, capsys)
    assert "press.png: no gel is so deep" in said and "the depth cannot be trusted" in said
    for asked in ("is there no reflection on the gel", "not mirrored", "not swapped?"):
        assert asked in said
    assert row["remark"].startswith("no gel is so deep")
    assert row["deepest_sigma_mm"] is None and "±" not in said


@pytest.mark.parametrize("command", ["reconstruct", "cloud"])
def test_a_plain_install_which_has_no_numba_is_enough(command: str, tmp_path: Path) -> None:
    unit = make_unit(estimator=random_default())
    unit.save(tmp_path / "unit")
    write_image(tmp_path / "press.png", pressed(unit.background, (80, 60)))
    words = [command, tmp_path / "unit", tmp_path / "press.png", "--out", tmp_path / "out"]
    plain = [sys.executable, "-c", WITHOUT_NUMBA, *words]
    done = subprocess.run(plain, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert list((tmp_path / "out").glob("press.*"))
