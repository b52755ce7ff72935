# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Where a JPEG ends in a stream of bytes, and its pixels."""

from collections.abc import Iterator
from contextlib import suppress

import cv2
import numpy as np

from recon.arrays import Frame
from recon.images import GRAY, MOST_SCANS, has_many_scans
from sensor.errors import WedgeError

try:
    import simplejpeg
except ModuleNotFoundError:  # OpenCV takes two to three times as long
    simplejpeg = None

START, END = b"\xff\xd8", b"\xff\xd9"
LARGEST_SIDE_PX = 8192
MOST_SEGMENTS = 256
"""Before the coded pixels; cameras write about ten."""
_START_OF_SCAN = 0xDA
_START_OF_FRAME = frozenset(range(0xC0, 0xD0)) - {0xC4, 0xC8, 0xCC}
_WITHOUT_LENGTH = frozenset((0x01, *range(0xD0, 0xD8)))


class NotJpegError(ValueError):
    """The bytes are not those of a JPEG."""


def scan_start(data: bytes | bytearray) -> int | None:
    """Where the coded pixels of a JPEG begin; ``None`` where that has not come yet.

    In them 0xFF is always followed by zero or by a restart marker, so the first END from there on
    is the frame's, never a thumbnail's (ITU-T T.81, B.1.1.5).

    Raises:
        NotJpegError: the bytes are not those of a JPEG.
    """
    for kind, _, end in _segments(data):
        if kind == _START_OF_SCAN:
            return end
    return None


def _segments(data: bytes | bytearray) -> Iterator[tuple[int, int, int]]:
    """What stands before the coded pixels, as far as it has come: kind, begin and end of each.

    Raises:
        NotJpegError: the bytes are not those of a JPEG.
    """
    if not START.startswith(bytes(data[:2])):
        raise NotJpegError
    at = 2
    for _ in range(MOST_SEGMENTS):
        if at + 4 > len(data):
            return
        if data[at] != 0xFF:
            raise NotJpegError
        kind = data[at + 1]
        if kind == 0xFF or kind in _WITHOUT_LENGTH:
            at += 1 if kind == 0xFF else 2
            continue
        length = data[at + 2] << 8 | data[at + 3]
        if length < 2 or kind == END[1]:
            raise NotJpegError
        yield kind, at + 4, (at := at + 2 + length)
        if kind == _START_OF_SCAN:
            return
    raise NotJpegError


def is_whole(jpeg: bytes) -> bool:
    """Whether a JPEG has its head and its end; nothing is decoded."""
    with suppress(NotJpegError):
        coded = scan_start(jpeg)
        return coded is not None and jpeg.find(END, coded) >= 0
    return False


def jpeg_size_px(jpeg: bytes) -> tuple[int, int] | None:
    """Width and height by the head of a JPEG; ``None`` where it has none."""
    shape = _shape(jpeg)
    return None if shape is None else (shape[1], shape[0])


def _shape(jpeg: bytes) -> tuple[int, int, int] | None:
    """Height, width and components, one where it is grey, by the head; ``None`` without one."""
    with suppress(NotJpegError):
        for kind, begin, _ in _segments(jpeg):
            if kind in _START_OF_FRAME:
                height, width = (int.from_bytes(jpeg[begin + i : begin + i + 2]) for i in (1, 3))
                return height, width, int.from_bytes(jpeg[begin + 5 : begin + 6])
    return None


def decode_jpeg(jpeg: bytes, out: np.ndarray | None = None) -> Frame:
    """The pixels of a JPEG, (h, w, 3) uint8 RGB; damaged ones are refused, not repaired.

    Args:
        jpeg: one whole JPEG.
        out: where to write them, if it has the frame's size.

    Raises:
        WedgeError: it is damaged, grey, or of a size beyond sense.
    """
    if has_many_scans(jpeg):
        raise WedgeError(f"the frame is no camera's JPEG: it has more than {MOST_SCANS} scans.")
    if simplejpeg is None:
        return _decode_with_opencv(jpeg)
    try:
        height, width, colors, *_ = simplejpeg.decode_jpeg_header(jpeg)
        if colors == "Gray":
            raise WedgeError(GRAY)
        if max(height, width) > LARGEST_SIDE_PX:
            raise ValueError(f"{width}x{height} pixels")
        if out is not None and out.shape == (height, width, 3):
            return simplejpeg.decode_jpeg(jpeg, "RGB", buffer=out)
        return simplejpeg.decode_jpeg(jpeg, "RGB")
    except ValueError as error:
        raise WedgeError(f"the frame is not a whole JPEG: {error}.") from error


def _decode_with_opencv(jpeg: bytes) -> Frame:
    image = None
    if (shape := _shape(jpeg)) is not None:
        height, width, components = shape
        if max(height, width) > LARGEST_SIDE_PX:
            raise WedgeError(f"the frame is not a whole JPEG: {width}x{height} pixels.")
        if components == 1:
            raise WedgeError(GRAY)
        if END in jpeg[-16:]:
            as_it_lies = cv2.IMREAD_COLOR | cv2.IMREAD_IGNORE_ORIENTATION
            image = cv2.imdecode(np.frombuffer(jpeg, np.uint8), as_it_lies)
    if image is None:
        raise WedgeError("the frame is not a whole JPEG.")
    return cv2.cvtColor(image, cv2.COLOR_BGR2RGB)


def encode_jpeg(frame: Frame, quality: int = 90) -> bytes:
    """A JPEG of a frame, for sources that have none; colour at full resolution."""
    if simplejpeg is not None:
        return simplejpeg.encode_jpeg(np.ascontiguousarray(frame), quality, "RGB", "444")
    options = [cv2.IMWRITE_JPEG_QUALITY, quality, cv2.IMWRITE_JPEG_SAMPLING_FACTOR]
    options.append(cv2.IMWRITE_JPEG_SAMPLING_FACTOR_444)
    done, data = cv2.imencode(".jpg", cv2.cvtColor(frame, cv2.COLOR_RGB2BGR), options)
    if not done:
        raise WedgeError("the frame cannot be written as a JPEG.")
    return data.tobytes()
