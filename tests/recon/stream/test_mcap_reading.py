# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""What is damaged in a recording costs itself: every other frame comes."""

import random
import struct
import tracemalloc
from collections.abc import Mapping
from itertools import pairwise
from pathlib import Path
from types import MappingProxyType

import pytest
import zstandard
from mcap.reader import make_reader
from mcap.writer import CompressionType, Writer

from recon.stream import McapSource
from recon.stream.frame import Counts
from recon.stream.ros import COMPRESSED_IMAGE, CompressedImage
from sensor.errors import WedgeError
from tests.recon.stream.test_recording import frame, record
from tests.synthetic import make_dataset
from tests.written import write_anew

COUNT = 240
MOST_IN_A_CHUNK = 61
TOPIC = "/wedge/image_raw/compressed"
PACKINGS = [CompressionType.NONE, CompressionType.ZSTD, CompressionType.LZ4]


def packed(
    path: Path,
    packing: CompressionType,
    messages: list[bytes],
    encoding: str = "cdr",
    *,
    topic: str = TOPIC,
    attached: Mapping[str, bytes] = MappingProxyType({}),
    **options: bool,
) -> Path:
    """A recording as others write them."""
    with path.open("wb") as stream:
        writer = Writer(stream, compression=packing, chunk_size=120_000, **options)
        writer.start("ros2")
        schema = writer.register_schema(
            COMPRESSED_IMAGE.name, "ros2msg", COMPRESSED_IMAGE.definition.encode()
        )
        channel = writer.register_channel(topic, encoding, schema)
        for name, content in attached.items():
            writer.add_attachment(0, 0, name, "application/octet-stream", content)
        for index, message in enumerate(messages):
            time_ns = frame(index).time_ns
            writer.add_message(channel, time_ns, message, time_ns)
        writer.finish()
    return path


def message_of(index: int) -> bytes:
    image = CompressedImage(
        time_ns=frame(index).time_ns, frame_id="a", format="jpeg", data=frame(index).jpeg
    )
    return image.to_cdr()


MESSAGES = [message_of(index) for index in range(COUNT)]


def read(path: Path) -> tuple[list[int], McapSource]:
    """The numbers of the frames that come, each of which is checked, and the source."""
    source = McapSource(path)
    came = list(source)
    number = {frame(index).time_ns: index for index in range(COUNT)}
    numbers = [number[item.time_ns] for item in came]
    assert [item.jpeg for item in came] == [frame(index).jpeg for index in numbers]
    assert numbers == sorted(numbers)
    assert source.counts.received == len(numbers)
    return numbers, source


def chunks(path: Path) -> list[tuple[int, int]]:
    """Where each chunk begins, and its length."""
    with path.open("rb") as stream:
        indexes = make_reader(stream).get_summary().chunk_indexes
    return [(index.chunk_start_offset, index.chunk_length) for index in indexes]


def changed(path: Path, place: int, content: bytes) -> Path:
    """A copy with other bytes in one place."""
    whole = bytearray(path.read_bytes())
    whole[place : place + len(content)] = content
    copy = path.with_name("changed.mcap")
    write_anew(copy, whole)
    return copy


@pytest.fixture(params=["ours", *PACKINGS], ids=str)
def recording(request, tmp_path):
    path = tmp_path / "touch.mcap"
    if request.param == "ours":
        return record(path, COUNT)
    return packed(path, request.param, MESSAGES)


def test_a_whole_recording_is_read_however_it_is_packed(recording: Path) -> None:
    numbers, source = read(recording)
    assert numbers == list(range(COUNT))
    assert (source.counts.corrupt, source.counts.remark) == (0, "")


