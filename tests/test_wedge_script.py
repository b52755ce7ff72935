# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""`./wedge` sets up its own checkout and empties nobody else's folder.

The script is the real one, run by the real shell; Python and what tells the system are played by
scripts, so that nothing is fetched.
"""

import shutil
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent
PYTHON = """#!/bin/sh
case $* in
  "-m venv "*) mkdir -p "$3/bin" && cp "$0" "$3/bin/python" ;;
  *"-m app"*) echo "ran $0 $*" ;;
esac
"""
KILLED = """#!/bin/sh
case $* in "-m venv "*) mkdir -p "$3/bin" && exit 1 ;; esac
"""
INSTALLERS = """#!/bin/sh
case $* in
  "-m venv "*) mkdir -p "$3/bin" && cp "$0" "$3/bin/python" ;;
  *"-m pip"*uv.txt) [ "$UV" != missing ] && grep -q '^uv==' "${*##* }" ;;
  *"-m uv"*lock.txt) echo uv >>"$TRIES"; [ "$UV" = works ] ;;
  *"-m pip"*lock.txt) echo pip >>"$TRIES"; echo 'ERROR: the server is away'
    [ "$(grep -c pip "$TRIES")" -gt "$FAILURES" ] ;;
  *"-m app"*) echo "ran $0 $*" ;;
esac
"""
"""Its uv and pip note that they were asked, and fail where told."""
TOOLS = "cat cksum cp dirname find grep ls mkdir readlink rm sed sh tail".split()
HELP = "-P -m app --help"


class Checkout:
    """A new checkout's script and lock, and all programs that it finds."""

    def __init__(self, folder: Path) -> None:
        self.root, self.programs = folder / "checkout", folder / "programs"
        for path in (Path("wedge"), Path("requirements/lock.txt")):
            (self.root / path).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(ROOT / path, self.root / path)
        self.programs.mkdir()
        for tool in TOOLS:
            (self.programs / tool).symlink_to(shutil.which(tool) or "")
        self.plays("sleep", "#!/bin/sh\n")
        self.runs_on("Linux", "x86_64", "glibc 2.31")

    def plays(self, name: str, script: str) -> None:
        (self.programs / name).write_text(script)
        (self.programs / name).chmod(0o755)

    def runs_on(self, system: str, machine: str, version: str) -> None:
        self.plays("uname", f'#!/bin/sh\n[ "$1" = -s ] && echo {system} || echo {system} {machine}')
        told = f"#!/bin/sh\necho {version}" if version else "#!/bin/sh\nexit 1"
        self.plays("getconf", told)
        self.plays("sw_vers", told)

    def run(
        self, script: Path | str = "./wedge", folder: Path | None = None, **environment: str
    ) -> subprocess.CompletedProcess[str]:
        return subprocess.run(
            [script, "--help"],
            cwd=folder or self.root,
            env={"PATH": str(self.programs), **environment},
            capture_output=True,
            text=True,
            check=False,
        )


@pytest.fixture
def bare(tmp_path: Path) -> Checkout:
    """Where no Python is."""
    return Checkout(tmp_path)


@pytest.fixture
def checkout(bare: Checkout) -> Checkout:
    bare.plays("python3.14", PYTHON)
    return bare


def environment(folder: Path) -> Path:
    """Somebody's own, with something to lose."""
    kept = folder / ".venv" / "lib" / "kept.py"
    kept.parent.mkdir(parents=True)
    kept.write_text("theirs")
    return kept


def test_without_python_it_says_which_to_install(bare: Checkout) -> None:
    done = bare.run()
    sentence = "wedge: no Python 3.11 to 3.14 was found: install one and run this again.\n"
    assert (done.returncode, done.stderr) == (2, sentence)


def test_without_venv_it_says_what_to_install(bare: Checkout) -> None:
    bare.plays("python3.12", '#!/bin/sh\ncase "$2" in *venv*) exit 1 ;; esac\n')
    done = bare.run()
    assert done.returncode == 2
    assert done.stderr.endswith("(on Debian: apt install python3.12-venv).\n")


@pytest.mark.parametrize(
    ("uv", "tries"), [("works", ["uv"]), ("fails", ["uv", "pip"]), ("missing", ["pip"])]
)
def test_what_uv_cannot_install_pip_does(bare: Checkout, uv: str, tries: list[str]) -> None:
    bare.plays("python3.12", INSTALLERS)
    noted = bare.root / "tries"
    done = bare.run(TRIES=str(noted), UV=uv, FAILURES="0")
    assert (done.returncode, noted.read_text().split()) == (0, tries)
    assert HELP in done.stdout


@pytest.mark.parametrize(("failures", "status"), [(0, 0), (2, 0), (3, 2)])
def test_it_outlasts_a_server_that_is_away_for_a_moment(
    bare: Checkout, failures: int, status: int
) -> None:
    bare.plays("python3.12", INSTALLERS)
    tries = bare.root / "tries"
    done = bare.run(TRIES=str(tries), UV="missing", FAILURES=str(failures))
    assert done.returncode == status
    assert len(tries.read_text().splitlines()) == min(failures + 1, 3)
    assert (HELP in done.stdout) == (status == 0)
    assert ("ERROR: the server is away\nwedge: the locked" in done.stderr) == (status == 2)


