# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""What the tests of the Pi share: a stand-in for picamera2."""

import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

FAKE_PI = Path(__file__).parent / "fake_pi"


@pytest.fixture
def fake_pi(monkeypatch: pytest.MonkeyPatch) -> Iterator[Callable[..., Any]]:
    """Make picamera2 importable as it is on a Pi of some kind; gives the fake's module."""

    def forget() -> None:
        for name in [n for n in sys.modules if n.split(".")[0] in ("picamera2", "libcamera")]:
            del sys.modules[name]

    def make(words: str = "zero", *, sync: bool = False) -> Any:
        forget()
        monkeypatch.setenv("FAKE_PI", words)
        if sync:
            monkeypatch.setenv("FAKE_PI_SYNC", "1")
        monkeypatch.syspath_prepend(FAKE_PI)
        import picamera2

        return picamera2.Picamera2

    yield make
    forget()
