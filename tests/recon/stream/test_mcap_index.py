# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""The index of a long recording is a small share of what is written, and there at any time."""

import errno
import os
import signal
import subprocess
import sys
from pathlib import Path
from subprocess import PIPE
from typing import BinaryIO

import pytest
from mcap.reader import NonSeekingReader, make_reader

from recon.stream import McapSource, keeper
from recon.stream.mcap_file import McapFile, MessageType
from recon.stream.outliving import OutlivingFile
from recon.stream.ros import COMPRESSED_IMAGE, FORMAT, CompressedImage
from sensor.errors import WedgeError
from tests.recon.stream.servers import FRAMES
from tests.recon.stream.test_recording import ROOT, read_with_mcap, read_with_rosbags

STEP_NS = 2 * 10**9
"""A chunk for each message."""
MESSAGE_BYTES = 4000
TEXT = MessageType(name="std_msgs/msg/String", definition="string data\n")


def add(file: McapFile, channel: int, index: int, size: int = MESSAGE_BYTES) -> None:
    data = FRAMES[0].ljust(size, b"\0")
    image = CompressedImage(time_ns=index, frame_id="a", format=FORMAT, data=data)
    file.add_message(channel, image.to_cdr(), index * STEP_NS, index)


def times(path: Path) -> list[int]:
    """Of all messages, which readers of every kind find."""
    with path.open("rb") as stream:
        index = make_reader(stream).get_summary()
        found = [t for _, t, _ in read_with_mcap(path)]
        stream.seek(0)
        messages = NonSeekingReader(stream, validate_crcs=True).iter_messages()
        assert [m.publish_time for _, _, m in messages] == found
    assert len(index.chunk_indexes) == index.statistics.chunk_count
    assert index.statistics.message_count == len(read_with_rosbags(path)) == len(found)
    source = McapSource(path)
    assert [frame.time_ns for frame in source] == found
    assert (source.counts.corrupt, source.counts.remark) == (0, "")
    return found


def data_end(path: Path) -> int:
    with path.open("rb") as stream:
        chunks = make_reader(stream).get_summary().chunk_indexes
    return max(c.chunk_start_offset + c.chunk_length + c.message_index_length for c in chunks)


class AskedToEnd(BaseException):
    """What a signal's handler raises."""


