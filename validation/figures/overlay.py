# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Frames with words below them, and short clips of such."""

import io
from collections.abc import Sequence

import cv2
import numpy as np
from jaxtyping import UInt8

from recon.arrays import Unwarped

WIDTH_PX = 640
BANNER_PX = 44
QUIET = (220, 220, 220)
MOST_PICTURES = 240
"""Of a clip: of more, every other one goes, as often as it takes."""
PICTURE_MS = 66

Picture = UInt8[np.ndarray, "_ _ 3"]
Color = tuple[int, int, int]
"""RGB."""


def enlarged(image: Unwarped) -> Picture:
    """The gel plane, ``WIDTH_PX`` wide, to be drawn on."""
    height, width = image.shape[:2]
    size = WIDTH_PX, round(height * WIDTH_PX / width)
    levels = (255 * np.clip(image, 0, 1)).astype(np.uint8)
    return np.asarray(cv2.resize(levels, size, interpolation=cv2.INTER_LINEAR))


def with_words(picture: Picture, words: str, color: Color, numbers: str = "") -> Picture:
    """A picture with a line or two below it; the first in its color."""
    banner = np.full((BANNER_PX, picture.shape[1], 3), 24, np.uint8)
    for text, height_px, rgb in ((words, 18, color), (numbers, 37, QUIET)):
        place = (10, height_px)
        cv2.putText(banner, text, place, cv2.FONT_HERSHEY_SIMPLEX, 0.48, rgb, 1, cv2.LINE_AA)
    return np.concatenate([picture, banner])


class Clip:
    """Pictures of a stream of any length, evenly spaced and not too many."""

    def __init__(self) -> None:
        self._pictures: list[Picture] = []
        self._every, self._count = 1, 0

    def add(self, picture: Picture) -> None:
        """Take in the next."""
        if self._count % self._every == 0:
            self._pictures.append(picture)
        self._count += 1
        if len(self._pictures) > MOST_PICTURES:
            self._pictures = self._pictures[::2]
            self._every *= 2

    @property
    def empty(self) -> bool:
        """Whether none came."""
        return not self._pictures

    def webp(self) -> bytes:
        """The pictures as one moving WebP; there must be one."""
        return clip_bytes(self._pictures)


def clip_bytes(pictures: Sequence[Picture], picture_ms: int = PICTURE_MS) -> bytes:
    """Pictures as one moving WebP."""
    from PIL import Image

    first, *rest = (Image.fromarray(picture) for picture in pictures)
    stream = io.BytesIO()
    first.save(
        stream,
        format="WEBP",
        save_all=True,
        append_images=rest,
        duration=picture_ms,
        loop=0,
        quality=60,
        method=2,
    )
    return stream.getvalue()
