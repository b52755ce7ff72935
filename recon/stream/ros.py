# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""sensor_msgs/msg/CompressedImage of ROS 2 as bytes, without ROS.

CDR, little-endian: numbers lie at multiples of their size, counted after the four bytes of the
encapsulation (OMG DDS-XTypes, plain CDR).
"""

import struct
from dataclasses import dataclass

SCHEMA_NAME = "sensor_msgs/msg/CompressedImage"
SCHEMA = """std_msgs/Header header
string format
uint8[] data
================================================================================
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
================================================================================
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec
"""
FORMAT = "bgr8; jpeg compressed bgr8"
"""What image_transport's publisher writes: subscribers hand out bgr8 images."""
_LITTLE_ENDIAN = b"\0\1\0\0"
_NS_PER_S = 10**9


@dataclass(frozen=True, kw_only=True, slots=True)
class CompressedImage:
    """One message."""

    time_ns: int
    """Acquisition, since the Unix epoch."""
    frame_id: str
    format: str
    data: bytes

    def to_cdr(self) -> bytes:
        """The message as bytes."""
        out = bytearray(struct.pack("<iI", *divmod(self.time_ns, _NS_PER_S)))
        for text in (self.frame_id, self.format):
            coded = text.encode() + b"\0"
            out += b"\0" * (-len(out) % 4) + struct.pack("<I", len(coded)) + coded
        out += b"\0" * (-len(out) % 4) + struct.pack("<I", len(self.data))
        return _LITTLE_ENDIAN + bytes(out) + self.data

    @classmethod
    def from_cdr(cls, message: bytes) -> "CompressedImage":
        """The message that these bytes hold.

        Raises:
            ValueError: they hold none.
        """
        if len(message) < 12 or message[:2] not in (b"\0\1", b"\0\0"):
            raise ValueError("no CDR message")
        order = "<" if message[1] else ">"
        body = message[4:]
        seconds, nanoseconds = struct.unpack_from(f"{order}iI", body)
        at, texts = 8, []
        for _ in range(3):
            at += -at % 4
            if at + 4 > len(body):
                raise ValueError("the message ends too early")
            (length,) = struct.unpack_from(f"{order}I", body, at)
            at += 4 + length
            if at > len(body):
                raise ValueError("the message ends too early")
            texts.append(body[at - length : at])
        frame_id, form, data = texts
        return cls(
            time_ns=seconds * _NS_PER_S + nanoseconds,
            frame_id=frame_id.rstrip(b"\0").decode(errors="replace"),
            format=form.rstrip(b"\0").decode(errors="replace"),
            data=data,
        )
