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

from app._remarks import background_remarks
from app._sources import is_dataset, open_live
from app.pages import pictures
from app.pages.blank import BlankTaker
from app.pages.following import Followed, PoseView
from recon.arrays import Frame
from recon.calibration import Calibration
from recon.fast import FastReconstructor
from recon.follower import Follower
from recon.geometry.unwarp import EVEN_ONLY
from recon.images import GRAY, write_image
from recon.stream import Counts, Newest, TimedFrame, shown_address
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
STILL_S = 2.0
"""With the same frame for so long, to the last bit, a camera hangs: none is without noise."""
HISTORY_LENGTH = 400
LEAST_SCALE_MM = 0.3
STEEPNESS = 3.0


@dataclass(frozen=True, kw_only=True)
class Glimpse:
    """What the page shows of one moment; pictures as data URLs."""

    raw: str
    taken_s: float
    """When its frame was taken over, as ``time.monotonic`` tells it."""
    difference: str | None = None
    """``None`` where the frame does not fit the unit."""
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
        self.name = shown_address(where) if "://" in where else Path(where).name
        self.title = unit.card.serial if unit else self.name
        self.glimpse: Glimpse | None = None
        self.error = ""
        """Why no frames come."""
        self.misfit = ""
        """Why the frames that come tell no depth."""
        self.trouble = ""
        """Why the last background was not taken; until another is asked for."""
        self.background_remark = ""
        """How the background differs from the unit's own; until there is another."""
        self.stands_still = False
        self.message = (0, "")
        """The newest sentence on what was done, and its number: every tab shows it once."""
        self.rate_hz = 0.0
        self.latency_ms: float | None = None
        self.newest: Newest | None = None
        self.history: tuple[tuple[float, float, float], ...] = ()
        """Time in seconds, deepest point, contact area; replaced, as others read it meanwhile."""
        self.frame: Frame | None = None
        self.watched_s = 0.0
        self._unwarp = unit.unwarp if unit else None
        self._background: Frame | None = None
        self._follower: Follower | None = None
        self.apart = is_dataset(where)
        """Whether no frame can be followed to the next."""
        self._view = PoseView(self.apart)
        self._taker: BlankTaker | None = None
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
        newest = self.newest
        still = f"{self.name} stands still: does its camera hang? Restart its server."
        said = (
            self.error or ("" if newest is None else newest.remark),
            self.misfit if self.live else "",
            still if self.stands_still and self.live else "",
            self.trouble,
            self.background_remark,
        )
        return " ".join(words for words in said if words)

    @property
    def live(self) -> bool:
        """Whether frames come that can be shown."""
        newest = self.newest
        comes = newest is not None and not newest.source.counts.lost and not newest.all_damaged
        return comes and not self.error and self.glimpse is not None

    def take_background(self) -> None:
        """Make the mean of the next frames the blank frame, and keep it.

        Raises:
            WedgeError: no frames come, or none that fit the unit.
        """
        newest = self.newest
        if newest is None or not self.live or self.misfit:
            raise WedgeError(
                f"{self.title} gives no frames now{' that fit' if self.misfit else ''}: "
                "no background is taken."
            )
        self.trouble, self._taker = "", BlankTaker(newest.source.counts.connections)

    def save_frame(self) -> str:
        """Keep the newest frame; a sentence on where.

        Raises:
            WedgeError: none comes now, or the disk takes no more.
        """
        if self.frame is None or not self.live:
            raise WedgeError(f"{self.title} gives no frames now: nothing is saved.")
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
                self.error = f"{self.name} failed with {type(error).__name__}: {error}."
            self.newest = None
            self.rate_hz, self.latency_ms = 0.0, None
            self._drop("the connection broke off meanwhile.")
            self._closed.wait(AGAIN_S)

    def _follow(self, newest: Newest) -> None:
        reconstruct = self._prepared()
        counts = newest.source.counts
        pace, changed_s = _Pace(counts), time.monotonic()
        while not self._closed.is_set():
            begun_s = time.monotonic()
            timed = newest.take(timeout_s=0.3)
            if pace.is_measured(timed):
                self.rate_hz, self.latency_ms = pace.rate_hz, pace.latency_ms
            if timed is None:
                if newest.ended:
                    return
                if self._has_new_blank(None, counts.connections):
                    reconstruct = self._prepared()
                continue
            taken_s, before, frame = time.monotonic(), self.frame, timed.image()
            if before is None or not np.array_equal(before, frame):
                changed_s = taken_s
            self.frame, self.stands_still = frame, taken_s - changed_s > STILL_S
            self.misfit = self._misfit_of(frame)
            if self.misfit:
                self._drop(self.misfit)
            elif self._background is None and self.unit is None:
                self._background = frame
            if self._has_new_blank(frame, counts.connections):
                reconstruct = self._prepared()
            if begun_s - self.watched_s < UNWATCHED_S:
                self.glimpse = self._look(reconstruct, frame, taken_s)
            self.error = ""
            self._closed.wait(max(0.0, VIEW_S - (time.monotonic() - begun_s)))

    def _prepared(self) -> FastReconstructor | None:
        """For the blank frame that holds now; ``None`` without a unit."""
        if self.unit is None:
            return None
        self._follower, self._view = Follower(self.unit, self._background), PoseView(self.apart)
        return FastReconstructor(self.unit, self._background)

    def _misfit_of(self, frame: Frame) -> str:
        """That the frame has not the unit's size, or no colours, in a sentence, if so."""
        if self._unwarp is None:
            return ""
        try:
            self._unwarp.check_colored(frame)
        except WedgeError as error:
            fault = str(error)
            if fault != GRAY and EVEN_ONLY not in fault:
                fault = f"{fault[:-1]}: use the right unit, or the camera mode of the calibration."
            return f"{self.name}: {fault}"
        return ""

    def _has_new_blank(self, frame: Frame | None, connection: int) -> bool:
        """Whether a new background is there now, with the newest frame or without one."""
        if self._taker is None:
            return False
        try:
            background = self._taker.add(frame, connection)
            if background is None:
                return False
            words = self._write("background", background)
        except (WedgeError, OSError) as error:
            self._drop(str(error))
            return False
        if self.unit is not None:
            self.background_remark = " ".join(
                background_remarks(self.unit, background, "The background")
            )
        self.message = (self.message[0] + 1, words)
        self._background, self._taker, self.history = background, None, ()
        return True

    def _drop(self, why: str) -> None:
        """Take no background, where one was asked for."""
        if self._taker is not None:
            self._taker, self.trouble = None, f"The background was not taken: {why}"

    def _look(self, reconstruct: FastReconstructor | None, frame: Frame, taken_s: float) -> Glimpse:
        number = self.glimpse.number + 1 if self.glimpse else 0
        raw = pictures.raw_picture(frame)
        if self.misfit:
            return Glimpse(raw=raw, taken_s=taken_s, number=number)
        if reconstruct is None:
            assert self._background is not None
            if self._background.shape != frame.shape:
                self._background = frame
            change = (frame.astype(np.float32) - self._background) / np.float32(255)
            shown = pictures.difference_picture(change, (1.0, 1.0))
            return Glimpse(raw=raw, taken_s=taken_s, difference=shown, number=number)
        start = time.perf_counter()
        touch = reconstruct(frame)
        work_ms = 1e3 * (time.perf_counter() - start)
        pitch_mm: Pair = touch.mm_per_px
        contact, deepest_mm = touch.contact, touch.deepest_mm
        before_mm = self.glimpse.scale_mm if self.glimpse else LEAST_SCALE_MM
        scale_mm = max(LEAST_SCALE_MM, 1.1 * deepest_mm, 0.985 * before_mm)
        contact_mm2 = touch.contact_mm2
        kept = self.history[1 - HISTORY_LENGTH :]
        self.history = (*kept, (taken_s, deepest_mm, contact_mm2))
        assert self._follower is not None
        if self.apart:
            self._follower.begin_anew()
        return Glimpse(
            followed=self._view(self._follower(frame, touch, time.monotonic())),
            raw=raw,
            taken_s=taken_s,
            difference=pictures.difference_picture(touch.difference, pitch_mm),
            depth=pictures.depth_picture(touch.depth_mm, contact, scale_mm, pitch_mm),
            surface=pictures.surface(touch.depth_mm, scale_mm, STEEPNESS, pitch_mm),
            scale_mm=scale_mm,
            deepest_mm=deepest_mm,
            contact_mm2=contact_mm2,
            work_ms=work_ms,
            number=number,
        )
