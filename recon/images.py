# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Frames in and out of files: decoded strictly, RGB from the moment they are decoded."""

import io
import lzma
import re
import struct
import tokenize
import warnings
import zipfile
import zlib
from collections.abc import Collection, Sequence
from contextlib import suppress
from functools import lru_cache
from pathlib import Path

import numpy as np
from PIL import ExifTags, Image, UnidentifiedImageError
from PIL.TiffImagePlugin import BITSPERSAMPLE, TiffImageFile

from recon.arrays import Frame
from sensor.errors import WedgeError
from sensor.files import write_atomic

GRAY = "the frame is grey, not in colour: set the camera to colour."
FEW = np.s_[::16, ::16]
"""Of a frame's pixels, which in colour hardly ever are all grey."""
FORMATS = ("PNG", "JPEG", "BMP", "TIFF")
"""Behind the endings of ``sensor.dataset.IMAGES``."""
UNREADABLE_IMAGE = (
    OSError,
    SyntaxError,
    ValueError,
    TypeError,  # of Pillow on a TIFF without its size
    EOFError,
    IndexError,
    Warning,
    Image.DecompressionBombError,
)
TURNED = range(2, 9)
"""EXIF orientations of pictures that do not lie as they are to be shown."""
MOST_SCANS = 100
"""Of a JPEG; writers of progressive ones make about ten, and each takes time."""
MOST_MARKERS = 10_000
"""Of a JPEG that is looked through."""
MARKER = re.compile(rb"\xff[\x02-\xcf\xd8-\xfe]")
"""Of a JPEG, one that begins a segment or ends the picture: coded pixels hold none (ITU-T T.81)."""
PNG_BITS_AT = 24
"""Where a PNG's header says how many bits a colour has."""
MOST_DIGITS = 20
"""Of a frame's number; int() refuses thousands of them."""
MOST_UNPACKED = 2 << 30
"""Bytes: 2300 frames of 640x480, or 350 of 1640x1232. They are in memory at once, and a few
megabytes may be packed so that they unpack to any size."""
PACKED_BY_NUMPY = (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED)
"""Others are unpacked by zipfile without regard to how much comes out."""
UNREADABLE_ARCHIVE = (
    OSError,
    ValueError,
    TypeError,  # as IndexError, of numpy on a header that is Python but none of its own
    IndexError,
    EOFError,
    RuntimeError,
    MemoryError,  # a header may claim any size
    OverflowError,
    lzma.LZMAError,
    tokenize.TokenError,
    zipfile.BadZipFile,
    zlib.error,
)


def is_gray(frame: Frame) -> bool:
    """Whether red, green and blue are the same in every pixel, as where three stand for one.

    A frame of one level is none: it may be dark, or white throughout.
    """
    if not (_has_equal_colors(frame[FEW]) and _has_equal_colors(frame)):
        return False
    return bool(np.ptp(frame) > 0)


def _has_equal_colors(pixels: Frame) -> bool:
    red, green, blue = (pixels[..., channel] for channel in range(3))
    return not ((red != green).any() or (green != blue).any())


def read_image(path: str | Path) -> Frame:
    """Decode a PNG, JPEG, BMP or TIFF file.

    Raises:
        WedgeError: the file is missing, truncated, damaged, without three colours, or of other
            than 8 bits each; or it holds several pictures, as an animated PNG may, or an MPO; or
            is marked to be shown turned.
    """
    path = Path(path)
    _refuse_no_file(path)
    if path.suffix.lower() == ".npz":
        raise WedgeError(f"{path} holds many frames: name one, such as {path.name}#17.")
    try:
        content = io.BytesIO(path.read_bytes())
        with warnings.catch_warnings(action="error", category=Image.DecompressionBombWarning):
            warnings.simplefilter("ignore", UserWarning)  # of EXIF, which nobody asked for
            with Image.open(content, formats=FORMATS) as image:
                if image.format == "JPEG" and has_many_scans(content.getvalue()):
                    raise WedgeError(f"{path} is no camera's JPEG: it has over {MOST_SCANS} scans.")
                if isinstance(image, TiffImageFile):
                    _refuse_other_bits(path, image)
                _refuse_several(path, image)
                image.verify()  # a PNG's checksums, which decoding skips
            with Image.open(content, formats=FORMATS) as image:
                if image.mode not in ("RGB", "RGBA", "P"):
                    raise WedgeError(
                        f"{path} is not an 8-bit colour image (mode {image.mode}): "
                        "red, green and blue are needed."
                    )
                if image.format == "PNG" and content.getbuffer()[PNG_BITS_AT] > 8:
                    raise _other_bits(path, 16)  # Pillow would hand over the upper eight
                _refuse_turned(path, image)
                return np.asarray(image.convert("RGB"))
    except UnidentifiedImageError as error:  # its own words name a buffer's address
        raise WedgeError(f"{path} is not a PNG, JPEG, BMP or TIFF image.") from error
    except UNREADABLE_IMAGE as error:
        raise WedgeError(f"{path} cannot be decoded, it may be truncated: {error}.") from error


def has_many_scans(jpeg: bytes) -> bool:
    """Whether a JPEG has more scans than any camera's: a small file may hold hours of them."""
    if jpeg.count(b"\xff\xda") <= MOST_SCANS:  # nearly every one; others may hold more behind it
        return False
    at, scans = 2, 0
    for _ in range(MOST_MARKERS):
        found = MARKER.search(jpeg, at)
        if found is None or found[0] == b"\xff\xd9":
            return False
        scans += found[0] == b"\xff\xda"
        if scans > MOST_SCANS:
            return True
        at = found.end() + int.from_bytes(jpeg[found.end() : found.end() + 2])
    return True


