# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""`wedge fabricate` says no with the right status, and leaves a whole folder or none."""

import json
import sys
from pathlib import Path

import pytest

pytest.importorskip("cadquery", reason="needs the extra cad")

import app.fabricate
import cad.build
from app._fabricate import MissingExtraError
from app.fabricate import main
from cad.build import Model
from cad.checks import Result
from sensor.design import FINGER
from sensor.errors import WedgeError


def test_a_refused_design_leaves_nothing(tmp_path: Path) -> None:
    design = tmp_path / "blind.toml"
    design.write_text('base = "finger"\n[camera]\ndiagonal_view_deg = 60.0\n')
    with pytest.raises(WedgeError, match=r"^camera.diagonal_view_deg = 60 .* at least 10"):
        main(design=str(design), out=tmp_path / "out")
    assert [path.name for path in tmp_path.iterdir()] == ["blind.toml"]


def test_a_folder_that_is_not_empty_is_kept(tmp_path: Path) -> None:
    (tmp_path / "mine.txt").write_text("mine")
    with pytest.raises(WedgeError, match="not empty"):
        main(design="finger", out=tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == ["mine.txt"]


@pytest.mark.parametrize("figures", ["", "out", "a_file/figures.json", "out/manifest.json"])
def test_figures_that_could_not_be_written_are_refused_before_anything_is_built(
    figures: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(app.fabricate, "fabricate", lambda *_: pytest.fail("it was built"))
    (tmp_path / "a_file").write_text("mine")
    with pytest.raises(WedgeError, match=r"cannot be written"):
        main(design="finger", out=tmp_path / "out", json=tmp_path / figures)
    assert [path.name for path in tmp_path.iterdir()] == ["a_file"]


def test_without_the_solid_modeller_the_extra_is_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "cadquery", None)
    for module in [name for name in sys.modules if name.split(".")[0] == "cad"]:
        monkeypatch.delitem(sys.modules, module)
    with pytest.raises(MissingExtraError, match=r"needs cadquery: .*\[cad\]"):
        main(design="finger", out=tmp_path / "out")
    assert not any(tmp_path.iterdir())


@pytest.fixture(scope="module")
def finger() -> Model:
    return cad.build.model(FINGER)


@pytest.mark.parametrize(("value", "status"), [(0.9, 0), (0.7, 1)])
def test_a_failed_check_fails_the_command(
    value: float,
    status: int,
    finger: Model,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    result = Result("wall", "case", value, "mm", 0.8, "at least")
    monkeypatch.setattr(cad.build, "run_checks", lambda built: [result])
    monkeypatch.setattr(cad.build, "model", lambda design: finger)
    monkeypatch.setattr(cad.build, "write_files", lambda *_: None)
    monkeypatch.setattr(cad.build, "write_pictures", lambda *_: lambda: None)
    figures = tmp_path / "figures.json"
    assert main(design="finger", out=tmp_path / "out", json=figures) == status
    assert f"1 checks, {status} failed" in capsys.readouterr().out
    (check,) = json.loads(figures.read_text())["checks"]
    assert check["passed"] == (status == 0)
    assert (tmp_path / "out" / "manifest.json").is_file()
