# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""The layout as a test: what every file and folder of the repository promises."""

import ast
import importlib.metadata
import re
import shutil
import subprocess
import sysconfig
import tomllib
from pathlib import Path

import jaxtyping
import numpy as np
import pytest
from packaging.requirements import Requirement

import app.__main__
import recon.ball

ROOT = Path(__file__).resolve().parent.parent
FILES = [
    ROOT / name
    for name in subprocess.run(
        ["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=True,
    ).stdout.split("\0")
    if name and (ROOT / name).is_file()
]
PYTHON_FILES = [path for path in FILES if path.suffix == ".py"]
SHELL_FILES = [path for path in FILES if path.read_bytes().startswith(b"#!/bin/sh")]

LOCK = ROOT / "requirements" / "lock.txt"
LOCKED = {
    name: re.findall(rf"^{re.escape(name)}==(\S+)", LOCK.read_text(), re.MULTILINE)
    for name in re.findall(r"^([\w.-]+)==", LOCK.read_text(), re.MULTILINE)
}


def names(paths: list[Path]) -> list[str]:
    return [str(path.relative_to(ROOT)) for path in paths]


def test_no_source_file_is_longer_than_400_lines() -> None:
    assert names([p for p in PYTHON_FILES if len(p.read_text().splitlines()) > 400]) == []


def test_contributing_fits_on_one_screen() -> None:
    assert len((ROOT / "CONTRIBUTING.md").read_text().splitlines()) <= 40


def test_every_source_file_begins_with_its_licence() -> None:
    header = Path(__file__).read_text().splitlines()[:2]
    sources = PYTHON_FILES + SHELL_FILES
    lines = {path: path.read_text().splitlines() for path in sources}
    bare = [path for path in sources if header not in (lines[path][:2], lines[path][1:3])]
    assert names(bare) == []


def test_every_licence_that_is_named_is_here_and_no_other() -> None:
    annotations = tomllib.loads((ROOT / "REUSE.toml").read_text())["annotations"]
    named = {"Apache-2.0"} | {table["SPDX-License-Identifier"] for table in annotations}
    assert named == {path.stem for path in (ROOT / "LICENSES").iterdir()}


def test_every_folder_at_the_top_says_what_it_is() -> None:
    folders = {path.relative_to(ROOT).parts[0] for path in FILES if path.parent != ROOT}
    silent = [
        name
        for name in folders - {"LICENSES", ".ci", "requirements", "tests", "docs"}
        if not (ROOT / name / "README.md").is_file()
        and not ast.get_docstring(ast.parse((ROOT / name / "__init__.py").read_text()))
    ]
    assert silent == []


def test_at_the_top_lie_words_and_settings_alone() -> None:
    at_the_top = [path for path in FILES if path.parent == ROOT]
    assert names([path for path in at_the_top if b"\0" in path.read_bytes()]) == []


def test_no_file_names_a_machine() -> None:
    a_machine = re.compile(r"(?<![\w.~$}])/(?:root|work|home/\w+|Users/\w+)\b(?!\.)")
    texts = [path for path in FILES if b"\0" not in path.read_bytes()]
    found = [p for p in texts if p != Path(__file__) and a_machine.search(p.read_text())]
    assert names(found) == []


def test_no_array_file_may_run_code() -> None:
    # ruff refuses pickle, eval, exec and shells; numpy's way around that is an argument.
    found = [path for path in PYTHON_FILES if "allow_pickle=" + "True" in path.read_text()]
    assert names(found) == []


def test_every_subcommand_is_a_module_and_every_module_a_subcommand() -> None:
    modules = {p.stem for p in PYTHON_FILES if p.parent == ROOT / "app" and p.stem[0] != "_"}
    assert modules == set(app.__main__.SUBCOMMANDS)


def test_shell_scripts_are_clean() -> None:
    shellcheck = shutil.which("shellcheck", path=sysconfig.get_path("scripts"))
    if shellcheck is None:
        pytest.skip("shellcheck has no package for this machine")
    done = subprocess.run([shellcheck, *SHELL_FILES], capture_output=True, text=True, check=False)
    assert done.stdout == ""


def test_the_lock_holds_what_the_project_requires() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    extras = project["optional-dependencies"]
    wanted = [
        Requirement(text) for text in project["dependencies"] + extras["test"] + extras["docs"]
    ]
    assert [r for r in wanted if not any(r.specifier.contains(v) for v in LOCKED[r.name])] == []


def test_the_lock_holds_what_torch_requires_but_torch_and_cuda() -> None:
    required = map(Requirement, importlib.metadata.requires("torch") or [])
    needed = {r.name for r in required if r.marker is None or r.marker.evaluate({"extra": ""})}
    cuda = {name for name in needed | set(LOCKED) if re.match("nvidia|cuda|triton|torch", name)}
    assert needed - cuda <= set(LOCKED)
    assert cuda.isdisjoint(LOCKED)


def test_the_lock_names_no_package_index() -> None:
    assert "://" not in LOCK.read_text()


def test_shapes_are_checked_at_every_call() -> None:
    with pytest.raises(jaxtyping.TypeCheckError):
        recon.ball.normals(np.zeros((4, 5, 3)))
