# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""The pad in a raw frame: the lit four-sided area in the mirror, and which way round it lies.

The sides are straight lines through the steepest fall of brightness, the corners their crossings,
so that round or chipped corners of the gel do not matter.
"""

from typing import Literal

import cv2
import numpy as np
from jaxtyping import Bool, Float32, Float64
from scipy import ndimage

from recon.arrays import Frame
from recon.geometry.unwarp import Corners

Side = Literal["top", "right", "bottom", "left"]
SIDES: tuple[Side, ...] = ("top", "right", "bottom", "left")

CLOSED = (1 / 24, 1 / 48)
"""Dark places so wide are closed, of the frame's shorter side: dots and scratches would be holes.

Where that joins the pad to the direct view of the gel beside it, only narrower ones are.
"""
LEAST_AREA = 0.08
"""Least area of a pad, of the frame."""
LEAST_FILLED = 0.85
"""Least area of a pad, of its four-sided hull: a pad is convex."""
MOST_ON_BORDER = 0.1
"""Share of its outline on the frame's edge, at most: that edge cuts the direct view of the gel."""
MOST_OUTSIDE = 0.7
"""Brightness just outside its sides over that just inside, on average over the four, at most: two
sensors' pads have 0.03 to 0.6, areas that shading alone cuts out of lit gel 0.9 and more."""
AWAY, LEAST_AWAY_PX = 0.02, 4
"""Distance of these places from a side, of the frame's shorter side."""
MIDDLE = (0.12, 0.88)
"""Part of a side that is looked at, as the corners are round."""
LEAST_KEYSTONE = 1.05
POINTS = 80
REFERENCE_PX = 240
"""Shorter side of the frames that the lengths below are for; with larger frames these grow."""
REACH_PX, BLUR_PX, STEP_PX = 6, 1, 0.25

Brightness = Float32[np.ndarray, "h w"]
Points = Float64[np.ndarray, "n 2"]
Point = Float64[np.ndarray, " 2"]


def find_pad(blank: Frame) -> Corners | None:
    """Corners of the pad clockwise in the picture, from its top left; ``None`` where none shows.

    Args:
        blank: raw frame of the untouched gel.
    """
    brightness = cv2.GaussianBlur(blank.max(-1).astype(np.float32), (0, 0), 1)
    height, width = brightness.shape
    for share in CLOSED:
        found = _lit_areas(brightness, max(3, round(share * min(height, width))) | 1)
        if not found:
            continue
        corners = _refined(brightness, max(found, key=_area))
        inside = (corners >= -0.5).all() and (corners <= [width - 0.5, height - 0.5]).all()
        if inside and _stands_out(brightness, corners):
            a, b, c, d = ((float(x), float(y)) for x, y in corners)
            return a, b, c, d
    return None


def gel_corners(clockwise: Corners, base: Side) -> Corners:
    """Corners in the gel frame's order (top left, top right, bottom right, bottom left).

    The mirror turns the picture over, so in that order they run anticlockwise in the picture.

    Args:
        clockwise: corners as they lie in the picture, from its top left.
        base: side of the picture on which the sensor's base with its green light is seen; it
            becomes the left side, the tip the right one.
    """
    turned = clockwise[SIDES.index(base) :] + clockwise[: SIDES.index(base)]
    first, second, third, fourth = turned  # first and second are the ends of the base
    return first, fourth, third, second


def base_side(clockwise: Corners) -> Side:
    """The longer one of the two sides that keystone tells apart: the base is nearer to the camera.

    So it is on both published designs and on the four units of two labs whose raw frames
    are known here; a picture without keystone does not tell, and counts as base left.
    """
    corners = np.array(clockwise)
    length = np.linalg.norm(np.roll(corners, -1, axis=0) - corners, axis=1)
    shares = length / np.roll(length, 2)
    longest = int(shares.argmax())
    return SIDES[longest] if shares[longest] > LEAST_KEYSTONE else "left"


def _lit_areas(brightness: Brightness, closed_px: int) -> list[Points]:
    """The four-sided hulls of lit areas, after dark places of up to so many pixels are closed."""
    closed = cv2.morphologyEx(brightness, cv2.MORPH_CLOSE, np.ones((closed_px,) * 2, np.uint8))
    level, _ = cv2.threshold(closed.astype(np.uint8), 0, 255, cv2.THRESH_OTSU)
    areas, count = ndimage.label(closed > level)
    hulls = (_four_sided(areas == index) for index in range(1, count + 1))
    return [hull for hull in hulls if hull is not None]


