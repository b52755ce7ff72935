# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Recordings: MCAP with ROS 2 images as they came, and the unit's calibration inside."""

import re
import threading
import time
from collections.abc import Collection, Iterator, Mapping
from pathlib import Path
from typing import Any

from recon.stream.frame import Counts, TimedFrame
from recon.stream.jpeg import START, encode_jpeg
from recon.stream.mcap_file import MAGIC, McapFile, mcap_records
from recon.stream.mcap_reading import Damage, read_records
from recon.stream.ros import COMPRESSED_IMAGE, FORMAT, CompressedImage
from sensor.closing import Closing
from sensor.dataset import LENS_FILE
from sensor.errors import WedgeError, printable
from sensor.unit import BACKGROUND_FILE, DESIGN_FILE, GRADIENTS_FILE, UNIT_FILE, refuse_no_unit
from sensor.wire import NS_PER_S

UNIT_FILES = (UNIT_FILE, BACKGROUND_FILE, GRADIENTS_FILE, LENS_FILE, DESIGN_FILE)
"""Attached as SENSOR/unit.toml and so on."""
RECORDED_QUALITY = 95
"""Of frames that were no JPEGs before."""
END_OF_TIME_NS = 2**31 * NS_PER_S
"""The last stamp of a header whose seconds are an int32; none is before the Unix epoch either."""
ENDING = ".mcap"
"""Of a recording's name, in small letters or capitals."""
UNTIMED = {"clock": "none"}
"""A channel's metadata where its source said of no frame when it was taken."""
_NAME = re.compile(r"[a-z][a-z0-9_]*")


def is_recording(where: str | Path) -> bool:
    """Whether a name is that of a recording."""
    return Path(where).suffix.lower() == ENDING


def topic(sensor: str) -> str:
    """Where the images of a sensor are, as image_transport names it."""
    return f"/{sensor}/image_raw/compressed"


def refuse_other_name(path: Path) -> None:
    """Refuse to call a recording what those who open it would not take for one.

    Raises:
        WedgeError: says how to call it.
    """
    if not is_recording(path):
        raise WedgeError(
            f"{path} is not a name for a recording: call it {path.stem}.mcap, as readers expect."
        )


