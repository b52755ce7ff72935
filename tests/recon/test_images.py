# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
import io
import os
import struct
import tracemalloc
import warnings
import zipfile
import zlib

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from PIL import Image

from recon.images import read_arrays, read_frame, read_image, write_image
from sensor.errors import WedgeError
from tests.synthetic import digitized, gradient_of, shaded
from tests.written import write_anew

PICTURE = digitized(shaded(gradient_of((50.0, 40.0, 15.0)))[24:56:4, 32:80:4])


def encoded(kind, picture=PICTURE, **options):
    stream = io.BytesIO()
    Image.fromarray(picture).save(stream, format=kind, **options)
    return stream.getvalue()


@given(arrays(np.uint8, st.tuples(st.integers(1, 9), st.integers(1, 9), st.just(3))))
@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_a_frame_comes_back_as_written(tmp_path, frame):
    write_image(tmp_path / "frame.png", frame)
    np.testing.assert_array_equal(read_image(tmp_path / "frame.png"), frame)


def test_channels_are_red_green_blue(tmp_path):
    Image.new("RGB", (4, 3), (250, 120, 10)).save(tmp_path / "orange.png")
    assert read_image(tmp_path / "orange.png")[0, 0].tolist() == [250, 120, 10]


def test_palette_and_transparent_pictures_are_colour_too(tmp_path):
    picture = Image.fromarray(PICTURE)
    picture.convert("RGBA").save(tmp_path / "alpha.png")
    np.testing.assert_array_equal(read_image(tmp_path / "alpha.png"), PICTURE)
    picture.quantize(16).save(tmp_path / "palette.png")
    np.testing.assert_array_equal(
        read_image(tmp_path / "palette.png"), np.asarray(picture.quantize(16).convert("RGB"))
    )


IEND_CHECKSUM = 4  # the last bytes of a PNG; without them the picture is still whole


@pytest.mark.parametrize(
    ("kind", "options", "needless"),
    [
        ("PNG", {}, IEND_CHECKSUM),
        ("JPEG", {}, 0),
        ("JPEG", {"progressive": True}, 0),
        ("JPEG", {"quality": 100}, 0),
        ("BMP", {}, 0),
        ("TIFF", {}, 0),
        ("TIFF", {"compression": "tiff_lzw"}, 0),
    ],
)
def test_a_picture_cut_anywhere_is_refused_and_never_half_gray(tmp_path, kind, options, needless):
    path = tmp_path / "frame.img"
    whole = encoded(kind, **options)
    for length in range(len(whole) - needless):
        write_anew(path, whole[:length])
        with pytest.raises(WedgeError, match=r"frame\.img"):
            read_image(path)
    for length in range(len(whole) - needless, len(whole) + 1):
        write_anew(path, whole[:length])
        np.testing.assert_array_equal(read_image(path), np.asarray(Image.open(io.BytesIO(whole))))


def test_a_jpeg_cut_after_its_thumbnail_is_refused(tmp_path):
    thumbnail = encoded("JPEG", PICTURE[::4, ::4])
    segment = b"\xff\xe5" + struct.pack(">H", len(thumbnail) + 2) + thumbnail
    plain = encoded("JPEG")
    whole = plain[:2] + segment + plain[2:]
    (tmp_path / "frame.jpg").write_bytes(whole)
    assert read_image(tmp_path / "frame.jpg").shape == PICTURE.shape
    (tmp_path / "frame.jpg").write_bytes(whole[:-2])
    with pytest.raises(WedgeError, match="truncated"):
        read_image(tmp_path / "frame.jpg")


def test_damaged_words_about_a_picture_cost_nothing_and_are_not_told(tmp_path):
    whole = encoded("JPEG", exif=b"Exif\0\0MM\0*\0\0\0\x08\0\1\1\x12\0\3\0\0\0\1")
    (tmp_path / "frame.jpg").write_bytes(whole)
    with warnings.catch_warnings(action="error"):
        found = read_image(tmp_path / "frame.jpg")
    (tmp_path / "frame.jpg").write_bytes(encoded("JPEG"))
    np.testing.assert_array_equal(found, read_image(tmp_path / "frame.jpg"))


