# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""One sensor that the page watches, in a thread of its own: what fails here disturbs no other."""

import threading
import time
from collections import deque
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from statistics import median

import numpy as np

from app._sources import is_dataset, open_live
from app.pages import pictures
from app.pages.following import Followed, PoseView
from recon.arrays import Frame
from recon.calibration import Calibration
from recon.fast import FastReconstructor
from recon.follower import Follower
from recon.images import write_image
from recon.stream import Counts, Newest, TimedFrame
from sensor.errors import WedgeError
from sensor.toml import Pair

VIEW_S = 1 / 12
"""Between two pictures."""
PACE_S = 1.0
"""Between two measurements of how fast frames come."""
SILENT_S = 3.0
"""Without a frame for so long, a sensor has no rate."""
AGAIN_S = 1.0
"""Before a sensor that failed is tried again."""
UNWATCHED_S = 3.0
"""Without a browser for so long, no pictures are made."""
BACKGROUND_FRAMES = 12
LEAST_SCALE_MM = 0.3
STEEPNESS = 3.0


@dataclass(frozen=True, kw_only=True)
class Glimpse:
    """What the page shows of one moment; pictures as data URLs."""

    raw: str
    difference: str
    depth: str | None = None
    surface: tuple[str, pictures.Grid] | None = None
    scale_mm: float = LEAST_SCALE_MM
    deepest_mm: float = 0.0
    contact_mm2: float = 0.0
    work_ms: float = 0.0
    followed: Followed | None = None
    number: int = 0


class _Pace:
    """How fast frames come and how late, measured anew every second.

    From one frame to another: of slow frames a second holds none, one or two by chance.
    """

    def __init__(self, counts: Counts) -> None:
        self.rate_hz = 0.0
        self.latency_ms: float | None = None
        self._counts = counts
        self._latencies_ms: deque[float] = deque(maxlen=12)
        self._received: int | None = None
        self._since_s = time.monotonic()

    def is_measured(self, frame: TimedFrame | None) -> bool:
        """Take the newest frame, or that there is none now; whether something was measured."""
        now_s = time.monotonic()
        passed_s = now_s - self._since_s
        if frame is None:
            if passed_s <= SILENT_S:
                return False
            self.rate_hz, self.latency_ms = 0.0, None
            self._latencies_ms.clear()  # of frames long gone
            self._received, self._since_s = None, now_s
            return True
        if frame.latency_ms is not None:
            self._latencies_ms.append(frame.latency_ms)
        received, before = frame.index - self._counts.dropped, self._received
        goes_on = before is not None and received > before  # else a file has begun again
        if goes_on and passed_s <= PACE_S:
            return False
        if before is not None and goes_on:
            self.rate_hz = (received - before) / passed_s
            self.latency_ms = median(self._latencies_ms) if self._latencies_ms else None
        self._received, self._since_s = received, now_s
        return goes_on


