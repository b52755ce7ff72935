# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""An MCAP file that is complete after every write, so that a kill costs a second of frames at most.

The index of an MCAP file stands at its end, and a file without it does not open. Here each chunk
is written together with what the index says of it, by a process that outlives this one: over the
index, which is written again behind it, or, as the index grows, into room that is left before it,
lest most of what is written were the index again and again.
See https://mcap.dev/spec.
"""

import struct
import zlib
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from types import ModuleType
from typing import Any

from recon.stream.outliving import OutlivingFile
from recon.stream.uninterrupted import uninterrupted
from sensor.errors import WedgeError
from sensor.extras import how_to_install

MAGIC = b"\x89MCAP0\r\n"
CHUNK_BYTES = 4 << 20
CHUNK_NS = 10**9
"""What a kill may cost: as much of a recording as one chunk holds."""
ROOM = 10
"""Of an index that is written again, in its lengths: so much is recorded before the next time."""
MOST_ROOM_BYTES = 64 << 20
"""Some readers load it, as any record."""
RECORD_HEAD = struct.Struct("<BQ")
"""Of each record: its opcode and its length."""
_OTHERS_CODE = 0x80
"""Of records that MCAP leaves to applications; readers pass over them."""


def mcap_records() -> ModuleType:
    """The package that knows the records.

    Raises:
        WedgeError: it is not installed.
    """
    try:
        import mcap.records
    except ModuleNotFoundError as error:
        raise WedgeError(f"recordings need mcap: {how_to_install('live')}.") from error
    return mcap.records


@dataclass(frozen=True, kw_only=True)
class MessageType:
    """A message of ROS 2 as the file describes it."""

    name: str
    definition: str
    """As in its .msg file, those of its parts behind it."""


@dataclass
class _Chunk:
    """Messages that are not on the disk yet."""

    content: bytearray = field(default_factory=bytearray)
    places: dict[int, list[tuple[int, int]]] = field(default_factory=dict)
    """Log time and offset of the messages, by channel."""
    first_ns: int = 0
    last_ns: int = 0


@dataclass(frozen=True, kw_only=True)
class _Written:
    """What the index tells of the chunks on the disk."""

    chunks: int = 0
    indexes: bytes = b""
    times_ns: tuple[int, int] = (0, 0)


@dataclass(frozen=True, kw_only=True)
class _Index:
    """All that stands behind the data and the room."""

    start: int = 0
    content: bytes = b""
    lasting: int = 0
    """So many of its bytes stay where chunks are added."""


class McapFile:
    """Some channels, attachments, and messages in chunks."""

    def __init__(self, path: Path, attachments: Mapping[str, bytes]):
        """Begin a file.

        Args:
            path: must not exist yet.
            attachments: contents by name.

        Raises:
            WedgeError: the file exists, cannot be written, or mcap is not installed.
        """
        self._records = records = mcap_records()
        try:
            self._file = OutlivingFile(path)
        except FileExistsError as error:
            raise WedgeError(f"{path} exists: name a new file.") from error
        except OSError as error:
            raise WedgeError(f"{path} cannot be written: {error.strerror}.") from error
        self._path = path
        self._schemas: dict[MessageType, bytes] = {}
        self._channels: list[bytes] = []
        self._chunk = _Chunk()
        self._written = _Written()
        self._messages: dict[int, int] = {}
        self.kept: dict[int, int] = {}
        """Messages on the disk, by channel."""
        head = MAGIC + _bytes(records.Header(profile="ros2", library="gelsight-wedge"))
        self._attachment_indexes = bytearray()
        self._attachments = len(attachments)
        for name, data in attachments.items():
            record = _bytes(
                records.Attachment(
                    create_time=0,
                    log_time=0,
                    name=name,
                    media_type="application/octet-stream",
                    data=data,
                )
            )
            self._attachment_indexes += _bytes(
                records.AttachmentIndex(
                    offset=len(head),
                    length=len(record),
                    log_time=0,
                    create_time=0,
                    data_size=len(data),
                    name=name,
                    media_type="application/octet-stream",
                )
            )
            head += record
        self._end, self._index = 0, _Index()
        try:
            self._write(head, self._written)
        except WedgeError:  # leave no file that is none, nor its writer
            self._file.remove()
            raise

    def add_channel(
        self, topic: str, kind: MessageType, metadata: Mapping[str, str] | None = None
    ) -> int:
        """A new channel of CDR messages of one kind, with more to say of it; its number."""
        if kind not in self._schemas:
            self._schemas[kind] = _bytes(
                self._records.Schema(
                    id=len(self._schemas) + 1,
                    name=kind.name,
                    encoding="ros2msg",
                    data=kind.definition.encode(),
                )
            )
            self._chunk.content += self._schemas[kind]
        number = len(self._channels) + 1
        channel = _bytes(
            self._records.Channel(
                id=number,
                topic=topic,
                message_encoding="cdr",
                metadata={"offered_qos_profiles": "", **(metadata or {})},
                schema_id=1 + list(self._schemas).index(kind),
            )
        )
        self._channels.append(channel)
        self._chunk.content += channel
        self._messages[number] = 0
        return number

    def add_message(self, channel: int, data: bytes, log_ns: int, publish_ns: int) -> None:
        """Append a message; it is on the disk when its chunk is full or a second old."""
        chunk = self._chunk
        if chunk.places and (
            len(chunk.content) > CHUNK_BYTES or abs(log_ns - chunk.first_ns) > CHUNK_NS
        ):
            self.flush()
            chunk = self._chunk
        if not chunk.places:
            chunk.first_ns = chunk.last_ns = log_ns
        chunk.first_ns, chunk.last_ns = min(chunk.first_ns, log_ns), max(chunk.last_ns, log_ns)
        chunk.places.setdefault(channel, []).append((log_ns, len(chunk.content)))
        chunk.content += _bytes(
            self._records.Message(
                channel_id=channel,
                log_time=log_ns,
                data=data,
                publish_time=publish_ns,
                sequence=self._messages[channel] & 0xFFFFFFFF,
            )
        )
        self._messages[channel] += 1

    @uninterrupted()
    def flush(self) -> None:
        """Bring what was added to the disk; what cannot be written is kept for the next time.

        Raises:
            WedgeError: the disk is full.
        """
        chunk, records = self._chunk, self._records
        if not chunk.content:
            return
        content = bytes(chunk.content)
        written = _bytes(
            records.Chunk(
                compression="",
                data=content,
                message_start_time=chunk.first_ns,
                message_end_time=chunk.last_ns,
                uncompressed_crc=zlib.crc32(content),
                uncompressed_size=len(content),
            )
        )
        length, offsets = len(written), {}
        for channel, places in chunk.places.items():
            offsets[channel] = self._end + len(written)
            written += _bytes(records.MessageIndex(channel_id=channel, records=places))
        index = _bytes(
            records.ChunkIndex(
                chunk_length=length,
                chunk_start_offset=self._end,
                compression="",
                compressed_size=len(content),
                message_end_time=chunk.last_ns,
                message_start_time=chunk.first_ns,
                message_index_length=len(written) - length,
                message_index_offsets=offsets,
                uncompressed_size=len(content),
            )
        )
        before = self._written
        times_ns = before.times_ns
        if chunk.places:
            first_ns, last_ns = times_ns if before.chunks else (chunk.first_ns, chunk.last_ns)
            times_ns = min(first_ns, chunk.first_ns), max(last_ns, chunk.last_ns)
        indexes = before.indexes + index
        self._write(written, _Written(chunks=before.chunks + 1, indexes=indexes, times_ns=times_ns))
        self._chunk, self.kept = _Chunk(), dict(self._messages)

    @uninterrupted()
    def close(self) -> None:
        """Bring everything to the disk and let go of the file.

        Raises:
            WedgeError: the disk is full.
        """
        if not self._file.closed:
            try:
                self.flush()
                if self._index.start > self._end:
                    with suppress(OSError):  # the file is as whole with room in it
                        self._place(b"", self._index_at(self._end, self._written))
                self._file.sync()
            except OSError as error:
                raise self._unwritable(error) from error
            finally:
                self._file.close()

    def _unwritable(self, error: OSError) -> WedgeError:
        return WedgeError(f"{self._path} cannot be written: {error.strerror}.")

    def _write(self, content: bytes, written: _Written) -> None:
        """Put data behind the data, and have the index, of all of it, behind them."""
        end = self._end + len(content)
        index = self._index_at(self._index.start, written)
        if end + RECORD_HEAD.size > index.start or not self._there(index):
            room = min(ROOM * len(index.content), MOST_ROOM_BYTES)
            if room <= len(content) + RECORD_HEAD.size:  # it would not hold the next chunk
                room = 0
            index = self._index_at(end + room, written)
        try:
            self._place(content, index)
        except OSError as error:
            raise self._unwritable(error) from error
        self._written = written

    def _place(self, content: bytes, index: _Index) -> None:
        """Write data and index; what was there stays where that fails.

        Raises:
            OSError: the disk is full.
        """
        end, before = self._end + len(content), self._index
        there = self._there(index)
        rest = index.start + there, index.content[there:]
        try:
            self._file.put((self._end, content + _room(index.start - end)), rest)
        except OSError:
            with suppress(OSError):  # where the disk is full, there is room for what was there
                room = _room(before.start - self._end)
                self._file.put((self._end, room), (before.start, before.content))
            raise
        self._end, self._index = end, index

    def _there(self, index: _Index) -> int:
        """How many bytes that an index begins with are where they belong already."""
        there = self._index.content[: self._index.lasting]
        lasts = index.start == self._index.start and index.content.startswith(there)
        return len(there) if lasts else 0

    def _index_at(self, start: int, written: _Written) -> _Index:
        """What is to stand behind the data and the room, which end there."""
        records = self._records
        data_end = _bytes(records.DataEnd(data_section_crc=0))
        statistics = records.Statistics(
            attachment_count=self._attachments,
            channel_count=len(self._channels),
            channel_message_counts=self._messages,
            chunk_count=written.chunks,
            message_count=sum(self._messages.values()),
            message_start_time=written.times_ns[0],
            message_end_time=written.times_ns[1],
            metadata_count=0,
            schema_count=len(self._schemas),
        )
        lasting = b"".join(
            (
                data_end,
                *self._schemas.values(),
                *self._channels,
                self._attachment_indexes,
                written.indexes,
            )
        )
        footer = records.Footer(
            summary_start=start + len(data_end), summary_offset_start=0, summary_crc=0
        )
        content = lasting + _bytes(statistics) + _bytes(footer) + MAGIC
        return _Index(start=start, content=content, lasting=len(lasting))


def _room(length: int) -> bytes:
    """The head of a record of that length, whose content is a hole; none where there is no room."""
    return RECORD_HEAD.pack(_OTHERS_CODE, length - RECORD_HEAD.size) if length else b""


def _bytes(record: Any) -> bytes:
    from mcap.data_stream import RecordBuilder

    builder = RecordBuilder()
    record.write(builder)
    content: bytes = builder.end()  # type: ignore[no-untyped-call]
    return content
