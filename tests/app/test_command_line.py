# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""The command line answers as a shell expects: at once, with a status, and in one sentence."""

import os
import re
import shutil
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
def test_each_subcommand_has_help_of_its_own(name: str) -> None:
    done = run(name, "--help")
    assert done.returncode == 0, done.stderr
    assert f"usage: wedge {name}" in done.stdout


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


@pytest.fixture
def checkout_without_python(tmp_path: Path) -> Path:
    """A new checkout's script, and bin/ as the only folder on the search path."""
    for path in (Path("wedge"), Path("requirements/lock.txt")):
        (tmp_path / path).parent.mkdir(exist_ok=True)
        shutil.copy(ROOT / path, tmp_path / path)
    (tmp_path / "bin").mkdir()
    for tool in ("sh", "cat", "cksum", "dirname", "uname"):
        (tmp_path / "bin" / tool).symlink_to(shutil.which(tool) or "")
    return tmp_path


def set_up(checkout: Path, **environment: str) -> tuple[int, str]:
    done = subprocess.run(
        [checkout / "wedge"],
        env={"PATH": str(checkout / "bin"), **environment},
        capture_output=True,
        text=True,
        check=False,
    )
    return done.returncode, done.stderr


def test_set_up_without_python_says_which_to_install(checkout_without_python: Path) -> None:
    sentence = "wedge: no Python 3.11 to 3.14 was found: install one and run this again.\n"
    assert set_up(checkout_without_python) == (2, sentence)


def test_set_up_without_venv_says_what_to_install(checkout_without_python: Path) -> None:
    python = checkout_without_python / "bin" / "python3.12"
    python.write_text('#!/bin/sh\ncase "$2" in *venv*) exit 1 ;; esac\n')
    python.chmod(0o755)
    status, sentence = set_up(checkout_without_python)
    assert status == 2
    assert sentence.endswith("(on Debian: apt install python3.12-venv).\n")


def test_set_up_never_empties_what_a_link_leads_to(checkout_without_python: Path) -> None:
    others = checkout_without_python / "of-others"
    (others / "lib").mkdir(parents=True)
    (checkout_without_python / ".venv").symlink_to(others)
    python = checkout_without_python / "bin" / "python3.12"
    python.write_text('#!/bin/sh\ncase "$*" in *--clear*) "$0-rm" -r "$4/lib" ;; esac\n')
    python.chmod(0o755)
    (python.parent / "python3.12-rm").symlink_to(shutil.which("rm") or "")
    status, sentence = set_up(checkout_without_python)
    assert status == 2
    assert ".venv is a link" in sentence
    assert (others / "lib").is_dir()


INSTALLERS = """#!/bin/sh
[ "$2" != venv ] || { mkdir -p "$4/bin" && cp "$0" "$4/bin/python"; }
case "$*" in
  *"-m pip"*uv.txt) [ "$UV" != missing ] && grep -q '^uv==' "${*##* }" ;;
  *"-m uv"*lock.txt) echo uv >>"$TRIES"; [ "$UV" = works ] ;;
  *"-m pip"*lock.txt) echo pip >>"$TRIES"; echo 'ERROR: the server is away'
    [ "$(grep -c pip "$TRIES")" -gt "$FAILURES" ] ;;
  *"-m app"*) echo 'the command ran' >&2 ;;
esac
"""


@pytest.fixture
def checkout_with_installers(checkout_without_python: Path) -> Path:
    """The same with a Python whose uv and pip note that they were asked, and fail where told."""
    folder = checkout_without_python / "bin"
    for tool in ("cp", "grep", "mkdir", "rm", "sed", "tail"):
        (folder / tool).symlink_to(shutil.which(tool) or "")
    for name, script in (("python3.12", INSTALLERS), ("sleep", "#!/bin/sh\n")):
        (folder / name).write_text(script)
        (folder / name).chmod(0o755)
    return checkout_without_python


@pytest.mark.parametrize(
    ("uv", "tries"), [("works", ["uv"]), ("fails", ["uv", "pip"]), ("missing", ["pip"])]
)
def test_what_uv_cannot_install_pip_does(
    checkout_with_installers: Path, uv: str, tries: list[str]
) -> None:
    noted = checkout_with_installers / "tries"
    done, said = set_up(checkout_with_installers, TRIES=str(noted), UV=uv, FAILURES="0")
    assert (done, noted.read_text().split()) == (0, tries)
    assert "the command ran" in said


@pytest.mark.parametrize(("failures", "status"), [(0, 0), (2, 0), (3, 2)])
def test_set_up_outlasts_a_server_that_is_away_for_a_moment(
    checkout_with_installers: Path, failures: int, status: int
) -> None:
    tries = checkout_with_installers / "tries"
    environment = {"TRIES": str(tries), "UV": "missing", "FAILURES": str(failures)}
    done, said = set_up(checkout_with_installers, **environment)
    assert done == status
    assert len(tries.read_text().splitlines()) == min(failures + 1, 3)
    assert ("the command ran" in said) == (status == 0)
    assert ("ERROR: the server is away\nwedge: the locked" in said) == (status == 2)
