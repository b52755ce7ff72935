# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""The installer under bats, and the unit under systemd's own eyes."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

HERE = Path(__file__).parent
UNIT = HERE.parents[1] / "firmware_pi" / "gelsight-wedge@.service"
EXPOSED_AT_MOST = 2.5


def run(*words: str | Path) -> subprocess.CompletedProcess[str]:
    if shutil.which(words[0]) is None:
        pytest.skip(f"{words[0]} is not installed: requirements/debian.sh installs what tests need")
    # The interpreter itself first: a version manager's `python3` takes as long as what it starts.
    path = f"{Path(sys.executable).resolve().parent}{os.pathsep}{os.environ['PATH']}"
    environment = {**os.environ, "PATH": path}
    return subprocess.run(words, capture_output=True, text=True, check=False, env=environment)


def test_the_installer() -> None:
    done = run("bats", HERE / "install.bats")
    assert done.returncode == 0, done.stdout


def test_systemd_finds_no_fault_in_the_unit(tmp_path: Path) -> None:
    program = tmp_path / "gelsight-wedge"
    program.write_text("#!/bin/sh\n")
    program.chmod(0o755)
    unit = tmp_path / "gelsight-wedge@0.service"
    text = UNIT.read_text().replace("/usr/local/bin/gelsight-wedge", str(program))
    unit.write_text(text.replace("WatchdogSec=", "WatchdogSecs="))
    done = run("systemd-analyze", "verify", unit)
    assert "WatchdogSecs" in done.stderr  # it would say so
    unit.write_text(text)
    done = run("systemd-analyze", "verify", unit)
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")


def test_the_unit_exposes_little() -> None:
    threshold = f"--threshold={EXPOSED_AT_MOST * 10:.0f}"
    done = run("systemd-analyze", "security", "--offline=true", "--no-pager", threshold, UNIT)
    assert done.returncode == 0, done.stdout
