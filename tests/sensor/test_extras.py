# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""What a person is told to type is a command that a shell takes and pip can follow."""

import re
import shlex
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

import sensor.extras
from sensor.extras import CPU_INDEX, how_to_install, how_to_restore

ROOT = Path(__file__).resolve().parents[2]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
PAGES = [
    path
    for top in ("app", "docs", "plugins", "recon", "sensor", "simulation", "validation")
    for path in (ROOT / top).rglob("*")
    if path.suffix in (".md", ".py")
]


@pytest.mark.parametrize("extra", PROJECT["optional-dependencies"])
def test_an_extra_is_installed_from_the_checkout_and_torch_without_cuda(
    extra: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pip = [sys.executable, "-m", "pip", "install"]
    pip += ["--extra-index-url", CPU_INDEX] if extra == "train" else []
    monkeypatch.setattr(sensor.extras, "find_spec", lambda _: "pip is here")
    _, command, place = how_to_install(extra).split("`")
    assert (shlex.split(command), place) == ([*pip, "-e", f"{ROOT}[{extra}]"], "")
    monkeypatch.setattr(sensor.extras, "ROOT", tmp_path)  # as in the packages of an environment
    _, command, place = how_to_install(extra).split("`")
    assert (shlex.split(command), place) == ([*pip, f".[{extra}]"], " in the checkout")
    assert f"'.[{extra}]'" in command  # zsh would read bare brackets as a pattern


def test_where_pip_itself_is_missing_it_comes_first(monkeypatch: pytest.MonkeyPatch) -> None:
    here = how_to_install("live")
    monkeypatch.setattr(sensor.extras, "find_spec", lambda _: None)  # as in environments of uv
    first, _, then = how_to_install("live").split("`")[1].partition(" && ")
    assert shlex.split(first) == [sys.executable, "-m", "ensurepip"]
    assert then == here.split("`")[1].rpartition(" && ")[2]


def test_replaced_files_are_put_back_by_the_command_that_pages_give() -> None:
    (opencv,) = (name for name in PROJECT["dependencies"] if name.startswith("opencv"))
    package = f"{opencv.partition('>')[0]}<5"
    assert opencv.endswith(",<5")
    words = shlex.split(how_to_restore(package).split("`")[1])
    assert words[-5:] == ["pip", "install", "--force-reinstall", "--no-deps", package]
    command = f'pip install --force-reinstall --no-deps "{package}"'
    for page in ("docs/howto/pi.md", "plugins/lerobot_camera_gelsight_wedge/README.md"):
        assert command in (ROOT / page).read_text(encoding="utf-8")


def test_the_page_takes_torch_from_where_the_command_does() -> None:
    page = (ROOT / "docs" / "howto" / "python.md").read_text(encoding="utf-8")
    assert f'pip install --extra-index-url {CPU_INDEX} ".[train]"' in page
    assert f"cpu_index={CPU_INDEX}\n" in (ROOT / "wedge").read_text(encoding="utf-8")


def test_the_command_works_anywhere_without_pip_on_the_path(tmp_path: Path) -> None:
    """Nothing is installed or fetched: pip says what it would do, of packages that are here."""
    for name in ("pip", "hatchling", "mcap", "nicegui", "numba", "simplejpeg"):
        pytest.importorskip(name)
    command = how_to_install("live").split("`")[1]
    dry = "--dry-run --no-index --no-build-isolation --disable-pip-version-check"
    shell = ["/bin/sh", "-c", f"{command} {dry}"]
    done = subprocess.run(shell, cwd=tmp_path, env={"PATH": ""}, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert done.stdout.splitlines()[-1] == f"Would install gelsight-wedge-{PROJECT['version']}"


def test_where_numba_is_missing_streams_and_tracking_both_come_to_work() -> None:
    """The loops of both are compiled in one place, which cannot know whose it lacks them for."""
    told = how_to_install("track,live")
    assert f"{ROOT}[track,live]" in told
    assert "[track,live]" in (ROOT / "docs" / "howto" / "track.md").read_text(encoding="utf-8")
    for module in ("recon.fast", "recon.pose.tracker"):
        code = f"import sys; sys.modules['numba'] = None; import {module}"
        command = [sys.executable, "-c", code]
        done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True)
        assert done.stderr.splitlines()[-1].endswith(f"compiled loops need numba: {told}.")


def test_no_page_or_sentence_installs_the_project_from_an_index() -> None:
    named = set[str]()
    for path in PAGES:
        text = path.read_text(encoding="utf-8")
        dead = re.search(r"pip install[^\n`]*[ \"'](gelsight-wedge|lerobot_camera_gelsight)", text)
        assert dead is None, f"{path}: {dead and dead.group()}"
        named |= set(re.findall(r"how_to_install\(['\"]([\w,]+)['\"]\)", text))
    named = set(",".join(named).split(","))
    assert named and named <= set(PROJECT["optional-dependencies"])
