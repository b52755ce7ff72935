# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Loops that a frame passes at camera rate, compiled for this processor when first used.

Machine code is kept in the user's cache.
"""

import hashlib
import inspect
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

from sensor.errors import WedgeError
from sensor.extras import how_to_install

try:
    import numba
except ModuleNotFoundError as error:
    raise WedgeError(f"depth at camera rate needs numba: {how_to_install('live')}.") from error


def code_folder() -> Path:
    """Where machine code is kept, by what it was made from: constants of other files are in it."""
    base = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
    cache = os.environ.get("WEDGE_CACHE") or base / "gelsight-wedge"
    sources = sorted(Path(__file__).parents[1].rglob("*.py"))
    made_from = hashlib.sha256(b"".join(path.read_bytes() for path in sources))
    return Path(cache) / "compiled" / made_from.hexdigest()[:12]


CODE_FOLDER = code_folder()
FAST = {"contract", "reassoc", "nsz", "nnan"}


def compiled(function: Callable[..., Any]) -> Callable[..., Any]:
    """The function as machine code, kept for the next start where the cache can be written."""
    kept, keeps = numba.config.CACHE_DIR, True
    try:
        CODE_FOLDER.mkdir(parents=True, exist_ok=True)
    except OSError:
        keeps = False
    keeps = keeps and os.access(CODE_FOLDER, os.W_OK)
    numba.config.CACHE_DIR = kept or str(CODE_FOLDER)
    try:
        jit = numba.njit(cache=keeps, nogil=True, fastmath=FAST, error_model="numpy")
        code: Callable[..., Any] = jit(inspect.unwrap(function))
    finally:
        numba.config.CACHE_DIR = kept
    return code
