# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""The command line answers as a shell expects: at once, with a status, and in one sentence."""

import io
import os
import re
import subprocess
import sys
import sysconfig
from pathlib import Path

import pytest

from app import __main__ as command_line
from sensor.errors import WedgeError

ROOT = Path(__file__).resolve().parents[2]
MODULE = (sys.executable, "-P", "-m", "app")
WAYS = {
    "module": MODULE,
    "console script": (str(Path(sysconfig.get_path("scripts")) / "wedge"),),
    "checkout": (str(ROOT / "wedge"),),
}


def run(
    *words: str, way: tuple[str, ...] = MODULE, folder: Path = ROOT
) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [*way, *words],
        cwd=folder,
        env={**os.environ, "COLUMNS": "200"},
        capture_output=True,
        text=True,
        check=False,
    )


@pytest.mark.parametrize("way", WAYS.values(), ids=WAYS)
def test_all_ways_to_start_it_behave_the_same(way: tuple[str, ...], tmp_path: Path) -> None:
    helped = run("--help", way=way, folder=tmp_path)
    assert (helped.returncode, helped.stdout, helped.stderr) == (0, command_line.HELP + "\n", "")
    wrong = run("recontsruct", way=way, folder=tmp_path)
    assert (wrong.returncode, wrong.stdout) == (2, "")
    assert "did you mean `wedge reconstruct`?" in wrong.stderr


def test_a_folder_of_the_caller_shadows_nothing(tmp_path: Path) -> None:
    (tmp_path / "sensor.py").write_text("raise SystemExit('the wrong sensor')")
    assert run(way=WAYS["checkout"], folder=tmp_path).stdout == command_line.HELP + "\n"


def test_help_imports_nothing_heavy() -> None:
    done = subprocess.run(
        [sys.executable, "-P", "-X", "importtime", "-m", "app", "--help"],
        capture_output=True,
        text=True,
        check=True,
    )
    imported = set(re.findall(r"\|\s+(\w+)$", done.stderr, re.MULTILINE))
    assert "sensor" in imported
    assert imported.isdisjoint(
        {"numpy", "scipy", "cv2", "torch", "matplotlib", "tyro", "rich", "PIL"}
    )


@pytest.mark.parametrize("name", command_line.SUBCOMMANDS)
def test_each_subcommand_has_help_of_its_own(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as stopped:
        command_line.main([name, "--help"])
    assert stopped.value.code == 0
    assert f"usage: wedge {name}" in capsys.readouterr().out


def test_each_subcommand_can_be_imported_first() -> None:
    """In whatever order: each in a fork of an interpreter that has imported none."""
    code = """
import importlib, os, sys
from app.__main__ import SUBCOMMANDS
for name in SUBCOMMANDS:
    if not (child := os.fork()):
        try:
            importlib.import_module(f"app.{name}")
        except BaseException as error:
            print(f"app.{name}: {error!r}", flush=True)
        os._exit(0)
    os.waitpid(child, 0)
"""
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=False
    )
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")


def test_an_unknown_option_is_wrong_usage() -> None:
    done = run("bench", "--no-such-option")
    assert done.returncode == 2
    assert "--no-such-option" in done.stderr
    assert "Traceback" not in done.stderr


@pytest.mark.parametrize(
    ("fault", "status", "sentence"),
    [
        (
            WedgeError("labels.csv, line 3: no radius."),
            2,
            "wedge: labels.csv, line 3: no radius.\n",
        ),
        (PermissionError(13, "Permission denied", "unit"), 2, "wedge: unit: Permission denied.\n"),
        (OSError(28, "No space left on device"), 2, "wedge: No space left on device.\n"),
        (KeyboardInterrupt(), 130, ""),
    ],
)
def test_a_fault_is_one_sentence_and_a_status(
    fault: BaseException,
    status: int,
    sentence: str,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    def fail(words: list[str]) -> int:
        raise fault

    monkeypatch.setattr(command_line, "_dispatch", fail)
    with pytest.raises(SystemExit) as stopped:
        command_line.main([])
    assert (stopped.value.code, capsys.readouterr().err) == (status, sentence)


def test_a_bug_is_not_disguised_as_bad_input(monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(words: list[str]) -> int:
        raise IndexError

    monkeypatch.setattr(command_line, "_dispatch", fail)
    with pytest.raises(IndexError):
        command_line.main([])


@pytest.mark.skipif(
    not Path("/dev/full").exists(), reason="only Linux has a disk that is always full"
)
def test_a_full_disk_is_one_sentence() -> None:
    with Path("/dev/full").open("w") as full:
        done = subprocess.run(
            [*MODULE, "--help"], stdout=full, stderr=subprocess.PIPE, text=True, check=False
        )
    assert (done.returncode, done.stderr) == (2, "wedge: No space left on device.\n")


def test_a_reader_who_leaves_is_no_error() -> None:
    reader, writer = os.pipe()
    os.close(reader)
    with os.fdopen(writer, "w") as pipe:
        done = subprocess.run(
            [*MODULE, "--help"], stdout=pipe, stderr=subprocess.PIPE, text=True, check=False
        )
    assert (done.returncode, done.stderr) == (0, "")


@pytest.mark.parametrize(("encoding", "degree"), [("ascii", "\\xb0"), ("latin-1", "°")])
def test_what_the_terminal_cannot_show_is_spelled_out(
    encoding: str, degree: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    terminal = io.TextIOWrapper(shown := io.BytesIO(), encoding=encoding)
    monkeypatch.setattr(sys, "stdout", terminal)
    with pytest.raises(SystemExit) as stopped:
        command_line.main(["data", "list"])
    assert stopped.value.code == 0
    said = shown.getvalue().decode(encoding)
    assert f"three lights 120{degree} apart" in said
    assert "\\u2013" in said  # a dash, which neither has


def test_output_that_is_no_terminal_s_is_left_as_it_is(monkeypatch: pytest.MonkeyPatch) -> None:
    for put in (io.StringIO(), None):  # as from a notebook, and where stdout is closed
        monkeypatch.setattr(sys, "stdout", put)
        with pytest.raises(SystemExit) as stopped:
            command_line.main(["--help"])
        assert stopped.value.code == 0
