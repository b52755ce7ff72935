# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""A damaged stream costs its damaged frames and no others, whatever the damage and the cuts."""

import io
import struct
from collections.abc import Iterator

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from PIL import Image

from recon.stream import multipart
from recon.stream.jpeg import END, NotJpegError, decode_jpeg, encode_jpeg, scan_start
from recon.stream.multipart import ENOUGH, LARGEST_PART, MultipartReader
from sensor.errors import WedgeError
from sensor.wire import BOUNDARY, DELIMITER, Stamp, part

FRAMES = [
    encode_jpeg(np.random.default_rng(seed).integers(0, 256, (16, 24, 3), np.uint8))
    for seed in range(6)
]


def read_all(stream: bytes, cuts: Iterator[int] | None = None) -> tuple[list[bytes], int]:
    """The frames and the number of damaged parts of a stream that comes in pieces."""
    source = io.BytesIO(stream)
    reader = MultipartReader(lambda most: source.read(next(cuts) if cuts else most), BOUNDARY)
    return [jpeg for jpeg, _ in reader], reader.corrupt


def parts(frames: list[bytes] = FRAMES) -> list[bytes]:
    return [part(jpeg, Stamp(index=i)) for i, jpeg in enumerate(frames)]


def headed(jpeg: bytes, *lines: str) -> bytes:
    return ("\r\n".join(lines) + "\r\n\r\n").encode() + jpeg + b"\r\n" + DELIMITER


def cut_pieces(sizes: list[int]) -> Iterator[int]:
    while True:
        yield from sizes


@given(sizes=st.lists(st.integers(1, 700), min_size=1, max_size=5))
def test_the_pieces_in_which_a_stream_comes_do_not_matter(sizes: list[int]) -> None:
    stream = DELIMITER + b"".join(parts())
    assert read_all(stream, cut_pieces(sizes)) == (FRAMES, 0)


def test_a_frame_is_there_before_the_next_delimiter() -> None:
    stream = DELIMITER + part(FRAMES[0], Stamp())
    whole = stream[: stream.index(FRAMES[0]) + len(FRAMES[0])]
    assert read_all(whole) == (FRAMES[:1], 0)


@pytest.mark.parametrize(
    "damaged",
    {
        "truncated, length honest": headed(FRAMES[2][:-9], f"Content-Length: {len(FRAMES[2]) - 9}"),
        "truncated, length lies": headed(FRAMES[2][:-9], f"Content-Length: {len(FRAMES[2])}"),
        "truncated in its tables": headed(FRAMES[2][:40], f"Content-Length: {len(FRAMES[2])}"),
        "empty": headed(b"", "Content-Length: 0"),
        "no JPEG": headed(b"an error page", "Content-Type: text/plain"),
        "garbage": headed(np.random.default_rng(0).bytes(5000), "Content-Length: 5000"),
        "half a head": b"Content-Type: image/jp" + b"\r\n" + DELIMITER,
        "an endless head": b"X" * (1 << 20) + b"\r\n" + DELIMITER,
        "100 MB": headed(FRAMES[2][:-9] + bytes(100 << 20), "Content-Length: 104857600"),
    }.items(),
    ids=lambda item: item[0],
)
def test_a_damaged_part_costs_itself_alone(damaged: tuple[str, bytes]) -> None:
    sent = parts()
    sent[2] = damaged[1]
    frames, corrupt = read_all(DELIMITER + b"".join(sent))
    assert frames == FRAMES[:2] + FRAMES[3:]
    assert corrupt == 1


@pytest.mark.parametrize(
    "odd",
    {
        "length too short": headed(FRAMES[2], "Content-Length: 7"),
        "length too long": headed(FRAMES[2], "Content-Length: 999999999"),
        "length of no sense": headed(FRAMES[2], "Content-Length: -1e3"),
        "no length": headed(FRAMES[2], "Content-Type: image/jpeg"),
        "no lines": b"\r\n\r\n" + FRAMES[2] + b"\r\n" + DELIMITER,
        "small letters": headed(FRAMES[2], "content-type: image/jpeg", "content-length:   7"),
        "a line without colon": headed(FRAMES[2], "hello", "Content-Type: image/jpeg"),
        "line feeds alone": headed(FRAMES[2], "").replace(b"\r\n\r\n", b"\n\n"),
        "an empty line too many": headed(b"\r\n" + FRAMES[2], "Content-Type: image/jpeg"),
        "zeros behind": headed(FRAMES[2] + bytes(9), f"Content-Length: {len(FRAMES[2]) + 9}"),
        "garbage behind": headed(FRAMES[2], "") + b"?" * 99999 + DELIMITER,
    }.items(),
    ids=lambda item: item[0],
)
def test_an_odd_but_whole_part_costs_nothing(odd: tuple[str, bytes]) -> None:
    sent = parts()
    sent[2] = odd[1]
    frames, _ = read_all(DELIMITER + b"".join(sent))
    assert frames == FRAMES


