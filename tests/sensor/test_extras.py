# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""What a person is told to type is a command that a shell takes and pip can follow."""

import re
import shlex
import tomllib
from pathlib import Path

import pytest

from sensor.extras import CPU_INDEX, how_to_install

ROOT = Path(__file__).resolve().parents[2]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
PAGES = [
    path
    for top in ("app", "docs", "plugins", "recon", "sensor", "simulation", "validation")
    for path in (ROOT / top).rglob("*")
    if path.suffix in (".md", ".py")
]


@pytest.mark.parametrize("extra", PROJECT["optional-dependencies"])
def test_an_extra_is_installed_from_the_checkout_and_torch_without_cuda(extra: str) -> None:
    command = how_to_install(extra).split("`")[1]
    index = ["--extra-index-url", CPU_INDEX] if extra == "train" else []
    assert shlex.split(command) == ["pip", "install", *index, f".[{extra}]"]
    assert f'".[{extra}]"' in command  # zsh would read bare brackets as a pattern
    if index:
        assert command in (ROOT / "docs" / "howto" / "python.md").read_text(encoding="utf-8")
        assert f"cpu_index={CPU_INDEX}\n" in (ROOT / "wedge").read_text(encoding="utf-8")


def test_no_page_or_sentence_installs_the_project_from_an_index() -> None:
    named = set[str]()
    for path in PAGES:
        text = path.read_text(encoding="utf-8")
        dead = re.search(r"pip install[^\n`]*[ \"'](gelsight-wedge|lerobot_camera_gelsight)", text)
        assert dead is None, f"{path}: {dead and dead.group()}"
        named |= set(re.findall(r"how_to_install\(['\"](\w+)['\"]\)", text))
    assert named and named <= set(PROJECT["optional-dependencies"])
