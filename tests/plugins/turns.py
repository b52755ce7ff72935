# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""A file that is played turn by turn: its next frame comes when the last one was taken."""

from threading import Event, Semaphore
from types import SimpleNamespace

import pytest


class Turns(Event):
    """Stands in for what ends a paced file's waits, which are as long as the reader takes."""

    def __init__(self) -> None:
        super().__init__()
        self.taken = Semaphore(1)
        """To be released once per frame taken."""
        self.due_s: list[float | None] = []
        """When each frame would have come by itself, from the beginning."""

    def wait(self, timeout: float | None = None) -> bool:
        """Until the last frame was taken; whether the file was closed."""
        self.due_s.append(timeout)
        self.taken.acquire()
        return self.is_set()

    def set(self) -> None:
        """End the wait for good."""
        super().set()
        self.taken.release()


def play_by_turns(monkeypatch: pytest.MonkeyPatch) -> Turns:
    """Let the next file that is opened be played so, by a clock that stands still."""
    turns = Turns()
    monkeypatch.setattr("recon.stream.sources.time", SimpleNamespace(monotonic_ns=lambda: 0))
    monkeypatch.setattr("recon.stream.sources.Event", lambda: turns)
    return turns
