# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""`wedge test`: is the code right? Style, types, floors, docs and tests, in one command."""

import os
import subprocess
import sys
import time
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from sensor.errors import WedgeError

ROOT = Path(__file__).resolve().parent.parent

CHECKS = {
    "style": "ruff check",
    "format": "ruff format --check",
    "types": "mypy",
    "floors": "lint-imports",
    "docs": "mkdocs build --strict --site-dir build/docs",
}

AT_ONCE = 2
"""Processes beside each other, of checks and then of tests: most machines have two cores."""


def main() -> int:
    """Run every check of the project, print a line for each, and the tests last.

    Style and format are checked by ruff, types by mypy, imports by import-linter (a file imports
    only from floors below it), the docs by building them with MkDocs, and the tests run with
    pytest. All run even if one fails; the output of a failed check is shown. The exit status is 1
    if any failed.

    Anything after `wedge test` goes to pytest, and then only pytest runs: `wedge test -k poisson`.
    """
    _require_checkout()
    with ThreadPoolExecutor(AT_ONCE) as pool:
        passed = pool.map(_passes, CHECKS, CHECKS.values())
        failed = [name for name, well in zip(CHECKS, passed, strict=True) if not well]
    # Each process begins with half of the files: few of them share what two would both build.
    if run_pytest([f"--numprocesses={AT_ONCE}", "--dist=worksteal"]) != 0:
        failed.append("tests")
    if failed:
        print(f"wedge: failed: {', '.join(failed)}", file=sys.stderr)
    return 1 if failed else 0


def run_pytest(arguments: Sequence[str]) -> int:
    """Run pytest alone in the project's folder and return its exit status."""
    _require_checkout()
    return _run("pytest", *arguments).returncode


def _passes(name: str, command: str) -> bool:
    """Run one check, print its line, and what it said if it failed."""
    start_s = time.perf_counter()
    done = _run(*command.split(), output=subprocess.PIPE)
    verdict = "failed" if done.returncode else "ok"
    said = f"\n{done.stdout.rstrip()}" if done.returncode else ""
    print(f"{name:8}{verdict:8}{time.perf_counter() - start_s:5.1f} s{said}", flush=True)
    return done.returncode == 0


def _run(tool: str, *arguments: str, output: int | None = None) -> subprocess.CompletedProcess[str]:
    """Run a tool from this Python's folder in the project's folder.

    Numerics run on one thread, and MkDocs Material keeps its banner to itself.
    """
    return subprocess.run(
        [Path(sys.executable).with_name(tool), *arguments],
        cwd=ROOT,
        env={**os.environ, "OMP_NUM_THREADS": "1", "NO_MKDOCS_2_WARNING": "1"},
        stdout=output,
        stderr=subprocess.STDOUT if output else None,
        text=True,
        check=False,
    )


def _require_checkout() -> None:
    """Refuse where the package is installed without its tests."""
    if not (ROOT / "tests").is_dir():
        raise WedgeError("`wedge test` runs in a checkout of the repository, which has the tests.")