class Recorder(Closing):
    """Writes frames of one or several sensors to a new file."""

    def __init__(
        self, path: Path, units: Mapping[str, Path | None], untimed: Collection[str] = ()
    ) -> None:
        """Begin a recording.

        Args:
            path: of the file, which must not exist yet.
            units: the unit folder of each sensor, by the sensor's name; ``None`` where it has none.
            untimed: the sensors whose sources do not say when a frame was taken.

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
            sensor: self._file.add_channel(
                topic(sensor), COMPRESSED_IMAGE, UNTIMED if sensor in untimed else {}
            )
            for sensor in units
        }
        self._untimed, self._begun_ns = frozenset(untimed), time.time_ns()
        self._lock = threading.Lock()

    def add(self, sensor: str, frame: TimedFrame) -> None:
        """Append a frame.

        Raises:
            WedgeError: the disk is full.
        """
        jpeg = frame.jpeg or encode_jpeg(frame.image(), RECORDED_QUALITY)
        image = CompressedImage(
            time_ns=frame.time_ns, frame_id=f"{sensor}_optical_frame", format=FORMAT, data=jpeg
        )
        # Players go by the log's times: a clip that is read in no time still plays at its pace.
        log_ns = frame.arrived_ns
        if sensor in self._untimed:
            log_ns = self._begun_ns + frame.time_ns
        with self._lock:
            channel = self._channels[sensor]
            self._file.add_message(channel, image.to_cdr(), log_ns, frame.time_ns)
            self.frames += 1

    def kept(self, sensor: str) -> int:
        """Frames of a sensor that are on the disk."""
        with self._lock:
            return self._file.kept.get(self._channels[sensor], 0)

    def close(self) -> None:
        """Finish the file."""
        with self._lock:
            self._file.close()


class McapSource(Closing):
    """The JPEGs of one topic of an MCAP file; one that is damaged gives those that are whole."""

    live = False

    def __init__(self, path: Path, sensor: str | None = None) -> None:
        """Look into the file.

        Args:
            path: an MCAP file of ours, or any with compressed images of ROS 2.
            sensor: whose frames, or their topic; by default those of the first.

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
        topics: set[str] = set()
        schemas: dict[int, str] = {}
        self._topic: str | None = None
        self._channels: set[int] = set()
        self.timed = True  # of others' recordings too
        self._unit_is_damaged = False
        for record in self._records():
            kind = type(record).__name__
            if isinstance(record, Damage):
                self._unit_is_damaged |= record.attachment
            elif kind == "Attachment":
                attached[record.name] = record.data
            elif kind == "Schema":
                schemas[record.id] = record.name
            elif kind == "Channel" and _is_image(record, schemas.get(record.schema_id)):
                wanted = sensor is None or record.topic in (sensor, topic(sensor))
                if wanted and self._topic is None:
                    self._topic = record.topic
                    self._channels = {record.id}  # it may first be told of in the index
                    self.timed = not record.metadata.items() >= UNTIMED.items()
                topics.add(str(record.topic))
            elif kind == "Message" and self._topic:
                break
        if self._topic is None:
            if topics:
                inside = printable(", ".join(sorted(topics)))
                raise WedgeError(f"{path} has no images of {sensor}, but {inside}.")
            if self.counts.remark:
                raise WedgeError(f"{path} broke off or is damaged before its first frame.")
            raise WedgeError(f"{path} has no topic with compressed images.")
        if sensor is None and (others := topics - {self._topic}):
            also = printable(", ".join(sorted(others)))
            self.counts.remark = f"{path} also holds {also}: `wedge replay --sensor` plays it."
        owner = self._topic.strip("/").partition("/")[0]
        self.unit = {
            name: attached[f"{owner}/{name}"]
            for name in UNIT_FILES
            if f"{owner}/{name}" in attached
        }

    def close(self) -> None:
        """End the iteration, from whichever thread."""
        self._closed.set()

    def save_unit(self, folder: Path) -> Path | None:
        """Write the unit that is inside into an empty folder; ``None`` where there is none.

        Raises:
            WedgeError: it is damaged.
        """
        if self._unit_is_damaged:
            raise WedgeError(f"the unit inside {self.name} is damaged: name its unit folder.")
        if UNIT_FILE not in self.unit:
            return None
        for name, content in self.unit.items():
            (folder / name).write_bytes(content)
        return folder

    def __iter__(self) -> Iterator[TimedFrame]:
        """Give each frame in the order of the file."""
        channels, index = set(self._channels), 0
        for record in self._records():
            if self._closed.is_set():
                return
            kind = type(record).__name__
            if isinstance(record, Damage):
                self.counts.add_corrupt(record.lost(channels))
            elif kind == "Channel" and record.topic == self._topic:
                channels.add(record.id)
            elif kind == "Message" and record.channel_id in channels:
                try:
                    image = CompressedImage.from_cdr(record.data)
                except ValueError:
                    image = None
                if image is None or not 0 <= image.time_ns < END_OF_TIME_NS:
                    self.counts.add_corrupt()
                    continue
                if not image.data.startswith(START) and "jpeg" not in image.format.lower():
                    self.counts.add_corrupt()
                    self.counts.remark = (
                        f"{self._path} has images in {image.format or 'no known format'}; only "
                        "JPEGs are read."
                    )
                    continue
                self.counts.received += 1
                yield TimedFrame(
                    index=index,
                    time_ns=image.time_ns,
                    arrived_ns=record.log_time,
                    clock="file",
                    jpeg=image.data,
                )
                index += 1

    def _records(self) -> Iterator[Any]:
        """Every record that is whole, and ``Damage`` in the place of others.

        Raises:
            WedgeError: it is no MCAP file.
        """
        try:
            if self._path.is_fifo():
                raise WedgeError(f"{self._path} is a pipe: name a file.")
            with self._path.open("rb") as stream:
                if stream.read(len(MAGIC)) != MAGIC:
                    raise WedgeError(f"{self._path} is not an MCAP file.")
                for record in read_records(stream):
                    if isinstance(record, Damage):
                        self.counts.remark = f"{self._path} " + (
                            "broke off or is damaged: everything before that is used."
                            if record.rest
                            else "is damaged in places: everything else is used."
                        )
                    yield record
        except OSError as error:
            raise WedgeError(f"{self._path} cannot be read: {error.strerror}.") from error


def _is_image(channel: Any, schema: str | None) -> bool:
    """Whether a channel has compressed images; by its topic where its schema is damaged."""
    compressed = (
        str(channel.topic).endswith("/compressed")
        if schema is None
        else schema.replace("/msg/", "/") == "sensor_msgs/CompressedImage"
    )
    return channel.message_encoding == "cdr" and compressed


def _unit_files(sensor: str, folder: Path) -> dict[str, bytes]:
    if not (folder / UNIT_FILE).is_file():
        refuse_no_unit(folder)
    files = {name: folder / name for name in UNIT_FILES if (folder / name).is_file()}
    return {f"{sensor}/{name}": path.read_bytes() for name, path in files.items()}
