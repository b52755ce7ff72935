# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Pictures in a folder, and the order of their names: press2 comes before press10."""

import re
from pathlib import Path, PurePath

from sensor.dataset import IMAGES

Runs = tuple[tuple[int, str], ...]
"""Letters and numbers in turn, numbers with how many digits they have: longer ones are larger."""


def picture_names(folder: Path) -> list[str]:
    """Names of the pictures in a folder, in their order; hidden ones, as a Mac's ._press.png, not.

    Raises:
        OSError: the folder cannot be read.
    """
    shown = (path.name for path in folder.iterdir() if not path.name.startswith("."))
    return sorted((name for name in shown if PurePath(name).suffix.lower() in IMAGES), key=in_order)


def in_order(name: str) -> tuple[Runs, Runs, str]:
    """Sorts names by the numbers in them, however many digits these have, then by their endings.

    No two names are alike to it, so that what is sorted by it depends on the names alone.
    """
    ending = PurePath(name).suffix
    return _runs(name.removesuffix(ending)), _runs(ending), name


def _runs(text: str) -> Runs:
    parts = re.split("([0-9]+)", text)
    parts[1::2] = [digits.lstrip("0") for digits in parts[1::2]]
    return tuple((len(part) if at % 2 else 0, part) for at, part in enumerate(parts))
