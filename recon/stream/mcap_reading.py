# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""The records of an MCAP file, as many of them as are whole: what is damaged costs itself.

A record says how long it is, so the next one is found behind a damaged one. Where that length is
damaged, the index at the file's end says where the next chunk begins.
See https://mcap.dev/spec.
"""

import io
import os
import struct
import zlib
from bisect import bisect_right
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass, field, replace
from typing import Any, BinaryIO

from recon.stream.mcap_file import MAGIC, RECORD_HEAD

LARGEST_RECORD = 256 << 20
"""Bytes, packed or not: sixty times the chunks that recorders write."""
MOST_PACKED, ANYHOW_UNPACKED = 200, 16 << 20
"""Times that a chunk may be as large unpacked; up to so many bytes it may be so anyhow."""
_FOOTER = struct.Struct("<BQQQI")
_CHUNK_INDEX = struct.Struct("<4Q")
_MESSAGE_INDEX = struct.Struct("<HI")
_ENTRY_BYTES = 16
_MESSAGE_HEAD_BYTES = 22
# Opcodes, and what stands for records that cannot be told apart up to the next chunk or the end.
_HOLE, _END = -1, -2
_FOOTER_CODE, _SCHEMA_CODE, _CHANNEL_CODE, _MESSAGE_CODE, _CHUNK_CODE = 2, 3, 4, 5, 6
_MESSAGE_INDEX_CODE, _CHUNK_INDEX_CODE, _ATTACHMENT_CODE = 7, 8, 9


@dataclass(kw_only=True)
class Damage:
    """Stands where a record cannot be read."""

    attachment: bool = False
    rest: bool = False
    """Nothing that is behind it was found either: the file ends here."""
    messages: dict[int, int] = field(default_factory=dict)
    """How many went with it, by channel, where an index says so."""

    def lost(self, channels: set[int]) -> int:
        """Messages of these channels that went with it; one where nothing says how many."""
        if self.attachment or self.rest:
            return 0
        if not self.messages:
            return 1
        return sum(count for channel, count in self.messages.items() if channel in channels)


def read_records(stream: BinaryIO) -> Iterator[Any]:
    """Schemas, channels, messages and attachments, and ``Damage`` where one is not whole.

    Args:
        stream: an MCAP file, behind its first bytes.
    """
    hole: Damage | None = None
    for code, content in _whole_records(stream):
        if hole and code == _MESSAGE_INDEX_CODE and len(content) >= _MESSAGE_INDEX.size:
            channel, length = _MESSAGE_INDEX.unpack_from(content)
            hole.messages[channel] = min(length, len(content)) // _ENTRY_BYTES
            continue
        if hole:
            yield hole
        try:
            hole = None
            yield from _parsed(code, content)
        except _unreadable():
            hole = Damage(attachment=code == _ATTACHMENT_CODE)
    if hole:
        yield hole


def _whole_records(stream: BinaryIO) -> Iterator[tuple[int, bytes]]:
    """Opcode and content of each record that is as long as it says."""
    at, starts = stream.tell(), _sure_starts(stream)
    stream.seek(at)
    while True:
        head = stream.read(RECORD_HEAD.size)
        code, length = RECORD_HEAD.unpack(head) if len(head) == RECORD_HEAD.size else (0, 0)
        begun, at = at, at + RECORD_HEAD.size + length
        place = bisect_right(starts, begun)
        following = starts[place] if place < len(starts) else None
        fits = 0 < code and length <= LARGEST_RECORD and (following is None or at <= following)
        content = stream.read(length) if fits else b""
        if fits and len(content) == length:
            yield code, content
            if code != _FOOTER_CODE:
                continue
            if stream.read(len(MAGIC)) == MAGIC:
                return
            following = None
        if following is None:
            yield _END, b""
            return
        yield _HOLE, b""
        at = stream.seek(following)


def _sure_starts(stream: BinaryIO) -> list[int]:
    """Where chunks begin, as the index says and as is so, and it itself; none without an index."""
    tail_bytes = _FOOTER.size + len(MAGIC)
    size = stream.seek(0, os.SEEK_END)
    if size < tail_bytes:
        return []
    stream.seek(size - tail_bytes)
    tail = stream.read(tail_bytes)
    code, _, summary, _, _ = _FOOTER.unpack_from(tail)
    if code != _FOOTER_CODE or not tail.endswith(MAGIC) or not 0 < summary < size:
        return []
    at = stream.seek(summary)
    indexed: dict[int, int] = {}
    while len(head := stream.read(RECORD_HEAD.size)) == RECORD_HEAD.size:
        code, length = RECORD_HEAD.unpack(head)
        at += RECORD_HEAD.size + length
        if at > size or length > LARGEST_RECORD:
            break
        content = stream.read(length)
        if code == _CHUNK_INDEX_CODE and length >= _CHUNK_INDEX.size:
            _, _, start, chunk_length = _CHUNK_INDEX.unpack_from(content)
            indexed[start] = chunk_length
    found = [start for start in sorted(indexed) if _is_chunk(stream, start, indexed[start], size)]
    return [*found, summary] if found else []


def _is_chunk(stream: BinaryIO, start: int, length: int, size: int) -> bool:
    """Whether a chunk of that length is there."""
    if start + length > size:
        return False
    stream.seek(start)
    return stream.read(RECORD_HEAD.size) == RECORD_HEAD.pack(
        _CHUNK_CODE, max(0, length - RECORD_HEAD.size)
    )


def _parsed(code: int, content: bytes) -> list[Any]:
    """The records that are wanted of one record: of a chunk, all."""
    from mcap.data_stream import ReadDataStream
    from mcap.records import Attachment, Channel, Chunk, Message, Schema

    if code in (_HOLE, _END):
        return [Damage(rest=code == _END)]
    stream = ReadDataStream(io.BytesIO(content))
    if code == _SCHEMA_CODE:
        with suppress(*_unreadable()):  # its channel's topic says nearly as much
            return [Schema.read(stream)]
        return []
    if code == _CHANNEL_CODE:
        return [Channel.read(stream)]
    if code == _MESSAGE_CODE and len(content) >= _MESSAGE_HEAD_BYTES:
        return [Message.read(stream, len(content))]
    if code == _ATTACHMENT_CODE:
        stated = int.from_bytes(content[-4:], "little")
        if stated not in (0, zlib.crc32(content[:-4])):
            raise ValueError("an attachment's checksum")
        return [Attachment.read(stream)]
    return _unpacked(Chunk.read(stream)) if code == _CHUNK_CODE else []


def _unpacked(chunk: Any) -> list[Any]:
    """The records of a chunk, unpacked to no more than it says.

    Raises:
        ValueError: its checksum or its size is another, or it is packed in an unknown way; others
            of ``_unreadable``.
    """
    import lz4.frame  # type: ignore[import-untyped]
    import zstandard
    from mcap.stream_reader import breakup_chunk

    size = chunk.uncompressed_size
    if size > LARGEST_RECORD or size > max(ANYHOW_UNPACKED, MOST_PACKED * len(chunk.data)):
        raise ValueError("a chunk's size")
    match chunk.compression:
        case "":
            return breakup_chunk(chunk, validate_crc=True)
        case "zstd":
            unpack = zstandard.ZstdDecompressor(max_window_size=LARGEST_RECORD)
            content = unpack.stream_reader(chunk.data).read(size + 1)
        case "lz4":
            content = lz4.frame.LZ4FrameDecompressor().decompress(chunk.data, max_length=size + 1)
        case _:
            raise ValueError("a chunk's packing")
    if len(content) != size:
        raise ValueError("a chunk's size")
    return breakup_chunk(replace(chunk, compression="", data=content), validate_crc=True)


def _unreadable() -> tuple[type[Exception], ...]:
    """What reading a damaged record may raise."""
    from mcap.exceptions import McapError
    from zstandard import ZstdError

    named = (McapError, ZstdError, struct.error, ValueError, EOFError, OverflowError, MemoryError)
    return (*named, RuntimeError)  # lz4's