class AskedAmid:
    """The way to the writer; the signal comes when half of a request is on it, and behind it."""

    def __init__(self, way: BinaryIO, number: signal.Signals) -> None:
        self.way, self.number, self.asks = way, number, True

    def write(self, request: bytes) -> None:
        asks, self.asks = self.asks, False
        for part in (request[: len(request) // 2], request[len(request) // 2 :]):
            self.way.write(part)
            self.way.flush()
            if asks:
                signal.raise_signal(self.number)

    def __getattr__(self, name: str) -> object:
        return getattr(self.way, name)


@pytest.mark.parametrize("closes", [False, True])
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_who_is_asked_to_end_amid_a_write_hears_of_it_behind(
    tmp_path: Path, number: signal.Signals, closes: bool
) -> None:
    def end(*_: object) -> None:
        raise AskedToEnd

    path = tmp_path / "a.mcap"
    file = McapFile(path, {})
    channel = file.add_channel("/wedge/image", COMPRESSED_IMAGE)
    before = signal.signal(number, end)
    try:
        for index in range(3):
            add(file, channel, index)
        writer = file._file._keeper
        writer.stdin = AskedAmid(writer.stdin, number)
        with pytest.raises(AskedToEnd):
            file.close() if closes else file.flush()
        assert file.kept == {channel: 3}
        if not closes:
            add(file, channel, 3)
    finally:
        file.close()
        signal.signal(number, before)
    assert times(path) == list(range(3 if closes else 4))


def test_of_what_is_written_little_is_index_and_it_is_there_after_every_write(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    put, written = OutlivingFile.put, []

    def counted(file: OutlivingFile, *pieces: keeper.Piece) -> None:
        written.append(sum(len(content) for _, content in pieces))
        put(file, *pieces)

    monkeypatch.setattr(OutlivingFile, "put", counted)
    file, path = McapFile(tmp_path / "touch.mcap", {}), tmp_path / "touch.mcap"
    channel = file.add_channel("/a/compressed", COMPRESSED_IMAGE)
    for index in range(1200):
        add(file, channel, index)
        if index == 700:
            file.add_channel("/b", TEXT)  # in the midst of its room the index begins otherwise
        if index % 149 == 1 or index in (701, 702):
            assert times(path) == list(range(index))  # the last one is in memory
    size = path.stat().st_size
    file.close()
    assert times(path) == list(range(1200))
    end, indexed = data_end(path), 1200 * 100
    assert path.stat().st_size < end + indexed < size  # there was room, and it is gone
    # Beside each chunk 250 bytes tell of it, of the file and where its index begins.
    assert sum(written) - end < 0.1 * end + 1200 * 250 + 2 * indexed


def with_room(path: Path) -> tuple[McapFile, int, int]:
    """A file before whose index there is room for more than five chunks, its channel, its messages.

    The last of them is in memory.
    """
    file = McapFile(path, {})
    channel = file.add_channel("/a/compressed", COMPRESSED_IMAGE)
    for index in range(400):
        add(file, channel, index)
        if index > 200 and file._index.start > file._end + 6 * MESSAGE_BYTES:
            return file, channel, index + 1
    raise AssertionError("there is never room")


@pytest.mark.parametrize("left", [0, 1, 8, 9, 10, 30])
def test_a_chunk_may_fill_the_room_to_any_byte(tmp_path: Path, left: int) -> None:
    file, channel, count = with_room(path := tmp_path / "touch.mcap")
    end = file._end
    add(file, channel, count)
    of_one = file._end - end
    over = file._index.start - file._end - 2 * of_one - left
    add(file, channel, count + 1, MESSAGE_BYTES + over)
    add(file, channel, count + 2)
    assert times(path) == list(range(count + 2))
    add(file, channel, count + 3)
    assert times(path) == list(range(count + 3))
    file.close()
    assert times(path) == list(range(count + 4))


def test_a_disk_that_is_full_within_the_room_costs_one_chunk(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    put = OutlivingFile.put

    def full(file: OutlivingFile, *pieces: keeper.Piece) -> None:
        monkeypatch.setattr(OutlivingFile, "put", put)
        os.pwrite(file._file, pieces[0][1][:99], pieces[0][0])
        raise OSError(errno.ENOSPC, "No space left on device")

    file, channel, count = with_room(path := tmp_path / "touch.mcap")
    monkeypatch.setattr(OutlivingFile, "put", full)
    with pytest.raises(WedgeError, match=r"touch\.mcap cannot be written: No space left"):
        add(file, channel, count)
    assert times(path) == list(range(count - 1))  # the last one is in memory
    add(file, channel, count)
    file.close()
    assert times(path) == list(range(count + 1))


RECORD_ON = """
import sys
from pathlib import Path
from tests.recon.stream.test_mcap_index import COMPRESSED_IMAGE, McapFile, add
file = McapFile(Path(sys.argv[1]), {})
channel = file.add_channel("/a/compressed", COMPRESSED_IMAGE)
for index in range(10**6):
    add(file, channel, index)
    if index == 300:
        print("under way", flush=True)
"""


def test_a_kill_while_there_is_room_leaves_a_file_that_opens(tmp_path: Path) -> None:
    command = [sys.executable, "-c", RECORD_ON, str(path := tmp_path / "touch.mcap")]
    with subprocess.Popen(command, cwd=ROOT, stdout=PIPE, stderr=PIPE) as process:
        assert process.stdout.readline() == b"under way\n"
        process.send_signal(signal.SIGKILL)
        assert process.stderr.read() == b""  # ends when the writer has ended
    found = times(path)
    assert found == list(range(len(found))) and len(found) >= 300