class Watcher:
    """Follows one sensor and keeps the newest glimpse of it."""

    def __init__(self, where: str, unit: Calibration | None, captures: Path) -> None:
        self.where, self.unit, self.captures = where, unit, captures
        self.name = where.rpartition("@")[2] if "://" in where else Path(where).name
        self.title = unit.card.serial if unit else self.name
        self.glimpse: Glimpse | None = None
        self.error = ""
        self.trouble = ""
        """Why the last background was not taken; until another is asked for."""
        self.rate_hz = 0.0
        self.latency_ms: float | None = None
        self.newest: Newest | None = None
        self.history: deque[tuple[float, float, float]] = deque(maxlen=400)
        """Time in seconds, deepest point and contact area."""
        self.frame: Frame | None = None
        self.watched_s = 0.0
        self._unwarp = unit.unwarp if unit else None
        self._background: Frame | None = None
        self._follower: Follower | None = None
        self._view = PoseView()
        self._apart = is_dataset(where)  # no press of it can be followed to the next
        self._taken: list[Frame] | None = None
        self._saved = ""
        self._closed = threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True, name=where)

    def start(self) -> None:
        """Begin to follow the sensor."""
        self._thread.start()

    def close(self) -> None:
        """End the thread."""
        self._closed.set()
        self._thread.join()

    @property
    def remark(self) -> str:
        """What is wrong, or what a person should know, in a sentence."""
        return " ".join(words for words in (self._state, self.trouble) if words)

    @property
    def _state(self) -> str:
        """What is wrong with the stream, in a sentence."""
        newest = self.newest
        return self.error or ("" if newest is None else newest.source.counts.remark)

    @property
    def live(self) -> bool:
        """Whether frames come."""
        return not self.error and "lost" not in self._state and self.glimpse is not None

    def take_background(self) -> None:
        """Make the mean of the next frames the blank frame, and keep it."""
        self._taken, self.trouble = [], ""

    def saved(self) -> str:
        """A sentence on what was written since the last call, if anything."""
        sentence, self._saved = self._saved, ""
        return sentence

    def save_frame(self) -> str:
        """Keep the newest frame; a sentence on where.

        Raises:
            WedgeError: there is none yet, or the disk takes no more.
        """
        if self.frame is None:
            raise WedgeError(f"{self.title} has given no frame yet.")
        return self._write("press", self.frame)

    def _write(self, kind: str, frame: Frame) -> str:
        stamp = datetime.now().strftime("%Y%m%d-%H%M%S-%f")[:-3]
        path = self.captures / f"{kind}-{stamp}.png"
        write_image(path, frame)
        return f"Saved {path}"

    def _run(self) -> None:
        while not self._closed.is_set():
            try:
                with Newest(open_live(self.where, repeat=True)) as newest:
                    self.newest = newest
                    self._follow(newest)
                self.error = f"{self.name} has ended."
            except WedgeError as error:
                self.error = str(error)
            except OSError as error:
                self.error = f"{self.name}: {error.strerror or error}."
            except Exception as error:  # a thread that ends in silence would leave the page waiting
                self.error = f"{self.name} failed by {type(error).__name__}: {error}."
            self.newest = None
            self.rate_hz, self.latency_ms = 0.0, None
            self._closed.wait(AGAIN_S)

    def _follow(self, newest: Newest) -> None:
        reconstruct = self._prepared()
        pace = _Pace(newest.source.counts)
        while not self._closed.is_set():
            begun_s = time.monotonic()
            timed = newest.take(timeout_s=0.3)
            if pace.is_measured(timed):
                self.rate_hz, self.latency_ms = pace.rate_hz, pace.latency_ms
            if timed is None:
                if newest.ended:
                    return
                continue
            self.frame = frame = timed.image()
            if not self._fits(frame):
                continue
            if self._background is None and self.unit is None:
                self._background = frame
            if self._collected(frame):
                reconstruct = self._prepared()
            if begun_s - self.watched_s < UNWATCHED_S:
                self.glimpse = self._look(reconstruct, frame)
            self.error = ""
            self._closed.wait(max(0.0, VIEW_S - (time.monotonic() - begun_s)))

    def _prepared(self) -> FastReconstructor | None:
        """For the blank frame that holds now; ``None`` without a unit."""
        if self.unit is None:
            return None
        self._follower, self._view = Follower(self.unit, self._background), PoseView()
        return FastReconstructor(self.unit, self._background)

    def _fits(self, frame: Frame) -> bool:
        """Whether the frame has the unit's size; where not, that is said until one has."""
        if self._unwarp is None:
            return True
        try:
            self._unwarp.check(frame)
        except WedgeError as error:
            self.error = str(error)
            return False
        return True

    def _collected(self, frame: Frame) -> bool:
        """Whether a new background is there now."""
        if self._taken is None:
            return False
        if self._taken and self._taken[0].shape != frame.shape:
            self._taken.clear()
        self._taken.append(frame)
        if len(self._taken) < BACKGROUND_FRAMES:
            return False
        background: Frame = np.mean(self._taken, axis=0).round().astype(np.uint8)
        self._taken = None
        try:
            self._saved = self._write("background", background)
        except (WedgeError, OSError) as error:
            self.trouble = f"The background was not taken: {error}"
            return False
        self._background = background
        self.history.clear()
        return True

    def _look(self, reconstruct: FastReconstructor | None, frame: Frame) -> Glimpse:
        number = self.glimpse.number + 1 if self.glimpse else 0
        raw = pictures.raw_picture(frame)
        if reconstruct is None:
            assert self._background is not None
            if self._background.shape != frame.shape:
                self._background = frame
            change = (frame.astype(np.float32) - self._background) / np.float32(255)
            shown = pictures.difference_picture(change, (1.0, 1.0))
            return Glimpse(raw=raw, difference=shown, number=number)
        start = time.perf_counter()
        touch = reconstruct(frame)
        work_ms = 1e3 * (time.perf_counter() - start)
        pitch_mm: Pair = touch.mm_per_px
        contact, deepest_mm = touch.contact, touch.deepest_mm
        before_mm = self.glimpse.scale_mm if self.glimpse else LEAST_SCALE_MM
        scale_mm = max(LEAST_SCALE_MM, 1.1 * deepest_mm, 0.985 * before_mm)
        contact_mm2 = float(contact.sum() * pitch_mm[0] * pitch_mm[1])
        self.history.append((time.monotonic(), deepest_mm, contact_mm2))
        assert self._follower is not None
        if self._apart:
            self._follower.begin_anew()
        return Glimpse(
            followed=self._view(self._follower(frame, touch, time.monotonic())),
            raw=raw,
            difference=pictures.difference_picture(touch.difference, pitch_mm),
            depth=pictures.depth_picture(touch.depth_mm, contact, scale_mm, pitch_mm),
            surface=pictures.surface(touch.depth_mm, scale_mm, STEEPNESS, pitch_mm),
            scale_mm=scale_mm,
            deepest_mm=deepest_mm,
            contact_mm2=contact_mm2,
            work_ms=work_ms,
            number=number,
        )
