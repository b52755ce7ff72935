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
from collections.abc import Iterator
from fnmatch import fnmatch
from itertools import pairwise
from pathlib import Path

import jaxtyping
import numpy as np
import pytest
from hatchling.builders.sdist import SdistBuilder
from packaging.requirements import Requirement

import app.__main__
import recon.ball
from recon.kernels import code_folder
from validation.datasets import cache_folder

ROOT = Path(__file__).resolve().parent.parent


def files_of(root: Path) -> list[Path]:
    """What git keeps below a folder, or would; in an archive without git all that it would."""
    if not (root / ".git").exists() or shutil.which("git") is None:
        ignored = (root / ".gitignore").read_text().splitlines()
        return sorted(_not_ignored(root, [".git", ".git/", "/PKG-INFO", *ignored]))
    list_files = ["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"]
    done = subprocess.run(list_files, cwd=root, capture_output=True, text=True, check=True)
    return [root / name for name in done.stdout.split("\0") if name and (root / name).is_file()]


def _not_ignored(folder: Path, ignored: list[str], at: str = "/") -> Iterator[Path]:
    for path in folder.iterdir():
        end = "/" if path.is_dir() else ""
        if any(fnmatch(name + end, p) for name in (path.name, at + path.name) for p in ignored):
            continue
        if end:
            yield from _not_ignored(path, ignored, f"{at}{path.name}/")
        else:
            yield path


FILES = files_of(ROOT)
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


def test_every_other_file_has_its_licence_in_the_table_or_in_its_text() -> None:
    tables = tomllib.loads((ROOT / "REUSE.toml").read_text())["annotations"]
    patterns = [re.escape(path) for table in tables for path in table["path"]]
    # As REUSE reads them: one star stays within a folder, two do not.
    named = [
        p.replace(r"\*\*/", ".*").replace(r"\*\*", ".*").replace(r"\*", "[^/]*") for p in patterns
    ]
    bare = [
        path
        for path in FILES
        if path.parent.name != "LICENSES"
        and path.stat().st_size
        and not any(re.fullmatch(p, path.relative_to(ROOT).as_posix()) for p in named)
        and b"SPDX-License-" + b"Identifier: " not in path.read_bytes()
    ]
    assert names(bare) == []


def test_every_licence_that_is_named_is_here_and_no_other() -> None:
    annotations = tomllib.loads((ROOT / "REUSE.toml").read_text())["annotations"]
    named = {"Apache-2.0"}
    for table in annotations:
        named |= set(table["SPDX-License-Identifier"].split(" AND "))
    assert named == {path.stem for path in (ROOT / "LICENSES").iterdir()}


def test_what_is_installed_says_and_brings_its_licences() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    texts = {path.stem for path in (ROOT / "LICENSES").iterdir()}
    assert {*project["license"].split(" AND ")} == texts - {"MIT"}  # of one figure in docs/
    brought = {path for pattern in project["license-files"] for path in ROOT.glob(pattern)}
    assert brought == {ROOT / "LICENSE", ROOT / "REUSE.toml", *(ROOT / "LICENSES").iterdir()}
    (plugin,) = (path.parent for path in FILES if path.match("plugins/*/pyproject.toml"))
    project = tomllib.loads((plugin / "pyproject.toml").read_text())["project"]
    assert project["license-files"] == ["LICENSE"]
    text = (ROOT / "LICENSES" / f"{project['license']}.txt").read_bytes()
    assert (plugin / "LICENSE").read_bytes() == text


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


def test_names_are_spelled_as_in_libraries() -> None:
    """A sentence for a test's name, and what another library calls so, may be British."""
    british = re.compile("colour|centre|neighbour|grey", re.IGNORECASE)
    allowed = re.compile("test_|colour_space$")
    # Only what has such words at all is read as Python: that takes long.
    suspects = {path: text for path in PYTHON_FILES if british.search(text := path.read_text())}
    assert suspects
    for path, text in suspects.items():
        defined = {
            name
            for node in ast.walk(ast.parse(text))
            for kind in ("id", "name", "arg", "attr")
            if isinstance(name := getattr(node, kind, None), str)
        }
        found = {name for name in defined if british.search(name)}
        assert not {name for name in found if not allowed.match(name)}, path


def test_no_array_file_may_run_code() -> None:
    # ruff refuses pickle, eval, exec and shells; numpy's way around that is an argument.
    found = [path for path in PYTHON_FILES if "allow_pickle=" + "True" in path.read_text()]
    assert names(found) == []


def _statements(node: ast.AST) -> Iterator[ast.AST]:
    """All that a node holds but expressions, which are most of a file and hold no statement."""
    for child in ast.iter_child_nodes(node):
        if not isinstance(child, ast.expr):
            yield child
            yield from _statements(child)


