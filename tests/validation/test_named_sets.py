# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Commands that measure on datasets by name end with a sentence where one cannot be used."""

import errno
from dataclasses import replace
from importlib import import_module
from pathlib import Path

import numpy as np
import pytest

from tests.sensor.test_files import failing
from tests.synthetic import make_dataset, make_deeper_set, make_rendered_set
from validation import datasets

SET = "SET"
COMMANDS = (
    "validation.generalization intervals SET",
    "validation.generalization shapes SET",
    "validation.generalization fewer SET",
    "validation.generalization other SET SET",
    "validation.circles SET",
    "validation.label_noise SET",
    "validation.markers SET",
    "validation.rims SET",
    "benchmarks.agreement SET",
    "benchmarks.contact --estimator table --twin SET standard",
    "benchmarks.cut_contacts unit SET",
    "benchmarks.dots SET",
    "benchmarks.few_lights SET",
    "benchmarks.fixed_point SET",
    "benchmarks.light_and_gel SET",
    "benchmarks.rendered_pixels --sensor one SET SET SET --out unwritten",
)
DOUBT = "benchmarks.doubt --sensor SET SET"  # reads a set after minutes, and looks it up before


def refused(
    command: str, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> tuple[str, str]:
    """What a command that must fail says, and prints before."""
    module, *words = command.split()
    monkeypatch.setattr("sys.argv", [module, *words])
    with pytest.raises(SystemExit) as left:
        import_module(module).main()
    assert left.value.code == 2
    printed, told = capfd.readouterr()
    assert told.startswith(f"python -m {module}: ") and told.count("\n") == 1
    return told.removeprefix(f"python -m {module}: ").rstrip("\n"), printed


@pytest.mark.parametrize("command", [*COMMANDS, DOUBT])
def test_an_unknown_set_is_one_sentence(
    command: str, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    said, printed = refused(command.replace(SET, "twin-standart"), monkeypatch, capfd)
    assert "'twin-standart' is neither a folder nor a known dataset" in said
    assert printed == "" or command == DOUBT  # its table's head


@pytest.fixture(scope="module")
def damaged(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = make_dataset(tmp_path_factory.mktemp("damaged") / "set", presses=4).folder
    press = sorted(folder.glob("press*.png"))[0]
    press.write_bytes(press.read_bytes()[:200])
    return folder


@pytest.mark.parametrize("command", COMMANDS)
def test_a_set_that_cannot_be_read_is_one_sentence(
    command: str, damaged: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    said, printed = refused(command.replace(SET, str(damaged)), monkeypatch, capfd)
    assert f"{damaged}/press00.png cannot be decoded" in said
    assert printed == ""


@pytest.fixture(scope="module")
def untrue(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A set whose shape has an archive of depths where an array should be; beside it deep balls."""
    here = tmp_path_factory.mktemp("untrue")
    make_deeper_set(here / "deep", presses=4)
    folder = make_rendered_set(here / "set", presses=4).folder
    (folder / "shape.jpg").write_bytes((folder / "press00.jpg").read_bytes())
    with (folder / "truth" / "shape.npy").open("wb") as stream:
        np.savez(stream, np.load(folder / "truth" / "press00.npy"))
    return folder


@pytest.mark.parametrize(
    "command",
    [
        "benchmarks.axis_question",
        "benchmarks.few_lights SET --estimator table",
        "benchmarks.rendered_pixels --sensor one SET DEEP SET --out unwritten",
        "validation.generalization shapes SET --estimator table",
    ],
)
def test_a_damaged_truth_is_one_sentence(
    command: str, untrue: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("benchmarks.axis_question.on_bench_presses", lambda: ())
    monkeypatch.setattr("benchmarks.axis_question.TWINS", (untrue,))
    deep = str(untrue.with_name("deep"))
    said, _ = refused(command.replace(SET, str(untrue)).replace("DEEP", deep), monkeypatch, capfd)
    assert said.startswith(f"{untrue}/truth/shape.npy is not a whole numpy array")


@pytest.mark.parametrize(
    "name",
    [
        "benchmarks.bound",
        "benchmarks.dents",
        "benchmarks.pose_doubt",
        "benchmarks.rolling",
        "benchmarks.soak",
        "validation.markers",
        "validation.scale",
    ],
)
def test_programs_say_what_they_are_and_take_no_word_for_another(
    name: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    for words, status in ((["--help"], 0), (["1000", "two"], 2)):
        monkeypatch.setattr("sys.argv", [name, *words])
        with pytest.raises(SystemExit) as left:
            import_module(name).main()
        assert left.value.code == status
        printed = capsys.readouterr()
        assert f"usage: python -m {name}" in printed.out + printed.err


WRITING = (
    "benchmarks.axis_question --json",
    "benchmarks.axis_training --json",
    "benchmarks.contact --json",
    "benchmarks.doubt --json",
    "benchmarks.few_lights SET --json",
    "benchmarks.rendered_pixels --sensor one SET SET SET --out",
    "validation.generalization shapes SET --json",
    "validation.circles SET --json",
    "validation.label_noise SET --json",
    "validation.untouched --json",
)


@pytest.mark.parametrize("command", WRITING)
def test_what_cannot_be_written_is_said_before_the_work(
    command: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(datasets, "DATASETS", [])  # whoever begins ends with another sentence
    if command.startswith("benchmarks.axis_training"):
        pytest.importorskip("torch")
        monkeypatch.setattr("benchmarks.axis_training.VARIANTS", {})
    (tmp_path / "taken").touch()
    for place in (tmp_path / "taken" / "numbers", tmp_path):
        said, printed = refused(f"{command} {place}", monkeypatch, capfd)
        assert said.startswith(f"{place} cannot be written: ")
        assert printed == ""


def test_a_disk_that_is_full_after_the_trainings_is_one_sentence(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    pytest.importorskip("torch")
    from benchmarks.axis_training import VARIANTS, Trained

    def trained(name: str, steps: int) -> Trained:
        return Trained(
            name=name, steps=steps, parameters=1, milliseconds=1.0, minutes=1.0, share_of_zero={}
        )

    monkeypatch.setattr("benchmarks.axis_training.trained", trained)
    monkeypatch.setattr("os.fsync", failing(errno.ENOSPC))
    path = tmp_path / "numbers.json"
    said, printed = refused(f"benchmarks.axis_training --json {path}", monkeypatch, capfd)
    assert said == f"{path} cannot be written: No space left on device."
    assert all(f"| {name} |" in printed for name in VARIANTS)


@pytest.mark.parametrize("name", ["circles", "scale", "untouched"])
def test_where_no_set_is_one_sentence_says_how_to_get_one(
    name: str, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    absent = [replace(known, find=lambda: None) for known in datasets.DATASETS]
    monkeypatch.setattr(datasets, "DATASETS", absent)
    said, printed = refused(f"validation.{name}", monkeypatch, capfd)
    assert "on this machine: " in said
    assert printed == ""
