# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Writes for a process that may be killed: what was handed over whole is written whole.

A kill can end a write in its middle. So the recorder hands offset and content to this process,
which outlives it: what came only in part is dropped, what came whole is finished. Run as a script
with the number of the open file; needs the standard library alone.
"""

import os
import struct
import sys
from contextlib import suppress

REQUEST = struct.Struct("<QQ")
"""Offset and length of the content that follows."""
ANSWER = struct.Struct("<i")
"""The number of the system's error, or 0."""


def main(file: int) -> None:
    """Write what comes on stdin until it ends."""
    source, sink = sys.stdin.buffer, sys.stdout.fileno()
    while len(request := source.read(REQUEST.size)) == REQUEST.size:
        at, length = REQUEST.unpack(request)
        content = source.read(length)
        if len(content) < length:
            return
        answer = ANSWER.pack(_written(file, at, content))
        with suppress(BrokenPipeError):  # whoever asked was killed meanwhile
            os.write(sink, answer)


def _written(file: int, at: int, content: bytes) -> int:
    rest = memoryview(content)
    try:
        while rest:
            done = os.pwrite(file, rest, at)
            at, rest = at + done, rest[done:]
    except OSError as error:
        return error.errno or 5
    return 0


if __name__ == "__main__":
    main(int(sys.argv[1]))
