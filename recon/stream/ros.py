# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""sensor_msgs/msg/CompressedImage of ROS 2 as bytes, and back."""

import struct
from dataclasses import dataclass

from recon.stream.cdr import HEADER_DEFINITION, CdrWriter
from recon.stream.mcap_file import MessageType
from sensor.wire import NS_PER_S

COMPRESSED_IMAGE = MessageType(
    name="sensor_msgs/msg/CompressedImage",
    definition=f"std_msgs/Header header\nstring format\nuint8[] data\n{HEADER_DEFINITION}",
)
FORMAT = "bgr8; jpeg compressed bgr8"
"""What image_transport's publisher writes: subscribers hand out bgr8 images."""


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
        out = CdrWriter().header(self.time_ns, self.frame_id).text(self.format)
        return out.octets(self.data).message()

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
            time_ns=seconds * NS_PER_S + nanoseconds,
            frame_id=frame_id.rstrip(b"\0").decode(errors="replace"),
            format=form.rstrip(b"\0").decode(errors="replace"),
            data=data,
        )
