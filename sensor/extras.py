# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""How packages that not everybody needs are installed."""

import shlex
import sys
from importlib.util import find_spec
from pathlib import Path

CPU_INDEX = "https://download.pytorch.org/whl/cpu"
"""PyTorch's; from elsewhere a wheel for Linux brings CUDA."""
ROOT = Path(__file__).resolve().parents[1]
"""Above the rooms: the checkout, or where pip has put them."""


def how_to_install(extra: str) -> str:
    """What to do where a package is missing, as the end of a sentence.

    By the Python that misses it: ``./wedge`` runs the checkout's own, whose ``pip`` is on nobody's
    path. From the checkout, as no index has the project, and editable where it runs from there, or
    a copy would take the place of what one edits.

    Args:
        extra: as ``pyproject.toml`` calls it, such as ``live``, or several, such as ``track,live``.
    """
    words = ["--extra-index-url", CPU_INDEX] if extra == "train" else []
    if (ROOT / "wedge").is_file():
        return f"run `{_pip_install(*words, '-e', f'{ROOT}[{extra}]')}`"
    return f"run `{_pip_install(*words, f'.[{extra}]')}` in the checkout"


def how_to_restore(package: str) -> str:
    """What to do where another package has replaced files of one, as the end of a sentence.

    Args:
        package: as pip takes it, such as ``numpy<3``.
    """
    return f"run `{_pip_install('--force-reinstall', '--no-deps', package)}`"


def _pip_install(*words: str) -> str:
    install = shlex.join([sys.executable, "-m", "pip", "install", *words])
    if find_spec("pip") is None:  # uv makes environments without it
        return f"{shlex.join([sys.executable, '-m', 'ensurepip'])} && {install}"
    return install
