# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Loops that every frame passes, compiled for this processor when first used.

Machine code is kept in the user's cache.
"""

import hashlib
import inspect
import os
import re
import shutil
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any

from sensor.errors import WedgeError
from sensor.extras import how_to_install

try:
    import numba
except ModuleNotFoundError as error:
    raise WedgeError(f"compiled loops need numba: {how_to_install('track,live')}.") from error


OF_CODE = re.compile(r"[0-9a-f]{12}")
"""The name of a folder of machine code."""
UNUSED_DAYS = 30
SECONDS_A_DAY = 24 * 3600


def code_folder() -> Path:
    """Where machine code is kept, by what it was made from: constants of other files are in it."""
    base = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
    cache = os.environ.get("WEDGE_CACHE") or base / "gelsight-wedge"
    sources = sorted(Path(__file__).parent.rglob("*.py"))
    made_from = hashlib.sha256(b"".join(path.read_bytes() for path in sources))
    return Path(cache) / "compiled" / made_from.hexdigest()[:12]


def prepared(folder: Path) -> bool:
    """Make a folder for machine code, or mark it as used today; whether it can be written.

    With a new one, those beside it that no process has begun to use for ``UNUSED_DAYS`` go: each
    change of a source file leaves one.
    """
    try:
        new = not folder.exists()
        folder.mkdir(parents=True, exist_ok=True)
        os.utime(folder)
        if new:
            _remove_unused(folder)
    except OSError:
        return False
    return os.access(folder, os.W_OK)


def _remove_unused(folder: Path) -> None:
    """Remove what is old beside a folder that was just made, whose time is now."""
    latest_s = folder.stat().st_mtime - UNUSED_DAYS * SECONDS_A_DAY
    for other in folder.parent.iterdir():
        if OF_CODE.fullmatch(other.name) is None:
            continue
        with suppress(OSError):  # it is no folder, or another process removes it, too
            if other.stat().st_mtime < latest_s:
                shutil.rmtree(other)


CODE_FOLDER = code_folder()
KEEPS = prepared(CODE_FOLDER)
FAST = {"contract", "reassoc", "nsz", "nnan"}


def compiled(function: Callable[..., Any]) -> Callable[..., Any]:
    """The function as machine code, kept for the next start where the cache can be written."""
    kept = numba.config.CACHE_DIR
    numba.config.CACHE_DIR = kept or str(CODE_FOLDER)
    try:
        jit = numba.njit(cache=KEEPS, nogil=True, fastmath=FAST, error_model="numpy")
        code: Callable[..., Any] = jit(inspect.unwrap(function))
    finally:
        numba.config.CACHE_DIR = kept
    return code