def test_a_damaged_chunk_costs_its_own_frames_and_they_are_counted(recording: Path) -> None:
    places = chunks(recording)
    assert len(places) >= 4
    for start, length in places:
        kept = recording.read_bytes()[start + length // 2]
        numbers, source = read(changed(recording, start + length // 2, bytes([kept ^ 1])))
        missing = sorted(set(range(COUNT)) - set(numbers))
        assert 0 < len(missing) <= MOST_IN_A_CHUNK
        assert missing == list(range(missing[0], missing[-1] + 1))
        assert source.counts.corrupt == len(missing)
        assert source.counts.remark.endswith("is damaged in places: everything else is used.")


@pytest.mark.parametrize("length", [0, 1, 12_345, 2**20, 2**40, 2**64 - 1])
def test_a_chunk_whose_length_is_damaged_costs_no_other(recording: Path, length: int) -> None:
    for start, _ in chunks(recording):
        numbers, source = read(changed(recording, start + 1, struct.pack("<Q", length)))
        missing = sorted(set(range(COUNT)) - set(numbers))
        if missing:  # a length that is a little too long costs nothing
            assert len(missing) <= MOST_IN_A_CHUNK
            assert missing == list(range(missing[0], missing[-1] + 1))
            assert source.counts.corrupt > 0 and "damaged in places" in source.counts.remark


def test_a_flipped_bit_anywhere_costs_one_chunk_at_most(recording: Path) -> None:
    whole, draw = recording.read_bytes(), random.Random(0)
    for _ in range(60):
        place = draw.randrange(8, len(whole))
        numbers, source = read(changed(recording, place, bytes([whole[place] ^ 0x10])))
        assert len(numbers) >= COUNT - MOST_IN_A_CHUNK
        assert (len(numbers) == COUNT) or (source.counts.corrupt and source.counts.remark)


def test_messages_outside_of_chunks_are_lost_one_by_one(tmp_path: Path) -> None:
    path = packed(tmp_path / "loose.mcap", CompressionType.NONE, MESSAGES, use_chunking=False)
    assert read(path)[0] == list(range(COUNT))
    second = path.read_bytes().index(MESSAGES[1])
    numbers, source = read(changed(path, second, b"no CDR message"))
    assert numbers == [0, *range(2, COUNT)] and source.counts.corrupt == 1


@pytest.mark.parametrize("packing", ["zstd", "lz4"])
@pytest.mark.parametrize("said", [1000, 64 << 20])
def test_no_chunk_is_unpacked_beyond_what_it_says_or_makes_sense(
    tmp_path: Path, packing: str, said: int
) -> None:
    kind = CompressionType.ZSTD if packing == "zstd" else CompressionType.LZ4
    path = packed(tmp_path / "touch.mcap", kind, MESSAGES)
    (start, length), *_ = chunks(path)
    if packing == "zstd":
        bomb = zstandard.compress(bytes(64 << 20))
    else:
        import lz4.frame

        bomb = lz4.frame.compress(bytes(64 << 20))
    head = struct.pack("<QQQII", 0, 0, said, 0, len(packing)) + packing.encode()
    content = head + struct.pack("<Q", len(bomb)) + bomb
    whole = path.read_bytes()
    room = length - 9
    if len(content) > room:  # lz4 packs 64 MiB to 260 kB: make room, the index then misses it
        whole = whole[: start + 9] + bytes(len(content)) + whole[start + length :]
        room = len(content)
        whole = whole[: start + 1] + struct.pack("<Q", room) + whole[start + 9 :]
    (tmp_path / "bomb.mcap").write_bytes(whole)
    copy = changed(tmp_path / "bomb.mcap", start + 9, content.ljust(room, b"\0"))
    tracemalloc.start()
    try:
        numbers, source = read(copy)
        assert tracemalloc.get_traced_memory()[1] < 16 << 20
    finally:
        tracemalloc.stop()
    assert source.counts.corrupt == COUNT - len(numbers) > 0


@pytest.mark.parametrize(
    ("seconds", "nanoseconds"), [(-1, 0), (-(2**31), 5), (2**31 - 1, 2**32 - 1), (-1, 10**9 - 1)]
)
def test_a_stamp_that_no_clock_shows_costs_its_frame(
    tmp_path: Path, seconds: int, nanoseconds: int
) -> None:
    stamped = MESSAGES[1][:4] + struct.pack("<iI", seconds, nanoseconds) + MESSAGES[1][12:]
    messages = [MESSAGES[0], stamped, MESSAGES[2]]
    numbers, source = read(packed(tmp_path / "touch.mcap", CompressionType.NONE, messages))
    assert numbers == [0, 2] and source.counts.corrupt == 1


@pytest.mark.parametrize("damage", ["a bit", "its length", "its name's length"])
def test_a_damaged_unit_inside_is_named_and_the_frames_come(tmp_path: Path, damage: str) -> None:
    unit = make_dataset(tmp_path / "unit").folder  # any files will do
    (unit / "unit.toml").write_text("serial = 7")
    (unit / "gradients.safetensors").write_bytes(bytes(range(256)))
    path = record(tmp_path / "touch.mcap", COUNT, {"wedge": unit})
    content = bytes(range(256))
    place = path.read_bytes().index(content)
    copy = {
        "a bit": lambda: changed(path, place + 100, b"!"),
        "its length": lambda: changed(path, place - 8, struct.pack("<Q", 2**63)),
        "its name's length": lambda: changed(
            path, path.read_bytes().index(b"wedge/gradients") - 4, b"\xff" * 4
        ),
    }[damage]()
    numbers, source = read(copy)
    assert numbers == list(range(COUNT)) and source.counts.corrupt == 0
    assert "damaged in places" in source.counts.remark
    (tmp_path / "again").mkdir()
    with pytest.raises(WedgeError, match=r"unit inside .*changed\.mcap is damaged: name its"):
        source.save_unit(tmp_path / "again")
    assert not any((tmp_path / "again").iterdir())


def test_an_index_that_lies_costs_no_frame(tmp_path: Path) -> None:
    path = record(tmp_path / "touch.mcap", COUNT)
    whole = path.read_bytes()
    places = chunks(path)
    assert all(one + length < other for (one, length), (other, _) in pairwise(places))
    last = whole.rindex(struct.pack("<QQ", *places[-1]))
    for lie in (0, 1, places[1][0] + 50, len(whole), 2**63):
        numbers, source = read(changed(path, last, struct.pack("<Q", lie)))
        assert numbers == list(range(COUNT)) and source.counts.remark == ""


def test_a_recording_of_damaged_frames_alone_is_not_called_empty(tmp_path: Path) -> None:
    early = [m[:4] + struct.pack("<iI", -5, 0) + m[12:] for m in MESSAGES[:3]]
    source = McapSource(packed(tmp_path / "early.mcap", CompressionType.NONE, early))
    assert list(source) == []
    assert source.counts.no_frame("early.mcap") == "early.mcap gave no whole frame: 3 damaged."
    assert Counts().no_frame("none.avi") == "none.avi gave no frame."


def test_images_in_another_encoding_are_none_that_can_be_read(tmp_path: Path) -> None:
    path = packed(tmp_path / "a.mcap", CompressionType.NONE, MESSAGES[:3], encoding="json")
    with pytest.raises(WedgeError, match="has no topic with compressed images"):
        McapSource(path)


@pytest.mark.parametrize(
    "topic", ["cam", "cam/image", "/cam", "/cam/image_raw/compressed", "//cam/"]
)
def test_a_topic_of_any_spelling_belongs_to_its_first_word(tmp_path: Path, topic: str) -> None:
    unit = {"cam/unit.toml": b"serial = 7", "image/unit.toml": b"serial = 8"}
    path = tmp_path / "a.mcap"
    source = McapSource(
        packed(path, CompressionType.NONE, MESSAGES[:3], topic=topic, attached=unit)
    )
    assert source.unit == {"unit.toml": b"serial = 7"}
    assert [item.jpeg for item in source] == [frame(index).jpeg for index in range(3)]


@pytest.mark.parametrize("topic", ["", "/"])
def test_a_topic_without_a_word_is_nobody_s(tmp_path: Path, topic: str) -> None:
    path = packed(tmp_path / "a.mcap", CompressionType.NONE, MESSAGES[:3], topic=topic)
    assert McapSource(path).unit == {} and len(list(McapSource(path))) == 3
