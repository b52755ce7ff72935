# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""`wedge record`: streams to an MCAP file that other tools open."""

import sys
import threading
import time
from collections.abc import Collection, Iterator, Mapping
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import tyro

from app._output import OutputFile, keep_inputs
from app._sources import open_live, open_where, refuse_few, unit_of
from sensor.errors import WedgeError
from sensor.files import check_outputs, write_json
from sensor.interrupt import Asked
from sensor.unit import read_unit_card

if TYPE_CHECKING:
    from recon.stream import FrameSource, Recorder, TimedFrame


def main(
    where: Annotated[tyro.conf.Positional[tuple[str, ...]], tyro.conf.arg(metavar="WHERE...")],
    out: Annotated[Path, tyro.conf.arg(metavar="FILE.mcap")],
    unit: Annotated[tuple[Path, ...], tyro.conf.arg(metavar="UNIT...")] = (),
    seconds: float | None = None,
    json: OutputFile = None,
) -> None:
    """Record one or several streams to an MCAP file, as ROS 2 images with the units inside.

    JPEGs are kept unmodified, other frames become JPEGs of quality 95: sensor_msgs/CompressedImage
    on /wedge/image_raw/compressed (/wedge0, /wedge1, ... for several), stamped with their exposure
    time. Every frame is kept, none is skipped. Foxglove, ROS 2's tools and `wedge replay` open the
    file, even if the recorder was killed: at most the last second of frames is lost. A dataset
    gives its blank frames, then its labelled presses or, if it has none, all its pictures.

    Recording ends with the streams, after --seconds, or at Ctrl-C, SIGTERM or SIGHUP, which do not
    count as failures: everything received is in the file, and the exit status is 0.

    A lost stream is reported and retried; its connections are counted at the end. If a stream is
    missing at the start, nothing is recorded. If one fails later, the reason is reported, the
    others keep recording, and the exit status is 2; so it is if one of several is lost at the end.

    Example: wedge record http://10.55.0.1:8080 --unit units/wedge-001 --out touch.mcap

    Args:
        where: http://HOST:PORT/PATH, usb:0, a video, a folder, a dataset or a recording (.mcap);
            one or several.
        out: The file to write; it must not exist.
        unit: The unit folder of each stream, in the same order; without it, only frames are
            recorded. A recording brings its own.
        seconds: Stop after this many seconds.
        json: Write the numbers of frames here as JSON.
    """
    from recon.stream import Recorder, refuse_other_name

    if not where:
        raise WedgeError("no stream was named: wedge record WHERE... --out FILE.mcap.")
    if unit and len(unit) != len(where):
        raise WedgeError(
            f"streams: {len(where)}, units: {len(unit)}; name one unit for each stream, or none."
        )
    refuse_other_name(out)
    check_outputs(out, json)
    keep_inputs([*where, *unit], [json])
    refuse_few("seconds", seconds)
    sensors = ["wedge"] if len(where) == 1 else [f"wedge{i}" for i in range(len(where))]
    with ExitStack() as stack:
        open_one = open_where if len(where) == 1 else open_live
        named = {s: stack.enter_context(open_one(w)) for s, w in zip(sensors, where, strict=True)}
        folders = zip(where, unit or [None] * len(where), strict=True)
        inside = [stack.enter_context(unit_of(w, folder)) for w, folder in folders]
        units = dict(zip(sensors, inside, strict=True))
        sizes_px = {s: read_unit_card(u).frame_size_px for s, u in units.items() if u}
        untimed = [sensor for sensor, source in named.items() if not source.timed]
        notes: dict[str, str] = {}
        asked = stack.enter_context(Asked())
        with Recorder(out, units, untimed) as recorder:
            errors = _record(named, sizes_px, recorder, seconds, notes, asked)
        if any(map(recorder.kept, sensors)):
            _tell(named, recorder, notes, out, json)
        else:
            out.unlink()
            errors = errors or [_nothing_came(named.values())]
    if errors:
        raise errors[0]


def _nothing_came(sources: "Collection[FrameSource]") -> WedgeError:
    return WedgeError(
        f"no frame came from {', '.join(s.name for s in sources)}."
        + "".join(f" {s.counts.remark}" for s in sources if s.counts.remark)
    )


def _tell(
    sources: "dict[str, FrameSource]",
    recorder: "Recorder",
    notes: Mapping[str, str],
    out: Path,
    json: Path | None,
) -> None:
    """Print and write how many frames of each sensor are in the file, and what to know of them."""
    document = {
        sensor: {
            "received": source.counts.received,
            "recorded": recorder.kept(sensor),
            "dropped": source.counts.dropped,
            "corrupt": source.counts.corrupt,
            "connections": source.counts.connections,
            "remark": " ".join(filter(None, (source.counts.remark, notes.get(sensor, "")))),
        }
        for sensor, source in sources.items()
    }
    for sensor, told in document.items():
        lost = f"dropped {told['dropped']}, corrupt {told['corrupt']}"
        if sources[sensor].counts.connections > 1:
            lost += f", connections {told['connections']}"
        remark = f"  [{told['remark']}]" if told["remark"] else ""
        print(f"{told['recorded']} frames of {sensor}, {lost}{remark}")
    print(f"Recording: {out}")
    write_json(json, {"file": str(out), "sensors": document})


