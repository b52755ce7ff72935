# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Messages of ROS 2 as bytes, without ROS: what all of them share.

CDR, little-endian: numbers lie at multiples of their size, counted after the four bytes of the
encapsulation (OMG DDS-XTypes, plain CDR).
"""

import struct

from sensor.wire import NS_PER_S

RULE = "=" * 80
HEADER_DEFINITION = f"""{RULE}
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
{RULE}
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec
"""
_LITTLE_ENDIAN = b"\0\1\0\0"


class CdrWriter:
    """One message, field after field."""

    def __init__(self) -> None:
        self._out = bytearray()

    def numbers(self, code: str, *values: int | float) -> "CdrWriter":
        """Append numbers of one kind, a letter of ``struct``."""
        self._out += b"\0" * (-len(self._out) % struct.calcsize(code))
        self._out += struct.pack(f"<{len(values)}{code}", *values)
        return self

    def text(self, text: str) -> "CdrWriter":
        """Append a string."""
        return self.octets(text.encode() + b"\0")

    def octets(self, data: bytes) -> "CdrWriter":
        """Append a sequence of bytes with its length."""
        self.numbers("I", len(data))
        self._out += data
        return self

    def header(self, time_ns: int, frame_id: str) -> "CdrWriter":
        """Append a std_msgs/Header."""
        seconds, nanoseconds = divmod(time_ns, NS_PER_S)
        return self.numbers("i", seconds).numbers("I", nanoseconds).text(frame_id)

    def message(self) -> bytes:
        """All of it."""
        return _LITTLE_ENDIAN + bytes(self._out)
