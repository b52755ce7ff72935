# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""The wire format: how the sensor's Raspberry Pi sends frames, one JPEG a part, over HTTP.

A stream is an answer of type ``CONTENT_TYPE`` that begins with ``DELIMITER`` and goes on with
``part`` after ``part``. Each part ends with the next delimiter, so that a reader which knows no
Content-Length has its frame at once too.
"""

import re
from collections.abc import Mapping
from dataclasses import dataclass

DEFAULT_PORT = 8080
SIZES_PX = ((640, 480), (320, 240))
"""Width and height of the frames that the Pi sends."""
STREAM_PATH = "/stream.mjpg"
SNAPSHOT_PATH = "/snapshot.jpg"
SETTINGS_PATH = "/settings"
HEALTH_PATH = "/health"

BOUNDARY = "gelsight-wedge-frame"
CONTENT_TYPE = f"multipart/x-mixed-replace; boundary={BOUNDARY}"
DELIMITER = f"--{BOUNDARY}\r\n".encode()

TIMESTAMP_HEADER = "X-Timestamp"
"""Seconds since the Unix epoch, a decimal number, as mjpg_streamer and ustreamer send it."""
SENSOR_TIMESTAMP_HEADER = "X-Sensor-Timestamp"
"""Nanoseconds since the Pi was switched on (CLOCK_BOOTTIME): no setting of its clock moves it."""
INDEX_HEADER = "X-Frame-Index"
"""Counts what the camera gave since the server began, from 0: a step above 1 is a dropped frame."""

NS_PER_S = 1_000_000_000
CLOCK_SET_AFTER_NS = 1_735_689_600 * NS_PER_S
"""1 January 2025: a Pi that says it is earlier has not set its clock."""

_SECONDS = re.compile(r"([0-9]{1,10})(?:\.([0-9]{1,9}))?")
_WHOLE = re.compile(r"[0-9]{1,18}")


@dataclass(frozen=True)
class Stamp:
    """When a frame was taken, and which one it is; None is what the sender did not say.

    Both times are of the moment at which the sensor began to read the frame's first row.

    Attributes:
        timestamp_ns: Since the Unix epoch, by the sender's clock.
        sensor_timestamp_ns: Since the sender was switched on.
        index: Since the sender's server began.
    """

    timestamp_ns: int | None = None
    sensor_timestamp_ns: int | None = None
    index: int | None = None

    @property
    def clock_is_set(self) -> bool:
        """Whether ``timestamp_ns`` can be compared with another machine's clock."""
        return self.timestamp_ns is not None and self.timestamp_ns >= CLOCK_SET_AFTER_NS


def part(jpeg: bytes, stamp: Stamp) -> bytes:
    """One frame as it follows a ``DELIMITER``, with the next delimiter at its end."""
    return b"".join((part_head(len(jpeg), stamp), jpeg, b"\r\n", DELIMITER))


def part_head(length: int, stamp: Stamp) -> bytes:
    """The header lines of a part whose JPEG has ``length`` bytes, with the empty line."""
    lines = ["Content-Type: image/jpeg", f"Content-Length: {length}", *stamp_lines(stamp)]
    return ("\r\n".join(lines) + "\r\n\r\n").encode()


def stamp_lines(stamp: Stamp) -> list[str]:
    """The header lines of a stamp, those it knows."""
    lines = []
    if stamp.timestamp_ns is not None:
        seconds, rest = divmod(stamp.timestamp_ns, NS_PER_S)
        lines.append(f"{TIMESTAMP_HEADER}: {seconds}.{rest:09d}")
    if stamp.sensor_timestamp_ns is not None:
        lines.append(f"{SENSOR_TIMESTAMP_HEADER}: {stamp.sensor_timestamp_ns}")
    if stamp.index is not None:
        lines.append(f"{INDEX_HEADER}: {stamp.index}")
    return lines


def read_stamp(headers: Mapping[str, str]) -> Stamp:
    """The stamp in header lines of this server or another; nonsense counts as not said.

    mjpg_streamer sends 0.000000 where it was not told to stamp: that is not said either.

    Args:
        headers: Values by lower-case name, without blanks around them.
    """
    timestamp_ns = None
    if match := _SECONDS.fullmatch(headers.get(TIMESTAMP_HEADER.lower(), "")):
        whole, decimals = match.group(1), match.group(2) or ""
        timestamp_ns = int(whole) * NS_PER_S + int(decimals.ljust(9, "0")) or None
    return Stamp(
        timestamp_ns,
        _whole(headers, SENSOR_TIMESTAMP_HEADER),
        _whole(headers, INDEX_HEADER),
    )


def _whole(headers: Mapping[str, str], name: str) -> int | None:
    text = headers.get(name.lower(), "")
    return int(text) if _WHOLE.fullmatch(text) else None
