# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Arrays as pictures that a browser shows, and as a surface that it turns."""

import base64
from functools import lru_cache

import cv2
import numpy as np

from recon.arrays import ContactMask, DepthMap, Difference, Frame
from recon.stream.jpeg import encode_jpeg
from sensor.toml import Pair

WIDTH_PX = 480
CONTRAST = 2.0
"""Factor on difference images, around middle grey."""
SURFACE_COLUMNS = 72
SURFACE_WIDTH = 8.0
"""Width of the surface in the units of its scene."""
QUALITY = 85
FINE_QUALITY = 95
"""JPEG quality of pictures that somebody measures in: off by about 2 of 255 levels, with a third of
a PNG's bytes."""
SCENE_GAMMA = 2.2
"""The scene takes the colours of its textures for linear ones."""

Grid = list[list[list[float] | None]]


def raw_picture(frame: Frame) -> str:
    """A frame as the camera gave it."""
    height, width = frame.shape[:2]
    return as_url(_resized(frame, (WIDTH_PX, round(WIDTH_PX * height / width))))


def difference_picture(difference: Difference, mm_per_px: Pair) -> str:
    """What changed since the blank frame; grey is nothing."""
    shown = np.clip(
        127.5 + 255 * CONTRAST * _resized(difference, _size(difference, mm_per_px)), 0, 255
    )
    return as_url(shown.astype(np.uint8))


def depth_picture(
    depth_mm: DepthMap, contact: ContactMask, scale_mm: float, mm_per_px: Pair
) -> str:
    """Depth in colours from 0 to ``scale_mm``, the contact outlined, its deepest point crossed."""
    size = _size(depth_mm, mm_per_px)
    picture = depth_colors(_resized(depth_mm, size), scale_mm)
    mask = cv2.resize(contact.astype(np.uint8), size, interpolation=cv2.INTER_NEAREST)
    outlines, _ = cv2.findContours(mask, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_SIMPLE)
    cv2.drawContours(picture, outlines, -1, (255, 255, 255), 1, cv2.LINE_AA)
    if contact.any():
        row, column = np.unravel_index(np.argmax(np.where(contact, depth_mm, -1)), contact.shape)
        place = (
            round(float(column) * size[0] / depth_mm.shape[1]),
            round(float(row) * size[1] / depth_mm.shape[0]),
        )
        cv2.drawMarker(picture, place, (0, 0, 0), cv2.MARKER_CROSS, 15, 3)
        cv2.drawMarker(picture, place, (255, 255, 255), cv2.MARKER_CROSS, 13, 1)
    return as_url(picture)


def depth_colors(depth_mm: DepthMap, scale_mm: float) -> Frame:
    """Colours of depths from 0 to ``scale_mm``; even steps look even, to the colour-blind too."""
    levels = np.clip(depth_mm * (255 / scale_mm), 0, 255).astype(np.uint8)
    return _viridis()[levels]


def surface(
    depth_mm: DepthMap, scale_mm: float, steepness: float, mm_per_px: Pair
) -> tuple[str, Grid]:
    """The skin as seen from the touched object: its colours, and points of a grid.

    x lies along the columns, y up, z out of the gel, in the scene's units; depth is drawn
    ``steepness`` times as large as it is.
    """
    width, height = _size(depth_mm, mm_per_px)
    rows = max(2, round(SURFACE_COLUMNS * height / width))
    coarse = _resized(depth_mm, (SURFACE_COLUMNS, rows))
    unit = SURFACE_WIDTH / (depth_mm.shape[1] * mm_per_px[0])
    tall = SURFACE_WIDTH * height / width
    x = np.linspace(-SURFACE_WIDTH / 2, SURFACE_WIDTH / 2, SURFACE_COLUMNS)
    y = np.linspace(tall / 2, -tall / 2, rows)
    z = -coarse * unit * steepness
    grid = np.stack([*np.meshgrid(x, y), z], -1).round(3).tolist()
    lit = _lit(depth_colors(_resized(depth_mm, (width // 2, height // 2)), scale_mm), z)
    return as_url(lit), grid


def legend() -> str:
    """The colours of depth as a CSS background, from left to right."""
    colors = _viridis()[::15]
    return "linear-gradient(to right, " + ", ".join(f"rgb({r},{g},{b})" for r, g, b in colors) + ")"


def _lit(colors: Frame, heights: np.ndarray) -> Frame:
    """The colours under a lamp from the upper left, so that the shape shows."""
    step = SURFACE_WIDTH / heights.shape[1]
    down, right = np.gradient(heights / step)
    shade = (1 + 0.55 * (right * -0.7 + down * -0.7) / np.sqrt(1 + right**2 + down**2)).clip(
        0.35, 1.5
    )
    large = cv2.resize(shade.astype(np.float32), colors.shape[1::-1])
    light = (colors / 255) ** SCENE_GAMMA * large[..., None]
    return np.clip(255 * light, 0, 255).astype(np.uint8)


@lru_cache(maxsize=1)
def _viridis() -> np.ndarray:
    ramp = np.arange(256, dtype=np.uint8)[:, None]
    return cv2.cvtColor(cv2.applyColorMap(ramp, cv2.COLORMAP_VIRIDIS), cv2.COLOR_BGR2RGB)[:, 0]


def _size(image: np.ndarray, mm_per_px: Pair) -> tuple[int, int]:
    """Width and height of a picture in which a millimetre is as long along x as along y."""
    height, width = image.shape[:2]
    tall = WIDTH_PX * height * mm_per_px[1] / (width * mm_per_px[0])
    return WIDTH_PX, int(np.clip(round(tall), 16, 4 * WIDTH_PX))


def _resized(image: np.ndarray, size: tuple[int, int]) -> np.ndarray:
    shrinks = image.shape[1] > size[0]
    how = cv2.INTER_AREA if shrinks else cv2.INTER_LINEAR
    return cv2.resize(np.ascontiguousarray(image), size, interpolation=how)


def as_url(picture: Frame, quality: int = QUALITY) -> str:
    """A picture as a JPEG that a page holds in itself.

    One that the browser must ask for may be gone by then, when somebody turns quickly.
    """
    coded = base64.b64encode(encode_jpeg(picture, quality)).decode()
    return f"data:image/jpeg;base64,{coded}"
