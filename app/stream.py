# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""`wedge stream`: what comes from a sensor, one line per second."""

import sys
import time
from collections import Counter
from collections.abc import Iterator
from contextlib import nullcontext
from dataclasses import dataclass, field
from pathlib import Path
from statistics import median
from typing import TYPE_CHECKING, Annotated, Any

import tyro

from app._gel import flat_remarks
from app._output import OutputFile, keep_inputs
from app._sources import Rate, open_live, refuse_few, unit_of
from sensor.errors import WedgeError
from sensor.files import check_outputs, write_json
from sensor.interrupt import UntilInterrupted

if TYPE_CHECKING:
    from recon.calibration import Calibration
    from recon.fast import FastReconstructor, Touch
    from recon.rerun_file import RerunFile
    from recon.stream import Counts, Newest, TimedFrame

LINE_S = 1.0


def main(
    where: Annotated[tyro.conf.Positional[str], tyro.conf.arg(metavar="WHERE")],
    unit: Annotated[Path | None, tyro.conf.arg(metavar="UNIT")] = None,
    seconds: float | None = None,
    mcap: Annotated[Path | None, tyro.conf.arg(metavar="FILE.mcap")] = None,
    rerun: Annotated[Path | None, tyro.conf.arg(metavar="FILE.rrd")] = None,
    json: OutputFile = None,
) -> None:
    """Watch a stream: frames per second, latency, losses, damage and, with a unit, the touch.

    One line per second is printed until the stream ends, or Ctrl-C or SIGTERM ends it.

    Only the newest frame is processed: "skipped" counts frames that came while the one before was
    processed, "dropped" frames that the Pi's server had but did not send, "corrupt" frames that
    came damaged. What the camera or its encoder loses before is not counted, but the Pi's /health
    then reports a lower rate than was set. "Connections" is shown once a stream was lost and
    connected again, and counts the first one too. "Stands still" means that every frame is the same
    to the last bit, which no working camera produces. Latency is the time from the sensor's first
    row to the whole frame here; it is unknown unless the clocks of the Pi and of this machine
    agree. Frames that no gel could produce are reported and counted.

    A dataset gives its blank frames, then its labelled presses or, if it has none, all its
    pictures, one per second.

    Example: wedge stream http://10.55.0.1:8080 --unit units/wedge-001 --mcap felt.mcap

    Args:
        where: http://HOST:PORT/PATH, usb:0, a video, a folder, a dataset, or an MCAP file.
        unit: A unit folder: depth is reconstructed from each frame. A recording brings its own.
        seconds: Stop after this many seconds.
        mcap: Follow the touched object and a marker gel's dots, and write poses, touched points and
            shifts here for Foxglove and RViz. Needs the unit. `wedge record` keeps frames.
        rerun: Write frames, depth and latency here for Rerun's viewer (the extra `rerun`).
        json: Write the numbers of the last line here as JSON.
    """
    from recon.stream import Newest, refuse_other_name

    if mcap is not None:
        refuse_other_name(mcap)
    check_outputs(json, mcap, rerun)
    keep_inputs([where, unit], [json, mcap, rerun])
    refuse_few("seconds", seconds)
    with unit_of(where, unit) as folder:
        reconstruct = None
        if folder is not None:
            from recon.fast import FastReconstructor

            reconstruct = FastReconstructor.load(folder)
        with (
            _felt_file(mcap, reconstruct) as felt,
            _rerun_file(rerun) as log,
            Newest(open_live(where)) as newest,
        ):
            print(f"{newest.source.name} (Ctrl-C ends)", file=sys.stderr)
            last = _watch(newest, reconstruct, seconds, felt, log)
    write_json(json, last)


class FeltFile:
    """What a sensor feels, followed frame after frame and kept in a file."""

    def __init__(self, path: Path, unit: "Calibration") -> None:
        from recon.follower import Follower
        from recon.touch_file import TouchFile

        self._follow = Follower(unit)
        self._file = TouchFile(path, self._follow.gel)
        self.pose = self.markers = self.doubt = ""
        """What the newest frame says, in words."""

    def __enter__(self) -> "FeltFile":
        return self

    def __exit__(self, *_: object) -> None:
        self._file.close()

    def add(self, frame: "TimedFrame", touch: "Touch") -> None:
        """Take in the next frame and what was reconstructed of it."""
        felt = self._follow(frame.image(), touch, time.monotonic())
        self._file.add(frame.time_ns, felt.touch, felt.pose, felt.dots)
        self.pose = felt.pose.words
        self.markers, self.doubt = felt.markers, felt.doubt


def _felt_file(
    path: Path | None, reconstruct: "FastReconstructor | None"
) -> "FeltFile | nullcontext[None]":
    if path is None:
        return nullcontext()
    if reconstruct is None:
        raise WedgeError(
            f"{path} needs a unit to record what is felt: name the sensor's with --unit."
        )
    for remark in flat_remarks(reconstruct.calibration):
        print(remark, file=sys.stderr)
    return FeltFile(path, reconstruct.calibration)


def _rerun_file(path: Path | None) -> "RerunFile | nullcontext[None]":
    if path is None:
        return nullcontext()
    from recon.rerun_file import RerunFile

    return RerunFile(path)


