# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""What is wrong with the words of a command line is one sentence, for every subcommand."""

import importlib
import inspect
import re
from itertools import pairwise
from pathlib import Path

import pytest

from app import __main__ as command_line
from app._words import in_a_sentence, understood
from sensor.errors import WedgeError


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        ("calibrate", "`wedge calibrate` needs DATASET and --out DIR."),
        ("calibrate x", "`wedge calibrate` needs --out DIR."),
        ("calibrate x y --out u", "`wedge calibrate` does not know y."),
        (
            "calibrate x --bal 3 --out u",
            "`wedge calibrate` does not know --bal, 3: did you mean --ball-radius-mm?",
        ),
        (
            "calibrate x --ball-radius-mm 2,42 --out u",
            "--ball-radius-mm 2,42 is not a number, such as 2.42.",
        ),
        ("track u v --out o --frames 1.5", "--frames 1.5 is not a whole number."),
        (
            f"track u v --out o --begin {'long' * 40}",
            f"--begin {'long' * 40} is not a whole number.",
        ),
        ("track u v --out o --tracker me", "--tracker me is not one of joint, gicp, plane."),
        ("table x --seed -1", "--seed -1 is not a whole number from 0 to 9223372036854775807."),
        ("track u v --out o --frames", "--frames needs a value."),
        ("data import x --pad-size-mm 1 b", "--pad-size-mm 1 b is not 2 numbers."),
        ("data import x --pad-size-mm 1", "--pad-size-mm 1 is not 2 numbers."),
        ("data import x --pad-size-mm", "--pad-size-mm needs 2 numbers."),
        ("data lst", "action lst is not one of list, path, import."),
    ],
)
@pytest.mark.parametrize("columns", ["40", "200", None])
def test_a_wrong_word_is_one_sentence(
    words: str,
    sentence: str,
    columns: str | None,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    if columns is None:
        monkeypatch.delenv("COLUMNS", raising=False)
    else:
        monkeypatch.setenv("COLUMNS", columns)
    with pytest.raises(SystemExit) as stop:
        command_line.main(words.split())
    name = f"wedge {words.split()[0]}"
    told = (2, ("", f"wedge: {sentence} `{name} --help` explains.\n"))
    assert (stop.value.code, capsys.readouterr()) == told


@pytest.mark.parametrize("name", sorted({*command_line.SUBCOMMANDS} - {"test"}))
@pytest.mark.parametrize("word", ["--no-such-option", "--json"])
def test_every_subcommand_says_it_in_a_line(
    name: str, word: str, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as stop:
        command_line.main([name, word])
    out, err = capsys.readouterr()
    assert (stop.value.code, out, err.count("\n")) == (2, "", 1)
    assert err.startswith("wedge: ") and err.endswith(f"`wedge {name} --help` explains.\n")
    assert word in err or "needs" in err


def example(place: str, *, count: int = 1, share: float | None = None) -> tuple[object, ...]:
    """A subcommand.

    Args:
        place: where.
        count: how many.
        share: how much.
    """
    return place, count, share


def test_right_words_become_parameters_before_anything_runs() -> None:
    call = understood(example, "wedge example", ["--place", "here", "--count", "3"])
    assert call() == ("here", 3, None)
    assert inspect.signature(example).parameters.keys() == {"place", "count", "share"}


@pytest.mark.parametrize("second", ["--unit v", "--unit=v"])
@pytest.mark.parametrize("name", ["live", "record"])
def test_no_value_of_several_is_dropped_unsaid(name: str, second: str) -> None:
    command = importlib.import_module(f"app.{name}").main
    out = ["--out", "x.mcap"] * (name == "record")
    call = understood(command, f"wedge {name}", ["a", "b", *out, "--unit", "u", "v"])
    assert [*map(str, call.keywords["unit"])] == ["u", "v"]  # type: ignore[attr-defined]
    with pytest.raises(WedgeError, match="--unit is given again: name all values behind one"):
        understood(command, f"wedge {name}", ["a", "b", *out, "--unit", "u", *second.split()])


def test_what_the_subcommand_itself_says_is_not_taken_for_a_wrong_word() -> None:
    def stops(place: str) -> None:
        raise SystemExit(7)

    with pytest.raises(SystemExit, match="7"):
        understood(stops, "wedge stops", ["--place", "here"])()


def test_help_goes_where_help_belongs(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as stop:
        understood(example, "wedge example", ["--help"])
    out, err = capsys.readouterr()
    assert not stop.value.code and err == "" and "how many" in out


def test_a_complaint_of_no_known_kind_is_told_as_it_is() -> None:
    assert (
        in_a_sentence("╭─ New ──╮\n│ Some    \n│  words.│\n╰────────╯", "wedge x") == "Some words."
    )
    assert in_a_sentence("no box", "wedge x") == "no box"
    with pytest.raises(WedgeError, match="explains"):
        understood(example, "wedge example", [])


@pytest.mark.parametrize("name", sorted({*command_line.SUBCOMMANDS} - {"test"}))
def test_no_help_breaks_a_line_amid_a_sentence(
    name: str, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "3000")
    with pytest.raises(SystemExit):
        command_line.main([name, "--help"])
    lines = [line.strip("│╭╮╰╯─ ") for line in capsys.readouterr().out.splitlines()]
    description = inspect.getdoc(importlib.import_module(f"app.{name}").main) or ""
    about, _, arguments = description.partition("\n\nArgs:\n")
    assert all(line or after for line, after in pairwise(lines))
    for paragraph in about.split("\n\n"):
        assert " ".join(paragraph.split()) in lines
    assert name == "bench" or any(line.startswith(f"Example: wedge {name} ") for line in lines)
    for entry in re.split(r"\n {4}(?=\w)", arguments.strip()):
        words = " ".join(entry.partition(": ")[2].split())
        assert any(words in line for line in lines)


def helps(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> dict[str, str]:
    """What each subcommand says of its parameters, whatever the terminal draws around it."""
    monkeypatch.setenv("COLUMNS", "3000")
    found = {}
    for name in command_line.SUBCOMMANDS:
        with pytest.raises(SystemExit):
            command_line.main([name, "--help"])
        printed = capsys.readouterr().out
        found[name] = "".join(re.findall(r"^\W*?((?:--)?\w.*\n)", printed, re.MULTILINE))
    return found


def test_no_help_names_a_default_that_is_none(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    leaked = re.compile(r"\bNone\b|\(default: (?:False|'')?\)|^--\S+ (?:STR|PATH)\b", re.MULTILINE)
    found = {name: leaked.findall(text) for name, text in helps(capsys, monkeypatch).items()}
    assert found == {name: [] for name in command_line.SUBCOMMANDS}


def test_what_two_subcommands_take_is_called_alike(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    values: dict[str, set[str]] = {}
    for text in helps(capsys, monkeypatch).values():
        for option, value in re.findall(r"^(--[\w-]+) (\S+)", text, re.MULTILINE):
            values.setdefault(option, set()).add(value.removesuffix("..."))
    several = {option: found for option, found in values.items() if len(found) > 1}
    assert several == {"--out": {"DIR", "FILE.mcap"}}


def test_none_is_a_name_like_any_other() -> None:
    def folder(out: Path | None = None) -> Path | None:
        """A folder."""
        return out

    assert understood(folder, "wedge folder", ["--out", "None"])() == Path("None")
    assert understood(folder, "wedge folder", [])() is None