@given(st.data())
@settings(max_examples=200, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_a_png_with_a_changed_byte_is_refused_or_unchanged(tmp_path, data):
    whole = bytearray(encoded("PNG"))
    whole[data.draw(st.integers(0, len(whole) - 1))] ^= data.draw(st.integers(1, 255))
    write_anew(tmp_path / "frame.png", whole)
    try:
        found = read_image(tmp_path / "frame.png")
    except WedgeError:
        return
    np.testing.assert_array_equal(found, PICTURE)


@given(st.data())
@settings(max_examples=200, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_a_damaged_jpeg_gives_a_frame_or_a_sentence(tmp_path, data):
    whole = bytearray(encoded("JPEG"))
    for _ in range(data.draw(st.integers(1, 4))):
        whole[data.draw(st.integers(0, len(whole) - 1))] ^= data.draw(st.integers(1, 255))
    write_anew(tmp_path / "frame.jpg", whole)
    try:
        assert read_image(tmp_path / "frame.jpg").dtype == np.uint8
    except WedgeError as error:
        assert "frame.jpg" in str(error)


@pytest.mark.parametrize(("ending", "kind"), [("tif", "TIFF"), ("png", "PNG"), ("jpg", "MPO")])
def test_a_file_of_several_pictures_is_refused_and_one_of_one_is_not(tmp_path, ending, kind):
    path = tmp_path / f"frame.{ending}"
    more = [Image.fromarray(PICTURE[::-1])]
    path.write_bytes(encoded(kind, save_all=True))
    assert read_image(path).shape == PICTURE.shape
    path.write_bytes(encoded(kind, save_all=True, append_images=more))
    with pytest.raises(WedgeError, match=rf"frame\.{ending} holds several pictures: write each"):
        read_image(path)


@pytest.mark.parametrize(
    ("picture", "mode"),
    [
        (PICTURE[..., 0], "L"),
        (PICTURE[..., 0].astype(np.uint16) * 257, "I;16"),
        (PICTURE[..., 0] > 100, "1"),
    ],
)
def test_a_picture_without_three_colours_is_refused(tmp_path, picture, mode):
    Image.fromarray(picture).save(tmp_path / "gray.png")
    with pytest.raises(WedgeError, match=f"gray.png is not an 8-bit colour image .mode {mode}"):
        read_image(tmp_path / "gray.png")


def png_chunk(kind, content):
    return (
        struct.pack(">I", len(content))
        + kind
        + content
        + struct.pack(">I", zlib.crc32(kind + content))
    )


@pytest.mark.parametrize("side", [10_000, 60_000])
def test_a_picture_that_claims_to_be_vast_is_refused_unread(tmp_path, side):
    header = struct.pack(">IIBBBBB", side, side, 8, 2, 0, 0, 0)
    (tmp_path / "vast.png").write_bytes(
        b"\x89PNG\r\n\x1a\n" + png_chunk(b"IHDR", header) + png_chunk(b"IEND", b"")
    )
    with pytest.raises(WedgeError, match=r"vast\.png"):
        read_image(tmp_path / "vast.png")


def test_other_formats_are_refused(tmp_path):
    for name in ("frame.gif", "frame.webp"):
        Image.fromarray(PICTURE).save(tmp_path / name)
        with pytest.raises(WedgeError, match=name):
            read_image(tmp_path / name)


def test_what_is_missing_is_named(tmp_path):
    with pytest.raises(WedgeError, match=r"none\.png is missing"):
        read_image(tmp_path / "none.png")
    with pytest.raises(WedgeError, match=r"none\.npz is missing"):
        read_frame(tmp_path, "none.npz#0")
    (tmp_path / "folder.png").mkdir()
    with pytest.raises(WedgeError, match=r"folder\.png"):
        read_image(tmp_path / "folder.png")


FRAMES = np.random.default_rng(1).integers(0, 256, (3, 2, 3, 3), np.uint8)


@pytest.mark.parametrize("save", [np.savez, np.savez_compressed])
def test_frames_of_an_npz_are_named_by_index(tmp_path, save):
    save(tmp_path / "frames.npz", frames=FRAMES)
    for index, frame in enumerate(FRAMES):
        np.testing.assert_array_equal(read_frame(tmp_path, f"frames.npz#{index}"), frame)


def test_an_image_by_name_is_a_frame(tmp_path):
    write_image(tmp_path / "frame.png", PICTURE)
    np.testing.assert_array_equal(read_frame(tmp_path, "frame.png"), PICTURE)


def test_who_writes_into_a_frame_does_not_change_it_for_the_next_reader(tmp_path):
    np.savez(tmp_path / "frames.npz", frames=FRAMES)
    write_image(tmp_path / "frame.png", PICTURE)
    for name in ("frames.npz#0", "frame.png"):
        with pytest.raises(ValueError, match="read-only"):
            read_frame(tmp_path, name)[:] = 0


@pytest.mark.parametrize(
    "index", ["3", "-1", "", "1.0", "one", "99999999999999999999", "0#1", "1" * 5000]
)
def test_a_frame_that_an_npz_does_not_hold_is_refused(tmp_path, index):
    np.savez(tmp_path / "frames.npz", frames=FRAMES)
    with pytest.raises(WedgeError, match=r"frames\.npz has no frame .*: it holds 3"):
        read_frame(tmp_path, f"frames.npz#{index}")


def test_a_rewritten_npz_is_read_again(tmp_path):
    path = tmp_path / "frames.npz"
    for shade, time_s in ((1, 1000), (2, 2000)):
        np.savez(path, frames=np.full_like(FRAMES, shade))
        os.utime(path, (time_s, time_s))
        assert (read_frame(tmp_path, "frames.npz#0") == shade).all()


@pytest.mark.parametrize(
    "content",
    [
        {"pictures": FRAMES},
        {"frames": FRAMES.astype(np.float32)},
        {"frames": FRAMES.astype(np.uint16)},
        {"frames": FRAMES[0]},
        {"frames": FRAMES[..., :1]},
        {"frames": np.array([{"any": "object"}], dtype=object)},
    ],
    ids=["no frames", "float", "16 bits", "one frame", "one colour", "objects"],
)
def test_an_npz_that_holds_something_else_is_refused(tmp_path, content):
    np.savez(tmp_path / "frames.npz", **content)
    with pytest.raises(WedgeError, match=r"frames\.npz"):
        read_frame(tmp_path, "frames.npz#0")


@pytest.mark.parametrize(
    "header",
    [
        "{'descr': '|u1', 'fortran_order': False, 'shape': (10**6, 10**6, 10**6, 3)}",
        "{'descr': '|u1', 'fortran_order': False, 'shape': (1000000000, 2000, 2000, 3)}",
        "{'descr': '|u1', 'shape': (1, (''' ",
    ],
)
def test_an_npz_whose_header_lies_is_refused(tmp_path, header):
    text = header.ljust(117).encode() + b"\n"
    with zipfile.ZipFile(tmp_path / "frames.npz", "w") as archive:
        archive.writestr("frames.npy", b"\x93NUMPY\x01\0" + struct.pack("<H", 118) + text + b"abc")
    with pytest.raises(WedgeError, match=r"frames\.npz cannot be read"):
        read_frame(tmp_path, "frames.npz#0")


def npz_of(path, header, packing=zipfile.ZIP_STORED):
    """An archive whose array has this header, of any length, before the frames' bytes."""
    array = b"\x93NUMPY\x01\0" + struct.pack("<H", len(header)) + header + FRAMES.tobytes()
    with zipfile.ZipFile(path, "w", packing) as archive:
        archive.writestr("frames.npy", array)


HEADER = "{'descr': '|u1', 'fortran_order': False, 'shape': (3, 2, 3, 3), }\n"


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("'shape'", "()"),
        ("'|u1'", "()"),
        ("'|u1'", "[" * 90),
        ("'|u1'", "'|V0'"),
        ("(3, 2, 3, 3)", "(3, -2, 3, 3)"),
        ("(3, 2, 3, 3)", "(3, 0, 3, 3)"),
        ("3, 2", f"3, {10**30}"),
    ],
)
def test_a_header_that_no_numpy_writes_is_a_sentence(tmp_path, old, new):
    npz_of(tmp_path / "frames.npz", HEADER.encode())
    np.testing.assert_array_equal(read_frame(tmp_path, "frames.npz#2"), FRAMES[2])
    (tmp_path / "frames.npz").unlink()
    npz_of(tmp_path / "frames.npz", HEADER.replace(old, new).encode())
    with pytest.raises(WedgeError, match=r"frames\.npz"):
        read_frame(tmp_path, "frames.npz#0")


