# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Who is slow sees the newest frame, however slow and for however long."""

import threading
from collections.abc import Iterator
from types import SimpleNamespace

import pytest

from recon.stream.frame import Counts, TimedFrame
from recon.stream.jpeg import scan_start
from recon.stream.newest import DAMAGED_FRAMES, Newest
from sensor.errors import WedgeError
from tests.recon.stream.servers import FRAMES

SCAN = FRAMES[0][scan_start(FRAMES[0]) :]


class Counter:
    """Gives numbered frames as a test lets it."""

    name, live, timed = "counter", True, True

    def __init__(self, error: Exception | None = None, damaged: int = -1) -> None:
        self.counts = Counts()
        self.error, self.damaged = error, damaged
        self.allowed = threading.Semaphore(0)
        self.given = threading.Semaphore(0)
        self.ended = False

    def __iter__(self) -> Iterator[TimedFrame]:
        index = 0
        while self.allowed.acquire() and not self.ended:
            damaged = index == self.damaged
            jpeg = FRAMES[0].replace(SCAN, SCAN[:9] + b"\xff\xd8" * 9) if damaged else FRAMES[0]
            yield TimedFrame(index=index, time_ns=index, arrived_ns=index, jpeg=jpeg)
            index += 1
            self.given.release()
        if self.error is not None:
            raise self.error

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


@pytest.mark.parametrize("error", [WedgeError("usb:0 gives none."), RuntimeError("a bug")])
def test_what_fails_in_the_thread_is_raised_where_frames_are_asked_for(error: Exception) -> None:
    newest = Newest(Counter(error))
    newest.source.give(1)
    newest.close()
    frames = iter(newest)
    assert next(frames).index == 0
    with pytest.raises(type(error), match=str(error)):
        next(frames)


def test_who_waits_for_so_long_does_not_wait_longer_for_damaged_frames() -> None:
    class Spoilt(Counter):
        def __iter__(self) -> Iterator[TimedFrame]:
            while not self.closed.wait(0.001):
                yield TimedFrame(index=0, time_ns=0, arrived_ns=0, jpeg=b"no JPEG")

        closed = threading.Event()

        def close(self) -> None:
            self.closed.set()

    with Newest(Spoilt()) as newest:
        assert newest.remark == "" and not newest.all_damaged
        assert newest.take(timeout_s=0.05) is None
        assert newest.source.counts.corrupt >= DAMAGED_FRAMES and newest.all_damaged
        assert newest.remark.startswith("no frame of counter can be shown; the last one: ")


def test_a_stream_of_which_every_other_frame_is_damaged_is_not_all_damaged() -> None:
    class Flickering(Counter):
        """Each frame comes once the one before was looked at."""

        def __iter__(self) -> Iterator[TimedFrame]:
            for index in range(2 * DAMAGED_FRAMES):
                flaw, jpeg = ("", FRAMES[0]) if index % 2 else ("1.png is damaged.", None)
                yield TimedFrame(index=index, time_ns=0, arrived_ns=0, jpeg=jpeg, flaw=flaw)
                self.allowed.acquire()
                if self.ended:
                    return

    source = Flickering()
    source.counts = SimpleNamespace(add_corrupt=source.allowed.release)
    with Newest(source) as newest:
        for taken in range(DAMAGED_FRAMES):
            assert newest.take().index == 2 * taken + 1
            assert not newest.all_damaged
            source.allowed.release()


def test_a_jpeg_damaged_within_is_passed_over() -> None:
    with Newest(Counter(damaged=1)) as newest:
        newest.source.give(1)
        assert newest.take().pixels is not None
        newest.source.give(1)
        found: list[int] = []
        reader = threading.Thread(target=lambda: found.append(newest.take().index))
        reader.start()
        while newest.source.counts.corrupt == 0:
            reader.join(0.001)
        newest.source.give(1)
        reader.join()
        assert (found, newest.source.counts.corrupt) == ([2], 1)
        assert newest.remark == ""


def test_damage_that_two_see_at_once_counts_twice() -> None:
    counts = Counts()
    decoder = threading.Thread(target=counts.add_corrupt)

    class Slow(int):
        """While it is added, somebody else counts."""

        def __radd__(self, before: int) -> int:
            decoder.start()
            decoder.join(0.05)
            return before + int(self)

    counts.add_corrupt(Slow(2))
    decoder.join()
    assert counts.corrupt == 3


def test_a_damaged_frame_does_not_take_the_place_of_one_to_look_at() -> None:
    class Folder(Counter):
        def __iter__(self) -> Iterator[TimedFrame]:
            for index, flaw in enumerate(["", "", "1.png is damaged.", "2.png is damaged."]):
                jpeg = None if flaw else FRAMES[index]
                yield TimedFrame(index=index, time_ns=0, arrived_ns=0, jpeg=jpeg, flaw=flaw)

    with Newest(Folder()) as newest:
        newest.close()
        assert [frame.index for frame in newest] == [1]
        assert (newest.skipped, newest.source.counts.corrupt) == (1, 2)


def test_a_source_has_not_ended_while_a_frame_waits() -> None:
    source = Counter()
    with Newest(source) as newest:
        source.give(1)
        newest.close()
        assert not newest.ended
        assert newest.take() is not None
        assert newest.ended


def test_it_tells_when_the_frame_came_that_was_taken_last(monkeypatch: pytest.MonkeyPatch) -> None:
    now_s = [5.0]
    clock = SimpleNamespace(monotonic=lambda: now_s[0])
    monkeypatch.setattr("recon.stream.newest.time", clock)
    source = Counter(damaged=1)
    with Newest(source) as newest:
        assert newest.came_s < 0
        source.give(1)
        now_s[0] = 8.0
        assert newest.take(0.0) is not None and newest.came_s == 5
        source.give(1)  # the damaged one
        now_s[0] = 9.0
        assert newest.take(0.0) is None and newest.came_s == 5
        source.give(1)
        assert newest.came_s == 5
        assert newest.take(0.0) is not None and newest.came_s == 9
