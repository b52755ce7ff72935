# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Writes for a process that may be killed: what was handed over whole is written whole.

A kill can end a write in its middle. So the recorder hands pieces of the file to this process,
which outlives it: a request that came only in part is dropped, one that came whole is finished. Run
as a script with the number of the open file; needs the standard library alone.
"""

import errno
import os
import struct
import sys
from collections.abc import Iterable
from contextlib import suppress
from typing import BinaryIO

COUNT = struct.Struct("<I")
"""How many pieces follow."""
PIECE = struct.Struct("<QQ")
"""Offset and length of the content that follows."""
ANSWER = struct.Struct("<i")
"""The number of the system's error, or 0."""

Piece = tuple[int, bytes]
"""Where something is to be written, and what."""


def request(*pieces: Piece) -> bytes:
    """What asks for these to be written, in their order; the file ends behind the last."""
    parts = [part for at, content in pieces for part in (PIECE.pack(at, len(content)), content)]
    return COUNT.pack(len(pieces)) + b"".join(parts)


def main(file: int) -> None:
    """Write what comes on stdin until it ends."""
    source, sink = sys.stdin.buffer, sys.stdout.fileno()
    while pieces := _requested(source):
        answer = ANSWER.pack(_written(file, pieces))
        with suppress(BrokenPipeError):  # whoever asked was killed meanwhile
            os.write(sink, answer)


def _requested(source: BinaryIO) -> list[Piece]:
    """The pieces of the next request; none where it does not come whole."""
    pieces = []
    count = source.read(COUNT.size)
    for _ in range(COUNT.unpack(count)[0] if len(count) == COUNT.size else 0):
        if len(head := source.read(PIECE.size)) < PIECE.size:
            return []
        at, length = PIECE.unpack(head)
        if len(content := source.read(length)) < length:
            return []
        pieces.append((at, content))
    return pieces


def _written(file: int, pieces: Iterable[Piece]) -> int:
    try:
        end = 0
        for at, content in pieces:
            rest, end = memoryview(content), at + len(content)
            while rest:
                rest = rest[os.pwrite(file, rest, end - len(rest)) :]
        os.ftruncate(file, end)
    except OSError as error:
        return error.errno or errno.EIO
    return 0


if __name__ == "__main__":
    main(int(sys.argv[1]))