def test_an_npz_that_would_fill_the_memory_is_refused_unread(tmp_path):
    np.savez_compressed(tmp_path / "frames.npz", frames=FRAMES)
    content = bytearray((tmp_path / "frames.npz").read_bytes())
    size = content.rindex(b"PK\1\2") + 24  # in the directory, of what it unpacks to
    content[size : size + 4] = struct.pack("<I", 3 << 30)
    (tmp_path / "frames.npz").write_bytes(content)
    with pytest.raises(WedgeError, match=r"frames\.npz unpacks to 3\.0 GiB, more than 2: keep"):
        read_frame(tmp_path, "frames.npz#0")


@pytest.mark.parametrize("packing", [zipfile.ZIP_BZIP2, zipfile.ZIP_LZMA])
def test_packings_that_unpack_without_bounds_are_refused(tmp_path, packing):
    npz_of(tmp_path / "frames.npz", HEADER.encode(), packing)
    with pytest.raises(WedgeError, match=r"frames\.npz is not packed as numpy packs it"):
        read_frame(tmp_path, "frames.npz#0")


def test_an_npz_that_lies_about_its_size_is_unpacked_no_further(tmp_path):
    stream = io.BytesIO()
    np.save(stream, np.zeros((1, 4000, 4000, 3), np.uint8))
    with zipfile.ZipFile(tmp_path / "frames.npz", "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("frames", b"text" + stream.getvalue())
    content = bytearray((tmp_path / "frames.npz").read_bytes())
    size = content.rindex(b"PK\1\2") + 24
    content[size : size + 4] = struct.pack("<I", 5000)
    (tmp_path / "frames.npz").write_bytes(content)
    tracemalloc.start()
    try:
        with pytest.raises(WedgeError, match=r"frames\.npz"):
            read_frame(tmp_path, "frames.npz#0")
        assert tracemalloc.get_traced_memory()[1] < 4 << 20
    finally:
        tracemalloc.stop()


@pytest.mark.parametrize("content", [b"", b"text", b"PK\3\4"])
def test_what_is_no_picture_is_refused_in_the_same_words_each_time(tmp_path, content):
    (tmp_path / "a.png").write_bytes(content)
    with pytest.raises(WedgeError, match=r"a\.png is not a PNG, JPEG, BMP or TIFF image\.$"):
        read_image(tmp_path / "a.png")


def test_arrays_come_by_name_and_the_rest_is_not_looked_at(tmp_path):
    depth_mm, names = np.linspace(0, 1, 6).reshape(2, 3), np.array([{}], dtype=object)
    np.savez(tmp_path / "many.npz", frames=FRAMES, depth_mm=depth_mm, names=names)
    found = read_arrays(tmp_path / "many.npz", ["depth_mm", "frames"])
    assert list(found) == ["depth_mm", "frames"]
    np.testing.assert_array_equal(found["depth_mm"], depth_mm)
    np.testing.assert_array_equal(found["frames"], FRAMES)
    with pytest.raises(WedgeError, match=r"many\.npz holds no array named force_n"):
        read_arrays(tmp_path / "many.npz", ["frames", "force_n"])
    with pytest.raises(WedgeError, match=r"many\.npz cannot be read"):
        read_arrays(tmp_path / "many.npz", ["names"])


class Mine:
    """Would leave a mark if anything unpickled it."""

    def __reduce__(self):
        return (os.mkdir, (self.mark,))


def test_nothing_is_ever_unpickled(tmp_path):
    bomb = Mine()
    bomb.mark = str(tmp_path / "mark")
    np.savez(tmp_path / "frames.npz", frames=np.array([bomb], dtype=object))
    with pytest.raises(WedgeError):
        read_frame(tmp_path, "frames.npz#0")
    assert not (tmp_path / "mark").exists()


@pytest.mark.parametrize("save", [np.savez, np.savez_compressed])
def test_a_damaged_npz_gives_the_frame_or_a_sentence(tmp_path, save):
    stream = io.BytesIO()
    save(stream, frames=FRAMES)
    whole = stream.getvalue()
    path = tmp_path / "frames.npz"
    damaged = [whole[:length] for length in range(0, len(whole), 3)]
    for place in range(len(whole)):
        changed = bytearray(whole)
        changed[place] ^= 0x55
        damaged.append(bytes(changed))
    for time_s, content in enumerate(damaged):
        write_anew(path, content)
        os.utime(path, (time_s, time_s))  # as a later write would: the cache goes by the date
        try:
            np.testing.assert_array_equal(read_frame(tmp_path, "frames.npz#2"), FRAMES[2])
        except WedgeError as error:
            assert "frames.npz" in str(error)


def test_a_lone_array_and_a_zip_of_something_else_are_refused(tmp_path):
    np.save(tmp_path / "frames.npy", FRAMES)
    with zipfile.ZipFile(tmp_path / "text.npz", "w") as archive:
        archive.writestr("frames", "text")
    for name in ("frames.npy", "text.npz"):
        with pytest.raises(WedgeError, match=name):
            read_frame(tmp_path, f"{name}#0")
