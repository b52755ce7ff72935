# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""What the watcher of a sensor says when something fails: every failure is a sentence."""

import math
import shutil
import threading
from collections.abc import Callable, Iterator
from contextlib import nullcontext
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from app.pages.blank import BLANK_FRAMES, LEAST_FRAMES, LONGEST_S, BlankTaker
from app.pages.watching import VIEW_S, Watcher, _Pace
from recon.calibration import Calibration
from recon.images import write_image
from recon.stream import Counts, TimedFrame
from sensor.errors import WedgeError
from tests.dotted import dotted, grid_px
from tests.recon.fast.units import blank_frame, make_unit, pressed
from tests.synthetic import digitized

FRAME = np.full((12, 16, 3), 90, np.uint8)


class _Endless:
    """A source of one frame after the other, until it is told to be silent."""

    name, live, timed = "endless", True, True

    def __init__(self, picture: Callable[[int], np.ndarray] = lambda _: FRAME) -> None:
        self.picture = picture
        self.counts, self.silent, self.closed = Counts(), threading.Event(), threading.Event()

    def __iter__(self) -> Iterator[TimedFrame]:
        while not self.closed.wait(0.001):
            if not self.silent.is_set():
                index, self.counts.received = self.counts.received, self.counts.received + 1
                pixels = self.picture(index)
                yield TimedFrame(index=index, time_ns=0, arrived_ns=5_000_000, pixels=pixels)

    def close(self) -> None:
        self.closed.set()

    def __enter__(self) -> "_Endless":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def watching(
    monkeypatch: pytest.MonkeyPatch,
    captures: Path,
    opened: Callable[[], object],
    unit: Calibration | None = None,
) -> Watcher:
    for name in ("VIEW_S", "AGAIN_S", "PACE_S", "SILENT_S"):
        monkeypatch.setattr(f"app.pages.watching.{name}", 0.01, raising=False)
    monkeypatch.setattr("app.pages.watching.open_live", lambda *_, **__: opened())
    watcher = Watcher("endless", unit, captures)
    watcher.watched_s = math.inf
    return watcher


def noisy(index: int) -> np.ndarray:
    """No two alike, however many are skipped between them."""
    return FRAME + np.random.default_rng(index).integers(0, 2, FRAME.shape, np.uint8)


def until(true: Callable[[], object]) -> None:
    pause = threading.Event()
    for _ in range(2000):
        if true():
            return
        pause.wait(0.005)
    raise AssertionError("never")


