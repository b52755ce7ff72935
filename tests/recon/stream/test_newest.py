# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Who is slow sees the newest frame, however slow and for however long."""

import threading
from collections.abc import Iterator

import pytest

from recon.stream.frame import Counts, TimedFrame
from recon.stream.newest import Newest
from sensor.errors import WedgeError


class Counter:
    """Gives numbered frames as a test lets it."""

    name, live = "counter", True

    def __init__(self, error: str = "") -> None:
        self.counts = Counts()
        self.error = error
        self.allowed = threading.Semaphore(0)
        self.given = threading.Semaphore(0)
        self.ended = False

    def __iter__(self) -> Iterator[TimedFrame]:
        index = 0
        while self.allowed.acquire() and not self.ended:
            yield TimedFrame(index=index, time_ns=index, arrived_ns=index, jpeg=b"")
            index += 1
            self.given.release()
        if self.error:
            raise WedgeError(self.error)

    def give(self, count: int) -> None:
        """Let so many frames through, and wait until they are."""
        self.allowed.release(count)
        for _ in range(count):
            self.given.acquire()

    def close(self) -> None:
        self.ended = True
        self.allowed.release()

    def __enter__(self) -> "Counter":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def test_a_consumer_a_sixth_as_fast_is_never_behind() -> None:
    with Newest(Counter()) as newest:
        taken = []
        for _ in range(600):  # a minute of 10 Hz
            newest.source.give(6)
            taken.append(newest.take().index)
        assert taken == [6 * i + 5 for i in range(600)]
        assert newest.skipped == 600 * 5


def test_no_frame_is_seen_twice_and_the_end_is_told() -> None:
    newest = Newest(Counter())
    newest.source.give(1)
    assert newest.take().index == 0
    assert newest.take(timeout_s=0.0) is None
    assert not newest.ended
    newest.source.give(1)
    newest.close()
    assert [frame.index for frame in newest] == [1]
    assert newest.ended


def test_what_fails_in_the_thread_is_raised_where_frames_are_asked_for() -> None:
    newest = Newest(Counter(error="usb:0 gives no frames any more."))
    newest.source.give(1)
    newest.close()
    frames = iter(newest)
    assert next(frames).index == 0
    with pytest.raises(WedgeError, match="usb:0"):
        next(frames)
