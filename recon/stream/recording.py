# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Recordings: MCAP with ROS 2 images as they came, and the unit's calibration inside."""

import re
import struct
import threading
import time
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from recon.stream.frame import Counts, TimedFrame
from recon.stream.jpeg import encode_jpeg
from recon.stream.mcap_file import MAGIC, McapFile, mcap_records
from recon.stream.ros import COMPRESSED_IMAGE, FORMAT, CompressedImage
from sensor.dataset import LENS_FILE
from sensor.errors import WedgeError
from sensor.unit import BACKGROUND_FILE, GRADIENTS_FILE, refuse_no_unit

UNIT_FILES = ("unit.toml", BACKGROUND_FILE, GRADIENTS_FILE, LENS_FILE)
"""Attached as SENSOR/unit.toml and so on."""
LARGEST_RECORD = 256 << 20
RECORDED_QUALITY = 95
"""Of frames that were no JPEGs before."""
_NAME = re.compile(r"[a-z][a-z0-9_]*")


def topic(sensor: str) -> str:
    """Where the images of a sensor are, as image_transport names it."""
    return f"/{sensor}/image_raw/compressed"


class Recorder:
    """Writes frames of one or several sensors to a new file."""

    def __init__(self, path: Path, units: Mapping[str, Path | None]) -> None:
        """Begin a recording.

        Args:
            path: of the file, which must not exist yet.
            units: the unit folder of each sensor, by the sensor's name; ``None`` where it has none.

        Raises:
            WedgeError: a name cannot be part of a topic, a unit folder cannot be read, or the file
                cannot be written.
        """
        attached: dict[str, bytes] = {}
        for sensor, folder in units.items():
            if not _NAME.fullmatch(sensor):
                raise WedgeError(f"{sensor!r} cannot name a sensor: use a-z, 0-9 and _.")
            attached |= {} if folder is None else _unit_files(sensor, folder)
        self.frames = 0
        self._file = McapFile(path, attached)
        self._channels = {
            sensor: self._file.add_channel(topic(sensor), COMPRESSED_IMAGE) for sensor in units
        }
        self._lock = threading.Lock()

    def __enter__(self) -> "Recorder":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def add(self, sensor: str, frame: TimedFrame) -> None:
        """Append a frame.

        Raises:
            WedgeError: the disk is full.
        """
        jpeg = frame.jpeg or encode_jpeg(frame.image(), RECORDED_QUALITY)
        image = CompressedImage(
            time_ns=frame.time_ns, frame_id=f"{sensor}_optical_frame", format=FORMAT, data=jpeg
        )
        with self._lock:
            channel = self._channels[sensor]
            self._file.add_message(channel, image.to_cdr(), frame.arrived_ns, frame.time_ns)
            self.frames += 1

    def close(self) -> None:
        """Finish the file."""
        with self._lock:
            self._file.close()


class McapSource:
    """The JPEGs of one topic of an MCAP file; one that broke off gives what it has."""

    live = False

    def __init__(self, path: Path, sensor: str | None = None) -> None:
        """Look into the file.

        Args:
            path: an MCAP file of ours, or any with compressed images of ROS 2.
            sensor: whose frames; by default those of the first topic.

        Raises:
            WedgeError: it is no MCAP file, or has no such images, or mcap is not installed.
        """
        mcap_records()
        self.name = str(path)
        self.counts = Counts(connections=1)
        self._path = path
        self._closed = threading.Event()
        self.unit: dict[str, bytes] = {}
        """The files of the sensor's unit folder, where they are inside."""
        attached: dict[str, bytes] = {}
        others: set[str] = set()
        self._topic: str | None = None
        for record in self._records():
            kind = type(record).__name__
            if kind == "Attachment":
                attached[record.name] = record.data
            elif kind == "Channel" and _is_image(record):
                if sensor is None or record.topic == topic(sensor):
                    self._topic = record.topic
                others.add(str(record.topic).split("/")[1])
            if self._topic:
                break
        if self._topic is None:
            if others:
                inside = ", ".join(sorted(others))
                raise WedgeError(f"{path} has no {topic(str(sensor))}, but {inside}.")
            if self.counts.remark:
                raise WedgeError(f"{path} broke off or is damaged before its first frame.")
            raise WedgeError(f"{path} has no topic with compressed images.")
        owner = self._topic.split("/")[1]
        self.unit = {
            name: attached[f"{owner}/{name}"]
            for name in UNIT_FILES
            if f"{owner}/{name}" in attached
        }

    def __enter__(self) -> "McapSource":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """End the iteration, from whichever thread."""
        self._closed.set()

    def save_unit(self, folder: Path) -> Path | None:
        """Write the unit that is inside into an empty folder; ``None`` where there is none."""
        if "unit.toml" not in self.unit:
            return None
        for name, content in self.unit.items():
            (folder / name).write_bytes(content)
        return folder

    def __iter__(self) -> Iterator[TimedFrame]:
        """Give each frame in the order of the file."""
        channels: set[int] = set()
        for record in self._records():
            if self._closed.is_set():
                return
            kind = type(record).__name__
            if kind == "Channel" and record.topic == self._topic:
                channels.add(record.id)
            elif kind == "Message" and record.channel_id in channels:
                try:
                    image = CompressedImage.from_cdr(record.data)
                except ValueError:
                    self.counts.corrupt += 1
                    continue
                index, self.counts.received = self.counts.received, self.counts.received + 1
                yield TimedFrame(
                    index=index,
                    time_ns=image.time_ns,
                    arrived_ns=time.time_ns(),
                    jpeg=image.data,
                )

    def _records(self) -> Iterator[Any]:
        """Every record up to the file's end, or up to where it broke off.

        Raises:
            WedgeError: it is no MCAP file.
        """
        from mcap.exceptions import McapError
        from mcap.stream_reader import StreamReader

        try:
            with self._path.open("rb") as stream:
                if stream.read(len(MAGIC)) != MAGIC:
                    raise WedgeError(f"{self._path} is no MCAP file.")
                reader = StreamReader(
                    stream, skip_magic=True, emit_chunks=True, record_size_limit=LARGEST_RECORD
                )
                for record in reader.records:
                    if type(record).__name__ == "Chunk":
                        yield from _unpacked(record)
                    else:
                        yield record
        except OSError as error:
            raise WedgeError(f"{self._path} cannot be read: {error.strerror}.") from error
        except (McapError, struct.error, ValueError, EOFError, RuntimeError):
            self.counts.remark = (
                f"{self._path} broke off or is damaged: what it has up to there is here."
            )


def _unpacked(chunk: Any) -> list[Any]:
    from mcap.stream_reader import breakup_chunk

    if chunk.uncompressed_size > LARGEST_RECORD or chunk.compression not in ("", "zstd"):
        raise ValueError("a chunk too large, or packed in another way than zstd")
    return breakup_chunk(chunk, validate_crc=True)


def _is_image(channel: Any) -> bool:
    compressed = str(channel.topic).endswith("/compressed")
    return channel.message_encoding == "cdr" and compressed


def _unit_files(sensor: str, folder: Path) -> dict[str, bytes]:
    if not (folder / "unit.toml").is_file():
        refuse_no_unit(folder)
    files = {name: folder / name for name in UNIT_FILES if (folder / name).is_file()}
    return {f"{sensor}/{name}": path.read_bytes() for name, path in files.items()}
