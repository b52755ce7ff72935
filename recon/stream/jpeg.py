# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Where a JPEG ends in a stream of bytes, and its pixels."""

import cv2
import numpy as np

from recon.arrays import Frame
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
    if not START.startswith(bytes(data[:2])):
        raise NotJpegError
    at = 2
    for _ in range(MOST_SEGMENTS):
        if at + 4 > len(data):
            return None
        if data[at] != 0xFF:
            raise NotJpegError
        kind = data[at + 1]
        if kind == 0xFF or kind in _WITHOUT_LENGTH:
            at += 1 if kind == 0xFF else 2
            continue
        length = data[at + 2] << 8 | data[at + 3]
        if length < 2 or kind == END[1]:
            raise NotJpegError
        at += 2 + length
        if kind == _START_OF_SCAN:
            return at
    raise NotJpegError


def decode_jpeg(jpeg: bytes, out: np.ndarray | None = None) -> Frame:
    """The pixels of a JPEG, (h, w, 3) uint8 RGB; damaged ones are refused, not repaired.

    Args:
        jpeg: one whole JPEG.
        out: where to write them, if it has the frame's size.

    Raises:
        WedgeError: it is damaged, or of a size beyond sense.
    """
    if simplejpeg is None:
        return _decode_with_opencv(jpeg)
    try:
        height, width, *_ = simplejpeg.decode_jpeg_header(jpeg)
        if max(height, width) > LARGEST_SIDE_PX:
            raise ValueError(f"{width}x{height} pixels")
        if out is not None and out.shape == (height, width, 3):
            return simplejpeg.decode_jpeg(jpeg, "RGB", buffer=out)
        return simplejpeg.decode_jpeg(jpeg, "RGB")
    except ValueError as error:
        raise WedgeError(f"the frame is no whole JPEG: {error}.") from error


def _decode_with_opencv(jpeg: bytes) -> Frame:
    data = np.frombuffer(jpeg, np.uint8)
    whole = data.size > 4 and jpeg.startswith(START) and END in jpeg[-16:]
    image = cv2.imdecode(data, cv2.IMREAD_COLOR) if whole else None
    if image is None:
        raise WedgeError("the frame is no whole JPEG.")
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
