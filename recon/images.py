# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Frames in and out of files: decoded strictly, RGB from the moment they are decoded."""

import io
import lzma
import tokenize
import warnings
import zipfile
import zlib
from functools import lru_cache
from pathlib import Path

import numpy as np
from numpy.lib.npyio import NpzFile
from PIL import Image, UnidentifiedImageError

from recon.arrays import Frame
from sensor.errors import WedgeError
from sensor.files import write_atomic

FORMATS = ("PNG", "JPEG")
UNREADABLE_IMAGE = (
    OSError,
    SyntaxError,
    ValueError,
    EOFError,
    IndexError,
    Warning,
    Image.DecompressionBombError,
)
MOST_DIGITS = 20
"""Of a frame's number; int() refuses thousands of them."""
UNREADABLE_ARCHIVE = (
    OSError,
    ValueError,
    EOFError,
    RuntimeError,
    MemoryError,  # a header may claim any size
    OverflowError,
    lzma.LZMAError,
    tokenize.TokenError,
    zipfile.BadZipFile,
    zlib.error,
)


def read_image(path: Path) -> Frame:
    """Decode a PNG or a JPEG file.

    Raises:
        WedgeError: the file is missing, truncated, damaged, or without three colours.
    """
    if not path.is_file():
        raise WedgeError(f"{path} is missing.")
    try:
        content = io.BytesIO(path.read_bytes())
        with warnings.catch_warnings(action="error", category=Image.DecompressionBombWarning):
            with Image.open(content, formats=FORMATS) as image:
                image.verify()  # a PNG's checksums, which decoding skips
            with Image.open(content, formats=FORMATS) as image:
                if image.mode not in ("RGB", "RGBA", "P"):
                    raise WedgeError(
                        f"{path} is not an 8-bit colour image (mode {image.mode}): "
                        "three colours are needed."
                    )
                return np.asarray(image.convert("RGB"))
    except UnidentifiedImageError as error:  # its own words name a buffer's address
        raise WedgeError(f"{path} is neither a PNG nor a JPEG image.") from error
    except UNREADABLE_IMAGE as error:
        raise WedgeError(f"{path} cannot be decoded, it may be truncated: {error}.") from error


def read_frame(folder: Path, name: str) -> Frame:
    """A frame as ``labels.csv`` names it: an image file, or ``frames.npz#17``.

    Raises:
        WedgeError: the file or the frame in it is missing or damaged.
    """
    file, hash_mark, index = name.partition("#")
    if not hash_mark:
        return read_image(folder / file)
    path = folder / file
    if not path.is_file():
        raise WedgeError(f"{path} is missing.")
    frames = _npz_frames(path, path.stat().st_mtime_ns)
    if not index.isdecimal() or len(index) > MOST_DIGITS or int(index) >= len(frames):
        raise WedgeError(f"{path} has no frame {index[:MOST_DIGITS]!r}: it holds {len(frames)}.")
    frame: Frame = frames[int(index)]
    return frame


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


@lru_cache(maxsize=2)
def _npz_frames(path: Path, _modified_ns: int) -> np.ndarray:
    try:
        with path.open("rb") as stream, NpzFile(stream, allow_pickle=False) as archive:
            frames = archive["frames"]
    except KeyError as error:
        raise WedgeError(f"{path} holds no array named frames.") from error
    except UNREADABLE_ARCHIVE as error:
        raise WedgeError(f"{path} cannot be read, it may be truncated: {error}.") from error
    if not isinstance(frames, np.ndarray) or frames.dtype != np.uint8 or frames.shape[3:] != (3,):
        raise WedgeError(f"{path}: frames must be [n, height, width, 3] uint8 RGB.")
    return frames