def _refuse_no_file(path: Path) -> None:
    if path.is_dir():
        raise WedgeError(f"{path} is a folder: name the images in it, such as FOLDER/*.png.")
    if not path.is_file():
        raise WedgeError(f"{path} is missing.")


def _refuse_other_bits(path: Path, image: TiffImageFile) -> None:
    """Refuse what would come as less than it is, without a word."""
    bits = max(image.tag_v2.get(BITSPERSAMPLE, (1,)))
    if bits != 8:
        raise _other_bits(path, bits)


def _refuse_several(path: Path, image: Image.Image) -> None:
    """Refuse what would come as its first picture, without a word."""
    try:
        image.seek(1)
    except EOFError:
        return
    raise WedgeError(f"{path} holds several pictures: write each into a file of its own.")


def _refuse_turned(path: Path, image: Image.Image) -> None:
    """Refuse what one program turns and another leaves, so that circles lie elsewhere."""
    if isinstance(image, TiffImageFile):  # once loaded, it is turned and no longer says so
        mark = image.tag_v2.get(ExifTags.Base.Orientation)
    else:
        image.load()
        mark = None
        with suppress(*UNREADABLE_IMAGE, struct.error):  # damaged words, which nobody asked for
            mark = image.getexif().get(ExifTags.Base.Orientation)
    if mark in TURNED:
        raise WedgeError(
            f"{path} is marked to be shown rotated or mirrored (EXIF orientation {mark}), which "
            "not every program does: save it the way it is meant, without the mark."
        )


def _other_bits(path: Path, bits: int) -> WedgeError:
    """The refusal; nothing says how many of 16 bits a camera fills, so none can be chosen here."""
    return WedgeError(f"{path} has {bits} bits per colour: write it with 8.")


def read_frame(folder: Path, name: str) -> Frame:
    """A frame as ``labels.csv`` names it: an image file, or ``frames.npz#17``. It is read-only.

    Raises:
        WedgeError: the file or the frame in it is missing or damaged.
    """
    file, hash_mark, index = name.partition("#")
    if not hash_mark:
        return read_image(folder / file)
    path = folder / file
    _refuse_no_file(path)
    frames = _npz_frames(path, path.stat().st_mtime_ns)
    if not is_one_of(len(frames), index):
        raise WedgeError(f"{path} has no frame {index[:MOST_DIGITS]!r}: it holds {len(frames)}.")
    frame: Frame = frames[int(index)]
    return frame


def is_one_of(count: int, number: str) -> bool:
    """Whether what stands behind a ``#`` is the number of one of so many frames."""
    return number.isdecimal() and len(number) <= MOST_DIGITS and int(number) < count


def frame_count(archive: Path) -> int:
    """How many frames an ``.npz`` holds.

    Raises:
        WedgeError: the file is damaged, or holds no frames.
    """
    return len(_npz_frames(archive, archive.stat().st_mtime_ns))


def write_image(path: Path, frame: Frame) -> None:
    """Write a PNG atomically."""
    stream = io.BytesIO()
    Image.fromarray(frame).save(stream, format="PNG")
    write_atomic(path, stream.getvalue())


def read_arrays(path: Path, names: Sequence[str]) -> dict[str, np.ndarray]:
    """Arrays of an ``.npz`` by name; what else is in there is not looked at.

    Raises:
        WedgeError: the file is missing or damaged, holds no such array, or one that only pickle
            could read, or they would fill the memory.
    """
    try:
        with zipfile.ZipFile(path) as archive:
            entries = {name: _entry(path, archive, name) for name in names}
            _refuse_vast(path, entries.values())
            return {name: _read_array(archive, entry) for name, entry in entries.items()}
    except UNREADABLE_ARCHIVE as error:
        why = str(error).partition("\n")[0].rstrip(".")
        raise WedgeError(f"{path} cannot be read, it may be truncated: {why}.") from error


@lru_cache(maxsize=2)
def _npz_frames(path: Path, _modified_ns: int) -> np.ndarray:
    frames = read_arrays(path, ["frames"])["frames"]
    if frames.dtype != np.uint8 or frames.shape[3:] != (3,):
        raise WedgeError(f"{path}: frames must be [n, height, width, 3] uint8 RGB.")
    if 0 in frames.shape[1:]:
        raise WedgeError(f"{path}: its frames have no pixels.")
    frames.setflags(write=False)  # who changed one would change it for the next reader
    return frames


def _entry(path: Path, archive: zipfile.ZipFile, name: str) -> zipfile.ZipInfo:
    try:
        return archive.getinfo(f"{name}.npy")
    except KeyError as error:
        raise WedgeError(f"{path} holds no array named {name}.") from error


def _read_array(archive: zipfile.ZipFile, entry: zipfile.ZipInfo) -> np.ndarray:
    with archive.open(entry) as stream:
        array: np.ndarray = np.lib.format.read_array(stream, allow_pickle=False)
    return array


def _refuse_vast(path: Path, entries: Collection[zipfile.ZipInfo]) -> None:
    """Refuse what would fill the memory; of a smaller one, no more than it says is unpacked."""
    if any(entry.compress_type not in PACKED_BY_NUMPY for entry in entries):
        raise WedgeError(f"{path} is not packed as numpy packs it: write it with numpy.savez.")
    unpacked = sum(entry.file_size for entry in entries)
    if unpacked > MOST_UNPACKED:
        raise WedgeError(
            f"{path} unpacks to {unpacked / 2**30:.1f} GiB, more than "
            f"{MOST_UNPACKED / 2**30:g}: keep the frames in several files."
        )
