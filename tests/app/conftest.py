# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""What tests of the commands share: circles that one of them found are not sought again.

Most tests press the same ball into the same sensor, and a search is the longest part of them. The
search itself, which is tested in ``tests/recon/labels``, depends on nothing but its arguments.
"""

import hashlib
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import pytest

import app._captured
import app._importing
import app.label
import app.table
from recon.arrays import Difference
from recon.labels import capture, find_circles
from recon.labels.circles import Circle
from recon.labels.find_circle import find_circle

_FOUND: dict[tuple[object, ...], Circle | None] = {}


@pytest.fixture(autouse=True)
def found_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """In this process, whatever thread asks."""

    def remembered(difference: Difference, *scales: Any) -> Circle | None:
        seen = hashlib.sha256(difference.tobytes()).digest()
        key = (seen, difference.shape, *scales)
        if key not in _FOUND:
            _FOUND[key] = find_circle(difference, *scales)
        return _FOUND[key]

    for module in (capture, find_circles):
        monkeypatch.setattr(module, "find_circle", remembered)


@pytest.fixture
def in_this_process(monkeypatch: pytest.MonkeyPatch) -> None:
    """No other processes, which take seconds to begin; their own tests are in ``test_workers``."""
    for module in (app._captured, app._importing, app.label, app.table):
        monkeypatch.setattr(module, "process_pool", lambda: ThreadPoolExecutor(1))