def _watch(
    newest: "Newest",
    reconstruct: "FastReconstructor | None",
    seconds: float | None,
    felt: "FeltFile | None",
    log: "RerunFile | None",
) -> dict[str, Any]:
    """Print a line a second; the numbers of the last one."""
    from recon.plausible import doubt_word

    rate, line_s = Rate(), time.monotonic()
    touch: Touch | None = None
    before: TimedFrame | None = None
    since, shown, looked, misfit = _Since(), _Since(), 0, ""
    doubts: Counter[str] = Counter()
    until = UntilInterrupted(_taken(newest, seconds))
    for frame in until:
        if frame is not None:
            begun = time.perf_counter()
            if reconstruct is not None:
                touch, misfit = _felt(reconstruct, frame, newest.source.counts, touch)
            if touch is not None and not misfit:
                if felt is not None:
                    felt.add(frame, touch)
                    doubts[felt.doubt] += 1
                elif reconstruct is not None:
                    doubts[doubt_word(touch, reconstruct.calibration)] += 1
            since.add(frame, before, 1e3 * (time.perf_counter() - begun))
            before, looked = frame, looked + 1
            if log is not None and not misfit:
                log.add(frame, touch)
            rate.tick()
        if newest.ended or time.monotonic() - line_s >= LINE_S:
            print(_text(_numbers(newest, rate, since, doubts, touch, felt, misfit)), flush=True)
            since, shown, line_s = _Since(), since, time.monotonic()
    if looked == 0:
        if until.interrupted:
            until.give_up()
        said = newest.source.counts.no_frame(newest.source.name)
        raise WedgeError(f"{said} The last one: {newest.flaw}" if newest.flaw else said)
    since = since if since.busy_ms else shown
    return _numbers(newest, rate, since, doubts, touch, felt, misfit)


def _taken(newest: "Newest", seconds: float | None) -> "Iterator[TimedFrame | None]":
    """The newest frame, or none for a moment, until the source or the time is over."""
    begun = time.monotonic()
    while seconds is None or time.monotonic() - begun < seconds:
        yield newest.take(timeout_s=0.2)
        if newest.ended:
            return


def _felt(
    reconstruct: "FastReconstructor", frame: "TimedFrame", counts: "Counts", before: "Touch | None"
) -> tuple["Touch", str]:
    """The touch in a frame; of one that cannot be used the touch before, and why, and it counts.

    Raises:
        WedgeError: the first one cannot be used.
    """
    try:
        return reconstruct(frame), ""
    except WedgeError as error:
        if before is None:
            raise
        counts.add_corrupt()
        return before, str(error)


@dataclass
class _Since:
    """What came since the last line."""

    latencies_ms: list[float] = field(default_factory=list)
    busy_ms: list[float] = field(default_factory=list)
    moved: list[bool] = field(default_factory=list)
    """Whether a frame was another than the one before; no camera's is the same to the last bit."""

    def add(self, frame: "TimedFrame", before: "TimedFrame | None", busy_ms: float) -> None:
        """Count one frame."""
        import numpy as np

        self.busy_ms.append(busy_ms)
        if frame.latency_ms is not None:
            self.latencies_ms.append(frame.latency_ms)
        if before is not None:
            self.moved.append(not np.array_equal(before.image(), frame.image()))


def _numbers(
    newest: "Newest",
    rate: Rate,
    since: _Since,
    doubts: Counter[str],
    touch: "Touch | None",
    felt: "FeltFile | None",
    misfit: str,
) -> dict[str, Any]:
    """What is said of the newest frame, and of all.

    Args:
        newest: where frames come from.
        rate: of those that were looked at.
        since: the line before.
        doubts: frames by the word for their doubt.
        touch: of the newest frame that could be used.
        felt: what is followed, if anything is.
        misfit: why the newest frame could not be used; empty where it could.
    """
    counts = newest.source.counts
    if counts.lost:  # what was felt before says nothing of now
        touch = felt = None
    of = sum(doubts.values())
    doubted = (f"In {count} of {of} frames, {word}." for word, count in doubts.items() if word)
    return {
        "received": counts.received,
        "rate_hz": rate.hz,
        "latency_ms": median(since.latencies_ms) if since.latencies_ms else None,
        "work_ms": median(since.busy_ms) if since.busy_ms else None,
        "skipped": newest.skipped,
        "dropped": counts.dropped,
        "corrupt": counts.corrupt,
        "connections": counts.connections,
        "stands_still": bool(since.moved) and not any(since.moved),
        "remark": " ".join(filter(None, (newest.remark, misfit, *doubted))),
        "deepest_mm": None if touch is None or misfit else touch.deepest_mm,
        "contact_mm2": None if touch is None or misfit else touch.contact_mm2,
        "pose": None if felt is None else felt.pose,
        "markers": None if felt is None else felt.markers,
    }


def _text(numbers: dict[str, Any]) -> str:
    latency = numbers["latency_ms"]
    words = [
        f"{numbers['rate_hz']:5.1f} frames/s",
        "latency unknown" if latency is None else f"latency {latency:5.1f} ms",
        f"skipped {numbers['skipped']}",
        f"dropped {numbers['dropped']}",
        f"corrupt {numbers['corrupt']}",
    ]
    if numbers["connections"] > 1:
        words.append(f"connections {numbers['connections']}")
    if numbers["deepest_mm"] is not None:
        words += [
            f"deepest {numbers['deepest_mm']:.2f} mm",
            f"contact {numbers['contact_mm2']:.1f} mm²",
        ]
    if numbers["pose"] is not None:
        words += [f"pose {numbers['pose']}", f"markers {numbers['markers']}"]
    if numbers["stands_still"]:
        words.append("stands still")
    return "  ".join(words) + (f"  [{numbers['remark']}]" if numbers["remark"] else "")