def lacking(jpeg: bytes) -> bytes:
    """A JPEG without ten bytes of its coded pixels: it still has its head and its end."""
    coded = scan_start(jpeg)
    assert coded is not None
    short = jpeg[: coded + 30] + jpeg[coded + 40 :]
    assert short.index(END, coded) == len(short) - 2
    return short


def of_length(jpeg: bytes, length: int) -> bytes:
    return headed(jpeg, f"Content-Length: {length}")


GOOD = [of_length(FRAMES[0], len(FRAMES[0]))]
LACKING = [of_length(lacking(FRAMES[1]), len(FRAMES[1]))]


@pytest.mark.parametrize("run", [1, ENOUGH - 1])
def test_where_lengths_were_right_bytes_missing_inside_are_found(run: int) -> None:
    again = [*LACKING * run, *GOOD]
    frames, corrupt = read_all(DELIMITER + b"".join([*GOOD * ENOUGH, *again * 5]))
    assert (frames, corrupt) == ([FRAMES[0]] * (ENOUGH + 5), 5 * run)


def test_what_lies_behind_a_damaged_delimiter_is_not_taken_for_one_frame() -> None:
    broken = of_length(FRAMES[1][:-9], len(FRAMES[1])).replace(DELIMITER, b"")
    sent = [*GOOD * ENOUGH, broken, *GOOD * 2]
    assert read_all(DELIMITER + b"".join(sent)) == ([FRAMES[0]] * (ENOUGH + 1), 1)


def test_half_of_the_parts_damaged_do_not_hide_that_lengths_are_right() -> None:
    sent = [*LACKING, *GOOD] * 3 * ENOUGH
    frames, corrupt = read_all(DELIMITER + b"".join(sent))
    assert frames.count(FRAMES[0]) == 3 * ENOUGH
    assert frames[2 * ENOUGH :] == [FRAMES[0]] * 2 * ENOUGH
    assert corrupt == 2 * ENOUGH


@pytest.mark.parametrize("more", [-1, 1, 2])
def test_a_server_whose_lengths_are_always_wrong_loses_nothing(more: int) -> None:
    sent = [of_length(jpeg, len(jpeg) + more) for jpeg in FRAMES * 5]
    assert read_all(DELIMITER + b"".join(sent)) == (FRAMES * 5, 0)


def test_a_server_whose_lengths_are_right_by_chance_loses_nothing() -> None:
    wrong = [of_length(FRAMES[1], len(FRAMES[1]) + 2)]
    frames, corrupt = read_all(DELIMITER + b"".join([*GOOD, *wrong * ENOUGH] * 3 * ENOUGH))
    assert len(frames) == 3 * ENOUGH * (ENOUGH + 1)
    assert corrupt == 0


def test_lengths_that_become_wrong_cost_a_few_frames_and_no_more() -> None:
    wrong = [of_length(FRAMES[1], len(FRAMES[1]) + 2)]
    sent = [*GOOD * 3 * ENOUGH, *wrong * 5 * ENOUGH]
    frames, corrupt = read_all(DELIMITER + b"".join(sent))
    assert corrupt == ENOUGH
    assert frames == [FRAMES[0]] * 3 * ENOUGH + [FRAMES[1]] * 4 * ENOUGH


@pytest.mark.parametrize(
    ("last", "rest"),
    [
        (headed(FRAMES[1] + bytes(3), f"Content-Length: {len(FRAMES[1]) + 3}"), 3),
        (headed(FRAMES[1], "Content-Type: image/jpeg"), 0),
        (headed(FRAMES[1], "Content-Length: 1e3"), 0),
        (of_length(FRAMES[1], len(FRAMES[1])), 0),
    ],
    ids=["padded", "without length", "length of no sense", "right"],
)
def test_where_lengths_were_right_others_are_there_before_the_next_delimiter(
    last: bytes, rest: int
) -> None:
    begun = last[: last.index(FRAMES[1]) + len(FRAMES[1]) + rest]
    stream = DELIMITER + b"".join(GOOD * ENOUGH) + begun
    assert read_all(stream) == ([FRAMES[0]] * ENOUGH + [FRAMES[1]], 0)


@pytest.mark.parametrize("cut", range(len(DELIMITER) + 3))
def test_pieces_do_not_matter_where_bytes_are_missing_inside(cut: int) -> None:
    begun = DELIMITER + b"".join([*GOOD * ENOUGH, *LACKING])
    stream, first = begun + b"".join(GOOD), len(begun) - cut
    pieces = iter([first, *[1] * (cut + 3), *[1 << 20] * 3])
    assert read_all(stream, pieces) == ([FRAMES[0]] * (ENOUGH + 1), 1)


@given(at=st.integers(0, 100_000), garbage=st.binary(min_size=1, max_size=300))
def test_what_is_handed_over_was_sent_unless_the_bytes_lie_inside_it(
    at: int, garbage: bytes
) -> None:
    stream = DELIMITER + b"".join(parts())
    at %= len(stream)
    frames, _ = read_all(stream[:at] + garbage + stream[at:])
    untouched = [jpeg for jpeg in frames if jpeg in FRAMES]
    assert len(untouched) >= len(FRAMES) - 1
    assert len(frames) <= len(FRAMES) + garbage.count(b"\xff\xd8")