def _record(
    sources: "dict[str, FrameSource]",
    sizes_px: Mapping[str, tuple[int, int]],
    recorder: "Recorder",
    seconds: float | None,
    notes: dict[str, str],
    asked: Asked,
) -> list[Exception]:
    """Pass frames on, a thread for each source, until all end or one is to end; finish the file.

    Args:
        sources: by the sensors' names.
        sizes_px: what units are for.
        recorder: takes the frames.
        seconds: when to end.
        notes: of each sensor whose frames change their size, that they do; filled.
        asked: whether to end before.

    Returns:
        What failed.
    """
    errors: list[Exception] = []

    def pass_on(sensor: str) -> None:
        try:
            _pass_on(sensor, sources[sensor], sizes_px.get(sensor), recorder, notes)
        except Exception as error:  # else the stream would seem to have ended
            errors.append(error)
            if len(sources) > 1:
                _say(f"{sensor}: {error}")

    threads = [threading.Thread(target=pass_on, args=(name,), daemon=True) for name in sources]
    for thread in threads:
        thread.start()
    begun, news = time.monotonic(), _News(sources)
    try:
        while any(thread.is_alive() for thread in threads) and not asked.to_end:
            if seconds is not None and time.monotonic() - begun >= seconds:
                break
            threads[0].join(0.2) if threads[0].is_alive() else time.sleep(0.2)
            news.say()
            if sys.stderr.isatty():
                took_s = time.monotonic() - begun
                print(f"\r{took_s:6.1f} s  {recorder.frames} frames ", end="", file=sys.stderr)
    finally:
        gone = _lost(sources)
        for source in sources.values():
            source.close()
        for thread in threads:
            while thread.is_alive() and not asked.again:
                thread.join(0.2)
        if sys.stderr.isatty():
            print(file=sys.stderr)
    failed = errors + gone  # who is not waited for finds the file closed, which is no failure
    try:
        recorder.close()
    except WedgeError as error:
        failed.append(error)
    return failed


def _lost(sources: "Mapping[str, FrameSource]") -> list[Exception]:
    """That one of several streams gives nothing any more: who has the others may not notice."""
    if len(sources) == 1:
        return []
    return [
        WedgeError(f"when the recording ended, {sensor} was {source.counts.remark}")
        for sensor, source in sources.items()
        if source.counts.lost
    ]


def _pass_on(
    sensor: str,
    source: "FrameSource",
    unit_size_px: tuple[int, int] | None,
    recorder: "Recorder",
    notes: dict[str, str],
) -> None:
    """Record the frames of a source, its damaged ones left out and counted, until it ends."""
    size_px: tuple[int, int] | None = None
    for frame in _of_size(source, unit_size_px):
        now_px = frame.size_px
        if size_px and now_px and now_px != size_px and sensor not in notes:
            change = "from {}x{} to {}x{} pixels".format(*size_px, *now_px)
            notes[sensor] = f"The frame size changes, first {change}."
            _say(f"{sensor}: {notes[sensor]}")
        size_px = now_px or size_px
        if frame.flaw:
            source.counts.add_corrupt()
            source.counts.remark = source.counts.remark or frame.flaw
        else:
            recorder.add(sensor, frame)


class _News:
    """Says once what has happened to streams since they were opened."""

    def __init__(self, sources: "Mapping[str, FrameSource]") -> None:
        self._sources, self._said = sources, dict.fromkeys(sources, "")
        self._connections = {name: source.counts.connections for name, source in sources.items()}

    def say(self) -> None:
        """What is new, a line for each stream."""
        for sensor, source in self._sources.items():
            counts = source.counts
            if (remark := counts.remark) != self._said[sensor]:
                self._said[sensor] = remark
                _say(f"{sensor}: {remark or 'frames come.'}")
            elif counts.connections > self._connections[sensor] and not counts.lost:
                _say(f"{sensor}: the stream was lost and is connected again.")
            else:
                continue
            self._connections[sensor] = counts.connections


def _say(sentence: str) -> None:
    """Print a line of its own, below the numbers that a terminal shows."""
    print("\n" * sys.stderr.isatty() + sentence, file=sys.stderr)


def _of_size(source: "FrameSource", size_px: tuple[int, int] | None) -> "Iterator[TimedFrame]":
    """The frames of a source, the first whole one held against what its unit is for.

    Raises:
        WedgeError: it is of another size (width, height).
    """
    for frame in source:
        if size_px is not None:
            try:
                height, width = frame.image().shape[:2]
            except WedgeError:  # damaged within: the next one tells
                pass
            else:
                if (width, height) != size_px:
                    expected = f"{size_px[0]}x{size_px[1]}"
                    raise WedgeError(
                        f"{source.name} gives frames of {width}x{height} pixels, but its unit is "
                        f"for {expected}: name its own unit."
                    )
                size_px = None
        yield frame