@pytest.mark.parametrize(
    ("fault", "sentence"),
    [
        (OSError(5, "Input/output error"), "endless: Input/output error."),
        (ZeroDivisionError("division by zero"), "endless failed with ZeroDivisionError: division"),
    ],
)
def test_any_failure_is_said_and_the_sensor_tried_again(
    fault: Exception, sentence: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    healed = threading.Event()

    def opened() -> _Endless:
        if not healed.is_set():
            raise fault
        return _Endless()

    watcher = watching(monkeypatch, tmp_path, opened)
    watcher.start()
    try:
        until(lambda: watcher.error)
        assert watcher.error.startswith(sentence) and not watcher.live
        healed.set()
        until(lambda: watcher.live)
        assert watcher.remark == ""
    finally:
        watcher.close()


def test_a_background_that_cannot_be_written_is_not_used(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    captures = tmp_path / "captures"
    captures.write_text("a file where the folder should be")
    watcher = watching(monkeypatch, captures, lambda: _Endless(noisy))
    watcher.start()
    try:
        until(lambda: watcher.live)
        watcher.take_background()
        until(lambda: watcher.remark)
        number = watcher.glimpse.number
        until(lambda: watcher.glimpse.number > number + BLANK_FRAMES)
        assert "The background was not taken" in watcher.remark and watcher.live
        assert str(captures) in watcher.remark
        assert watcher.message == (0, "")
        captures.unlink()
        watcher.take_background()
        until(lambda: watcher.message[0] == 1)
        assert "background-" in watcher.message[1] and watcher.remark == ""
    finally:
        watcher.close()


@pytest.mark.parametrize("rate_hz", [0.7, 1.0, 1.3, 58.0])
def test_the_rate_is_that_of_the_frames_however_few_a_second_holds(
    rate_hz: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As the watcher looks: at each picture's time, or for 0.3 s where no frame is there yet."""
    now_s, taken = 0.0, -1
    monkeypatch.setattr("app.pages.watching.time", SimpleNamespace(monotonic=lambda: now_s))
    counts, measured = Counts(), []
    pace = _Pace(counts)
    while len(measured) < 20:
        due_s = (taken + 1) / rate_hz
        now_s, came = (max(now_s, due_s), True) if due_s <= now_s + 0.3 else (now_s + 0.3, False)
        taken = int(now_s * rate_hz + 1e-9) if came else taken
        counts.received = taken + 2  # a file's next frame is read before its time has come
        frame = TimedFrame(index=taken, time_ns=0, arrived_ns=0, pixels=FRAME) if came else None
        if pace.is_measured(frame):
            measured.append(pace.rate_hz)
        now_s += VIEW_S if came else 0.0
    assert measured == pytest.approx([rate_hz] * 20, rel=0.02)


def test_a_silent_sensor_has_no_rate_and_no_latency(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    source = _Endless()
    watcher = watching(monkeypatch, tmp_path, lambda: source)
    watcher.start()
    try:
        until(lambda: watcher.rate_hz > 0)
        source.silent.set()
        source.counts.remark, source.counts.lost = "no frame for 1.5 s", True
        until(lambda: watcher.rate_hz == 0 and watcher.latency_ms is None)
        assert not watcher.live
        source.close()
        until(lambda: watcher.error)
        assert watcher.rate_hz == 0
    finally:
        watcher.close()


def test_a_file_whose_name_says_lost_is_live(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    source = _Endless()
    source.counts.remark = "lost.mcap is damaged in places."
    watcher = watching(monkeypatch, tmp_path, lambda: source)
    watcher.start()
    try:
        until(lambda: watcher.live)
    finally:
        watcher.close()


def test_a_folder_that_is_gone_is_not_live(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    folder = tmp_path / "frames"
    folder.mkdir()
    for number in range(2):
        write_image(folder / f"{number}.png", np.full((8, 8, 3), 90 + number, np.uint8))
    watcher = Watcher(str(folder), None, tmp_path / "captures")
    watcher.watched_s = math.inf
    watcher.start()
    try:
        until(lambda: watcher.live)
        shutil.rmtree(folder)
        until(lambda: not watcher.live)
        assert "can be shown" in watcher.remark and "is missing" in watcher.remark
        with pytest.raises(WedgeError, match="gives no frames now"):
            watcher.save_frame()
    finally:
        watcher.close()


def test_a_stream_that_is_lost_gives_neither_frame_nor_background(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    source = _Endless()
    watcher = watching(monkeypatch, tmp_path, lambda: source)
    with pytest.raises(WedgeError, match="gives no frames now"):
        watcher.take_background()
    watcher.start()
    try:
        until(lambda: watcher.live)
        source.silent.set()
        source.counts.lost = True
        for ask in (watcher.save_frame, watcher.take_background):
            with pytest.raises(WedgeError, match="endless gives no frames now: no"):
                ask()
        source.counts.lost = False
        watcher.take_background()
        source.counts.connections += 1
        source.silent.clear()
        until(lambda: watcher.trouble)
        assert "not taken: the connection broke off" in watcher.remark
        assert not list(tmp_path.iterdir())
    finally:
        watcher.close()


def test_a_background_of_a_gel_that_moves_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    unit = make_unit((160, 120))
    presses = [pressed(unit.background, (30 + 16 * i, 60), i) for i in range(7)]
    watcher = watching(monkeypatch, tmp_path, lambda: _Endless(lambda i: presses[i % 7]))
    watcher.start()
    try:
        until(lambda: watcher.live)
        watcher.take_background()
        until(lambda: watcher.trouble)
        assert "not taken: the gel moved" in watcher.remark
        assert not list(tmp_path.iterdir())
    finally:
        watcher.close()


def test_a_new_blank_frame_is_the_mean_of_noise_and_waits_no_longer_than_asked(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    now_s = 0.0
    monkeypatch.setattr("app.pages.blank.time", SimpleNamespace(monotonic=lambda: now_s))
    frames = [blank_frame((160, 120), seed) for seed in range(BLANK_FRAMES)]
    taker = BlankTaker(1)
    means = [taker.add(frame, 1) for frame in frames]
    assert means[:-1] == [None] * (BLANK_FRAMES - 1)
    np.testing.assert_allclose(means[-1], np.mean(frames, axis=0), atol=0.51)
    slow, silent = BlankTaker(1), BlankTaker(1)
    for frame in frames[:LEAST_FRAMES]:
        assert slow.add(frame, 1) is None and silent.add(None, 1) is None
    now_s = LONGEST_S + 0.01
    np.testing.assert_allclose(slow.add(None, 1), np.mean(frames[:LEAST_FRAMES], 0), atol=0.51)
    with pytest.raises(WedgeError, match="only 0 frames came in 3 s"):
        silent.add(None, 1)
    with pytest.raises(WedgeError, match="the frame size changed"):
        taker.add(frames[0][:60], 1)


@pytest.mark.parametrize(("wandered_px", "taken"), [(0.0, True), (0.03, True), (0.3, False)])
def test_no_blank_frame_is_taken_of_dots_that_wander(wandered_px: float, taken: bool) -> None:
    places, gel = grid_px(16.0, size=(160, 120)), np.full((120, 160, 3), 0.5)
    taker = BlankTaker(1)
    with nullcontext() if taken else pytest.raises(WedgeError, match="the gel moved"):
        for seed in range(BLANK_FRAMES):
            moved = places + np.array([wandered_px * seed / (BLANK_FRAMES - 1), 0.0])
            found = taker.add(digitized(dotted(moved, 2.0, gel, seed=seed)), 1)
        assert found is not None


def test_no_blank_frame_is_taken_of_a_camera_that_hangs() -> None:
    frame = blank_frame((160, 120), 0)
    hung, woke = BlankTaker(1), BlankTaker(1)
    for _ in range(BLANK_FRAMES - 1):
        assert hung.add(frame, 1) is None and woke.add(frame, 1) is None
    with pytest.raises(WedgeError, match="the picture stands still"):
        hung.add(frame.copy(), 1)
    assert woke.add(blank_frame((160, 120), 1), 1) is not None


@pytest.mark.parametrize("moves", [False, True])
def test_a_stream_that_stands_still_is_said_to(
    moves: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("app.pages.watching.STILL_S", 0.0)

    def picture(index: int) -> np.ndarray:
        frame = FRAME.copy()
        frame[0, 0] = moves * np.array((index % 256, index // 256, 0))
        return frame

    watcher = watching(monkeypatch, tmp_path, lambda: _Endless(picture))
    watcher.start()
    try:
        until(lambda: watcher.glimpse is not None and watcher.glimpse.number > 3)
        assert ("endless stands still" in watcher.remark) is not moves
    finally:
        watcher.close()


def test_the_course_may_be_read_while_it_grows(tmp_path: Path) -> None:
    unit = make_unit((160, 120))
    watcher = Watcher("endless", unit, tmp_path)
    reconstruct = watcher._prepared()
    for _ in range(2):
        watcher._look(reconstruct, unit.background, 0.0)
    read = []
    for moment in watcher.history:
        read.append(moment)
        watcher._look(reconstruct, unit.background, 1.0)
    assert len(read) == 2 and len(watcher.history) == 4