@pytest.mark.parametrize("cut", range(len(DELIMITER) + 1))
def test_a_delimiter_that_comes_in_two_pieces_ends_a_part_without_an_end(cut: int) -> None:
    begun = DELIMITER + headed(FRAMES[0][:-9])
    pieces = iter([len(begun) - cut, cut, *[1 << 20] * 2] if cut else [len(begun), 1 << 20, 1])
    assert read_all(begun + part(FRAMES[1], Stamp()), pieces) == (FRAMES[1:2], 1)


def test_memory_is_bounded(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(multipart, "LARGEST_PART", 1 << 16)
    head = DELIMITER + b"\r\n" + FRAMES[0][: scan_start(FRAMES[0])]
    pieces = iter([head, *[bytes(1 << 16)] * 99, b"\r\n", DELIMITER + parts()[1]])
    reader = MultipartReader(lambda _: next(pieces, b""), BOUNDARY)
    kept = []
    more = reader._more
    monkeypatch.setattr(reader, "_more", lambda: (more(), kept.append(len(reader._kept))))
    assert [jpeg for jpeg, _ in reader] == FRAMES[1:2]
    assert max(kept) <= (1 << 16) * 2 + len(head) < LARGEST_PART


@given(st.binary(max_size=400))
def test_no_bytes_upset_the_search_for_pixels(data: bytes) -> None:
    for begun in (data, FRAMES[0][:30] + data, b"\xff\xd8" + data):
        try:
            found = scan_start(begun)
        except NotJpegError:
            continue
        assert found is None or found >= 4


def test_a_thumbnail_does_not_end_its_frame() -> None:
    stored = io.BytesIO()
    exif = Image.Exif()
    exif[0x010E] = "thumb"
    payload = b"Exif\0\0" + FRAMES[1]
    Image.new("RGB", (32, 16), (200, 10, 30)).save(stored, "JPEG", exif=payload)
    with_thumbnail = stored.getvalue()
    assert FRAMES[1] in with_thumbnail
    assert read_all(DELIMITER + part(with_thumbnail, Stamp()))[0] == [with_thumbnail]


def test_both_decoders_refuse_what_is_cut_and_agree(monkeypatch: pytest.MonkeyPatch) -> None:
    jpeg = encode_jpeg(np.full((32, 48, 3), (200, 80, 10), np.uint8))
    quick = decode_jpeg(jpeg)
    assert np.abs(quick.astype(int) - (200, 80, 10)).max() <= 2
    for simplejpeg in (True, False):
        if not simplejpeg:
            monkeypatch.setattr("recon.stream.jpeg.simplejpeg", None)
        assert np.abs(decode_jpeg(jpeg).astype(int) - quick).max() <= 1
        for damaged in (jpeg[:-30], jpeg[:-2], jpeg[20:], b"", b"text"):
            with pytest.raises(WedgeError, match="not a whole JPEG"):
                decode_jpeg(damaged)


def test_both_decoders_leave_a_frame_as_it_lies_and_refuse_one_too_large(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    file, turned = io.BytesIO(), Image.Exif()
    turned[0x0112] = 6  # by a quarter
    Image.new("RGB", (32, 16)).save(file, "JPEG", exif=turned)
    jpeg = file.getvalue()
    huge = jpeg.replace(struct.pack(">BHH", 8, 16, 32), struct.pack(">BHH", 8, 65_500, 65_500))
    for simplejpeg in (True, False):
        if not simplejpeg:
            monkeypatch.setattr("recon.stream.jpeg.simplejpeg", None)
        assert decode_jpeg(jpeg).shape == (16, 32, 3)
        with pytest.raises(WedgeError, match="65500x65500 pixels"):
            decode_jpeg(huge)


def test_both_decoders_refuse_a_grey_frame(monkeypatch: pytest.MonkeyPatch) -> None:
    file = io.BytesIO()
    Image.new("L", (32, 16), 90).save(file, "JPEG")
    for simplejpeg in (True, False):
        if not simplejpeg:
            monkeypatch.setattr("recon.stream.jpeg.simplejpeg", None)
        with pytest.raises(WedgeError, match="grey, not in colour"):
            decode_jpeg(file.getvalue())
        for cut in range(len(file.getvalue())):
            with pytest.raises(WedgeError):
                decode_jpeg(file.getvalue()[:cut])


@pytest.mark.parametrize("left", [1, 2, 20, 300, -2, -1])
def test_a_stream_that_ends_amid_a_jpeg_says_so(left: int) -> None:
    begun = DELIMITER + headed(FRAMES[0]) + b"\r\n"
    for end, cut in ((b"", False), (FRAMES[1][:left], True), (FRAMES[1], False)):
        source = io.BytesIO(begun + end)
        reader = MultipartReader(source.read, BOUNDARY)
        assert [jpeg for jpeg, _ in reader] == FRAMES[:1] + [FRAMES[1]] * (end == FRAMES[1])
        assert (reader.cut, reader.corrupt) == (cut, 0)
