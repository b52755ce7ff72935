# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Commands that measure on datasets by name end with a sentence where one cannot be used."""

from dataclasses import replace
from importlib import import_module
from pathlib import Path

import pytest

from tests.synthetic import make_dataset
from validation import datasets

SET = "SET"
COMMANDS = (
    "validation.beyond intervals SET",
    "validation.beyond shapes SET",
    "validation.beyond fewer SET",
    "validation.beyond other SET SET",
    "validation.circles SET",
    "validation.label_noise SET",
    "validation.rims SET",
    "benchmarks.agreement SET",
    "benchmarks.few_lights SET",
    "benchmarks.rendered_pixels --sensor one SET SET --out unwritten",
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
    assert isinstance(left.value.code, str)  # which Python prints on stderr, with status 1
    assert "\n" not in left.value.code
    printed, told = capfd.readouterr()
    assert told == ""
    return left.value.code, printed


@pytest.mark.parametrize("command", [*COMMANDS, DOUBT])
def test_an_unknown_set_is_one_sentence(
    command: str, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    said, printed = refused(command.replace(SET, "twin-standart"), monkeypatch, capfd)
    assert "twin-standart is neither a folder nor a known dataset" in said
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


@pytest.mark.parametrize("name", ["circles", "scale", "untouched"])
def test_where_no_set_is_one_sentence_says_how_to_get_one(
    name: str, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    absent = [replace(known, find=lambda: None) for known in datasets.DATASETS]
    monkeypatch.setattr(datasets, "DATASETS", absent)
    said, printed = refused(f"validation.{name}", monkeypatch, capfd)
    assert "on this machine: " in said
    assert printed == ""
