# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Ctrl-C, SIGTERM and SIGHUP held back for as long as a step takes that must not end halfway."""

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

ASKING_TO_END: tuple[int, ...] = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)


@contextmanager
def uninterrupted() -> Iterator[None]:
    """Let what asks to end be heard behind the block, or the decorated function, not amid it.

    It is to be short: while it waits only SIGKILL ends it. Threads but the main one hear nothing.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    asked: list[int] = []
    before: dict[int, Any] = {}
    try:
        for number in ASKING_TO_END:
            if callable(signal.getsignal(number)):
                before[number] = signal.getsignal(number)
                signal.signal(number, lambda number, _: asked.append(number))
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
        for number in dict.fromkeys(asked):
            signal.raise_signal(number)