def _four_sided(area: Bool[np.ndarray, "h w"]) -> Points | None:
    """The four-sided hull of an area, clockwise from its top left, where it is a pad's."""
    height, width = area.shape
    filled = ndimage.binary_fill_holes(area).astype(np.uint8)
    if filled.sum() < LEAST_AREA * area.size:
        return None
    outline = max(cv2.findContours(filled, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)[0], key=len)
    x, y = outline[:, 0].T
    on_border = ((x == 0) | (y == 0) | (x == width - 1) | (y == height - 1)).mean()
    hull = cv2.convexHull(outline)
    for tolerance in np.linspace(0.01, 0.1, 19) * cv2.arcLength(hull, True):
        corners = cv2.approxPolyDP(hull, tolerance, True)[:, 0].astype(np.float64)
        if len(corners) <= 4:
            break
    if len(corners) != 4 or on_border > MOST_ON_BORDER:
        return None
    if filled.sum() < LEAST_FILLED * _area(corners):
        return None
    return _clockwise(corners)


def _stands_out(brightness: Brightness, corners: Points) -> bool:
    """Whether it is much darker outside the sides than inside: across shading there is no step."""
    away_px = max(LEAST_AWAY_PX, AWAY * min(brightness.shape))
    shares = []
    for start, end in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        along = (end - start) / np.linalg.norm(end - start)
        outward = away_px * np.array([along[1], -along[0]])
        places = start + np.linspace(*MIDDLE, POINTS)[:, None] * (end - start)
        x, y = np.stack([places - outward, places + outward]).astype(np.float32).transpose(2, 0, 1)
        inside, outside = cv2.remap(
            brightness, x, y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE
        )
        shares.append(np.median(outside / np.maximum(inside, 1)))
    return bool(np.mean(shares) < MOST_OUTSIDE)


def _area(corners: Points) -> float:
    return float(cv2.contourArea(corners.astype(np.float32)))


def _clockwise(corners: Points) -> Points:
    """In the picture's sense, the corner nearest to its top left first."""
    away = corners - corners.mean(0)
    turned = corners[np.argsort(np.arctan2(away[:, 1], away[:, 0]))]
    first = int(turned.sum(1).argmin())
    return np.roll(turned, -first, axis=0)


def _refined(brightness: Brightness, corners: Points) -> Points:
    """Corners where lines through the steepest fall of brightness cross.

    A camera of more pixels must not see another pad, the gel without its bright wall for one: the
    search reaches as far, and over as much blur, in shares of the frame.
    """
    times = max(1.0, min(brightness.shape) / REFERENCE_PX)
    if times > 1:  # it comes blurred by a pixel already
        more_px = BLUR_PX * np.sqrt(times**2 - 1)
        brightness = cv2.GaussianBlur(brightness, (0, 0), more_px).astype(np.float32)
    lines = [_side(brightness, corners[i], corners[(i + 1) % 4], times) for i in range(4)]
    crossings = []
    for before, after in zip([lines[-1], *lines[:-1]], lines, strict=True):
        normals = np.stack([before[0], after[0]])
        crossings.append(np.linalg.solve(normals, np.array([before[1], after[1]])))
    return np.array(crossings)


def _side(brightness: Brightness, start: Point, end: Point, times: float) -> tuple[Point, float]:
    """Normal and offset of a side's line: normal @ point = offset."""
    along = (end - start) / np.linalg.norm(end - start)
    outward = np.array([along[1], -along[0]])  # clockwise on a screen, whose y points down
    places = start + np.linspace(*MIDDLE, POINTS)[:, None] * (end - start)
    reach = np.arange(-REACH_PX, REACH_PX + STEP_PX / 2, STEP_PX) * times
    x, y = np.moveaxis(places[:, None] + outward * reach[:, None], -1, 0).astype(np.float32)
    profiles = cv2.remap(brightness, x, y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    fall = -np.gradient(profiles.astype(np.float64), axis=1)
    points = places + outward * reach[fall.argmax(1)][:, None]
    dx, dy, x0, y0 = cv2.fitLine(points.astype(np.float32), cv2.DIST_HUBER, 0, 0.01, 0.01).ravel()
    normal = np.array([-dy, dx], dtype=np.float64)
    return normal, float(normal @ [x0, y0])