def test_what_a_link_leads_to_is_never_emptied(checkout: Checkout, tmp_path: Path) -> None:
    kept = environment(tmp_path / "theirs")
    (tmp_path / "theirs" / ".venv" / "setup.log").touch()  # of another checkout
    (checkout.root / ".venv").symlink_to(tmp_path / "theirs" / ".venv")
    done = checkout.run()
    assert done.returncode == 2
    assert ".venv is a link" in done.stderr
    assert kept.read_text() == "theirs"


def test_it_sets_itself_up_once_and_runs(checkout: Checkout) -> None:
    ran = f"ran {checkout.root}/.venv/bin/python {HELP}\n"
    first = checkout.run()
    assert (first.returncode, first.stdout) == (0, ran), first.stderr
    again = checkout.run()
    assert (again.returncode, again.stdout, again.stderr) == (0, ran, "")


@pytest.mark.parametrize("target", ["{root}/wedge", "../checkout/wedge", "second"])
def test_through_a_link_it_is_the_checkout_s(
    target: str, checkout: Checkout, tmp_path: Path
) -> None:
    theirs = tmp_path / "theirs"
    kept = environment(theirs)
    (theirs / "second").symlink_to("../checkout/wedge")
    (theirs / "wedge").symlink_to(target.format(root=checkout.root))
    for script, folder in ((theirs / "wedge", tmp_path), ("./wedge", theirs)):
        done = checkout.run(script, folder)
        assert done.stdout == f"ran {checkout.root}/.venv/bin/python {HELP}\n"
    assert kept.read_text() == "theirs"
    assert sorted(path.name for path in theirs.iterdir()) == [".venv", "second", "wedge"]


def test_apart_from_its_checkout_it_makes_nothing(checkout: Checkout, tmp_path: Path) -> None:
    theirs = tmp_path / "theirs"
    kept = environment(theirs)
    shutil.copy(ROOT / "wedge", theirs)
    done = checkout.run(theirs / "wedge", tmp_path)
    assert (done.returncode, done.stdout) == (2, "")
    assert f"{theirs}/requirements/lock.txt is missing" in done.stderr
    assert kept.read_text() == "theirs"
    assert sorted(path.name for path in theirs.iterdir()) == [".venv", "wedge"]


def test_an_environment_that_is_not_its_own_is_kept(checkout: Checkout) -> None:
    kept = environment(checkout.root)
    done = checkout.run()
    assert (done.returncode, done.stdout) == (2, "")
    assert "was not made by this script and would be emptied: move it away" in done.stderr
    assert kept.read_text() == "theirs"


@pytest.mark.parametrize("mark", ["wedge-stamp", "setup.log"])
def test_its_own_of_an_earlier_lock_is_emptied(mark: str, checkout: Checkout) -> None:
    old = environment(checkout.root)
    (checkout.root / ".venv" / mark).write_text("of an earlier lock")
    assert checkout.run().returncode == 0
    assert not old.exists()


def test_one_that_was_stopped_half_made_is_made_anew(checkout: Checkout) -> None:
    (checkout.root / ".venv").mkdir()  # empty, as where a disk is mounted
    checkout.plays("python3.14", KILLED)
    assert checkout.run().returncode == 2
    assert (checkout.root / ".venv" / "bin").is_dir()
    checkout.plays("python3.14", PYTHON)
    done = checkout.run()
    assert (done.returncode, done.stdout[:3]) == (0, "ran"), done.stderr


@pytest.mark.parametrize(
    ("system", "machine", "version"),
    [
        ("Linux", "x86_64", "glibc 2.5"),
        ("Linux", "x86_64", "glibc 2.28"),
        ("Linux", "aarch64", "glibc 2.30"),
        ("Linux", "armv7l", "glibc 2.36"),
        ("Darwin", "x86_64", "15.1"),
        ("Darwin", "arm64", "13.7.1"),
        ("Darwin", "arm64", "11.0"),
    ],
)
def test_a_system_without_wheels_is_told_before_anything_is_made(
    system: str, machine: str, version: str, checkout: Checkout
) -> None:
    checkout.runs_on(system, machine, version)
    done = checkout.run()
    assert (done.returncode, done.stdout) == (2, "")
    assert "macOS 14 or later on Apple silicon, or Linux with glibc 2.31 or later" in done.stderr
    assert done.stderr.startswith("wedge: this is ") and done.stderr.count("\n") == 1
    assert machine in done.stderr
    assert sorted(p.name for p in checkout.root.iterdir()) == ["requirements", "wedge"]


@pytest.mark.parametrize(
    ("system", "machine", "version"),
    [
        ("Linux", "x86_64", "glibc 2.31"),
        ("Linux", "aarch64", "glibc 2.41"),
        ("Linux", "x86_64", "glibc 3.0"),
        ("Darwin", "arm64", "14.0"),
        ("Darwin", "arm64", "26.1"),
        ("Linux", "x86_64", ""),
        ("Darwin", "arm64", ""),
        ("FreeBSD", "amd64", ""),
    ],
)
def test_one_that_has_them_or_cannot_be_told_is_tried(
    system: str, machine: str, version: str, checkout: Checkout
) -> None:
    checkout.runs_on(system, machine, version)
    done = checkout.run()
    assert (done.returncode, done.stdout[:3]) == (0, "ran"), done.stderr