def test_no_end_of_a_sentence_is_left_behind() -> None:
    # A string by itself says something of the module, the class, the function or the name before
    # it; after anything else it is the rest of one that nobody joined.
    left: list[str] = []
    for path in PYTHON_FILES:
        tree = ast.parse(path.read_text())
        for node in (tree, *_statements(tree)):
            body = getattr(node, "body", None)
            for before, after in pairwise(body if isinstance(body, list) else []):
                text = after.value if isinstance(after, ast.Expr) else None
                alone = isinstance(text, ast.JoinedStr) or (
                    isinstance(text, ast.Constant) and isinstance(text.value, str)
                )
                if alone and not isinstance(before, ast.Assign | ast.AnnAssign):
                    left.append(f"{path.relative_to(ROOT)}:{after.lineno}")
    assert left == []


def test_every_subcommand_is_a_module_and_every_module_a_subcommand() -> None:
    modules = {p.stem for p in PYTHON_FILES if p.parent == ROOT / "app" and p.stem[0] != "_"}
    assert modules == set(app.__main__.SUBCOMMANDS)


def test_what_subcommands_share_is_in_modules_of_its_own() -> None:
    for name in app.__main__.SUBCOMMANDS:
        tree = ast.parse((ROOT / "app" / f"{name}.py").read_text(encoding="utf-8"))
        modules = [node.module or "" for node in ast.walk(tree) if isinstance(node, ast.ImportFrom)]
        of_app = [module for module in modules if module.partition(".")[0] == "app"]
        assert all(module.startswith(("app._", "app.pages")) for module in of_app), name


def test_shell_scripts_are_clean() -> None:
    shellcheck = shutil.which("shellcheck", path=sysconfig.get_path("scripts"))
    if shellcheck is None:
        pytest.skip("shellcheck has no package for this machine")
    done = subprocess.run([shellcheck, *SHELL_FILES], capture_output=True, text=True, check=False)
    assert done.stdout == ""


def test_the_lock_holds_what_the_project_requires() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    extras = project["optional-dependencies"]
    apart = {"train", "rerun"}  # see there why
    named = [text for extra, texts in extras.items() if extra not in apart for text in texts]
    wanted = [Requirement(text) for text in project["dependencies"] + named]
    missing = [
        str(r) for r in wanted if not any(r.specifier.contains(v) for v in LOCKED.get(r.name, []))
    ]
    assert missing == []


def test_torch_has_one_version() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    text = "".join((ROOT / f).read_text() for f in ("wedge", "requirements/torch-needs.in"))
    versions = set(re.findall(r"torch[= ](\d+(?:\.\d+)+)", text))
    assert {f"torch=={v}" for v in versions} == set(project["optional-dependencies"]["train"])


def test_the_lock_holds_what_torch_requires_but_torch_and_cuda() -> None:
    required = map(Requirement, importlib.metadata.requires("torch") or [])
    needed = {r.name for r in required if r.marker is None or r.marker.evaluate({"extra": ""})}
    cuda = {name for name in needed | set(LOCKED) if re.match("nvidia|cuda|triton|torch", name)}
    assert needed - cuda <= set(LOCKED)
    assert cuda.isdisjoint(LOCKED)


def test_the_lock_names_no_package_index() -> None:
    assert "://" not in LOCK.read_text()


def test_an_archive_without_git_is_judged_by_what_git_would_keep(tmp_path: Path) -> None:
    shutil.copy(ROOT / ".gitignore", tmp_path)
    kept = ["a.py", "docs/build/b.md", "tests/conftest.py"]
    for name in [*kept, "build/c.py", ".venv/lib/d.py", "app/__pycache__/e.pyc", ".x_cache/f"]:
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).touch()
    assert files_of(tmp_path) == [tmp_path / name for name in (".gitignore", *kept)]


def test_a_source_archive_holds_all_that_git_keeps() -> None:
    archived = {Path(file.path) for file in SdistBuilder(str(ROOT)).recurse_included_files()}
    assert names([path for path in FILES if path not in archived]) == []


def test_no_test_writes_into_the_user_s_cache() -> None:
    assert cache_folder().is_relative_to(ROOT / "build")
    assert code_folder().is_relative_to(ROOT / "build")


def test_shapes_are_checked_at_every_call(monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(jaxtyping.TypeCheckError):
        recon.ball.normals(np.zeros((4, 5, 3)))
    gradient = np.ones((4, 5, 2))
    recon.ball.normals(gradient)
    monkeypatch.setattr(np, "concatenate", lambda *_: gradient)
    with pytest.raises(jaxtyping.TypeCheckError):  # of what is returned, too
        recon.ball.normals(gradient)
