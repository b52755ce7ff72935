# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Random objects pressed into elastic gel, with where they touch it: what contacts are learnt from.

An object is the height to which it reaches below the untouched skin, in pixels. The skin above it
obeys the law of ``recon.contact.mask.pressure_mm``: without pressure it springs back over the
collar's length, and it never passes through the object, an obstacle problem.
"""

from collections.abc import Callable
from typing import Any

import cv2
import numpy as np
from jaxtyping import Bool, Float32

from recon.kernels import compiled
from recon.training.chance import log_uniform

Map = Float32[np.ndarray, "h w"]
Plane = tuple[Map, Map]
"""Coordinates of every pixel, in pixels, from an object's centre and turned with it."""

NOTHING_PX = -1e3
"""Where there is no object."""
COLLAR_PX = (2.5, 9.0)
HALF_SHARE = (0.08, 0.5)
"""Half widths of objects, in sides of the frame."""
DEPTH_COLLARS = (0.25, 4.0)
"""Deepest points, in lengths of the collar."""
STEEPEST = 1.8
"""Of an object's sides that touch; beyond, no light comes back that a camera could read."""
TOUCHING_PX = 0.01
SWEEPS_PER_COLLAR_PX = 8


def random_press(
    rng: np.random.Generator, height_px: int, width_px: int
) -> tuple[Map, Bool[np.ndarray, "h w"], float]:
    """Depth of the skin in pixels, where it is touched, and the collar's length in pixels."""
    collar = log_uniform(rng, *COLLAR_PX)
    reach = random_objects(rng, height_px, width_px, collar)
    skin, touched = pressed_skin(reach, collar)
    return skin, touched, collar


def random_objects(
    rng: np.random.Generator, height_px: int, width_px: int, collar_px: float
) -> Map:
    """How far one object or some reach below the untouched skin, in pixels.

    Args:
        rng: the only source of chance.
        height_px: rows.
        width_px: columns.
        collar_px: of the gel, over which its skin springs back; depths are drawn in these.
    """
    reach = np.full((height_px, width_px), NOTHING_PX, np.float32)
    single = rng.random() < 0.6
    room = min(height_px, width_px) * (1.0 if single else 0.6)
    deepest = collar_px * log_uniform(rng, *DEPTH_COLLARS)
    for _ in range(1 if single else rng.integers(2, 5)):
        half = rng.uniform(*HALF_SHARE) * room
        margin = half * (0.3 if rng.random() < 0.15 else 1.0) + 2
        middle = [
            rng.uniform(margin, side - margin) if side > 2 * margin else side / 2
            for side in (width_px, height_px)
        ]
        angle = rng.uniform(0, 2 * np.pi) if rng.random() < 0.7 else np.pi / 2 * rng.integers(4)
        y, x = np.mgrid[:height_px, :width_px].astype(np.float32)
        x, y = x - np.float32(middle[0]), y - np.float32(middle[1])
        cos, sin = np.float32(np.cos(angle)), np.float32(np.sin(angle))
        u, v = cos * x + sin * y, cos * y - sin * x
        make = OBJECTS[rng.integers(len(OBJECTS))]
        top = make(rng, (u, v), half, deepest)
        depth = deepest * (1.0 if single else rng.uniform(0.5, 1.0))
        inside = top > NOTHING_PX / 2
        if inside.any():
            reach = np.maximum(reach, np.where(inside, top - top[inside].max() + depth, NOTHING_PX))
    return reach


def pressed_skin(reach_px: Map, collar_px: float) -> tuple[Map, Bool[np.ndarray, "h w"]]:
    """Smallest skin that no object passes through, and where it is held; the border is free.

    Projected successive over-relaxation in red-black order (Cryer, SIAM J. Control 9, 1971).
    """
    pull = collar_px**2
    jacobi = 4 * pull / (1 + 4 * pull)  # what Jacobi's iteration leaves of an error
    pace = 2 / (1 + np.sqrt(1 - jacobi**2))
    skin = np.pad(np.maximum(reach_px, 0), 1, mode="edge").astype(np.float32)
    sweeps = round(SWEEPS_PER_COLLAR_PX * collar_px)
    _relax(skin, reach_px.astype(np.float32), np.float32(pull), np.float32(pace), sweeps)
    depth = skin[1:-1, 1:-1].copy()
    return depth, (reach_px > 0) & (depth - reach_px < TOUCHING_PX)


def _take_relaxed(skin: Any, floor: Any, pull: Any, pace: Any, sweeps: int) -> None:
    height, width = floor.shape
    kept, share = 1 - pace, pace * pull / (1 + 4 * pull)
    for half_sweep in range(2 * sweeps):
        for column in range(width + 2):
            skin[0, column], skin[height + 1, column] = skin[1, column], skin[height, column]
        for row in range(1, height + 1):
            skin[row, 0], skin[row, width + 1] = skin[row, 1], skin[row, width]
            for column in range(1 + (row + half_sweep) % 2, width + 1, 2):
                around = skin[row - 1, column] + skin[row + 1, column]
                around += skin[row, column - 1] + skin[row, column + 1]
                moved = kept * skin[row, column] + share * around
                skin[row, column] = max(moved, floor[row - 1, column - 1])


_relax = compiled(_take_relaxed)


def _round(rng: np.random.Generator, plane: Plane, half: float, deepest: float) -> Map:
    """A ball or an ellipsoid: its cap is as high as the press is deep where it ends."""
    aspect = log_uniform(rng, 0.5, 2.0) if rng.random() < 0.5 else 1.0
    u, v = plane[0] * aspect, plane[1] / aspect
    radius = max((half**2 + deepest**2) / (2 * deepest), half)
    return _sunk(u**2 + v**2, radius, radius)


def _sunk(squared: Map, radius: float, end: float) -> Map:
    inside = squared < end**2
    return np.where(inside, np.sqrt(np.maximum(radius**2 - squared, 0)), NOTHING_PX).astype(
        np.float32
    )


def _outline(rng: np.random.Generator, plane: Plane, half: float) -> Map:
    """Signed distance to a random outline, about in pixels, negative inside."""
    u, v = plane
    kind = rng.integers(4)
    if kind == 0:  # polygon
        sides = int(rng.integers(3, 8))
        turns = 2 * np.pi * (np.arange(sides) + rng.uniform(-0.2, 0.2, sides)) / sides
        far = half * rng.uniform(0.5, 1.0, sides)
        return np.max(
            [np.cos(a) * u + np.sin(a) * v - d for a, d in zip(turns, far, strict=True)], axis=0
        ).astype(np.float32)
    if kind == 1:  # bar
        narrow = rng.uniform(0.06, 1.0) * half
        return np.maximum(np.abs(u) - half, np.abs(v) - narrow)
    if kind == 2:  # disc, gear or flower
        lobes, wave = int(rng.integers(3, 30)), rng.uniform(0, 0.2)
        reach = half * (1 - wave + wave * np.cos(lobes * np.arctan2(v, u)))
        return np.asarray(np.hypot(u, v) - reach, np.float32)
    distance = np.hypot(u, v)  # ring
    inner = rng.uniform(0.4, 0.9) * half
    lobes, wave = int(rng.integers(3, 30)), rng.uniform(0, 0.3) * (half - inner)
    outer = half - wave * (1 + np.cos(lobes * np.arctan2(v, u))) / 2
    return np.asarray(np.maximum(distance - outer, inner - distance), np.float32)


def _carrier(rng: np.random.Generator, plane: Plane, half: float, deepest: float) -> Map:
    """A large surface: flat, tilted, or bent along one axis or both."""
    u, v = plane
    low = deepest * rng.uniform(0, 1.2)  # how far it falls away within its extent
    kind = rng.integers(4)
    if kind == 0:
        return np.zeros_like(u)
    if kind == 1:
        return np.asarray(-low * u / half / 2, np.float32)
    if kind == 2:
        return np.asarray(-low * (v / half) ** 2, np.float32)
    return np.asarray(-low * (u**2 + v**2) / half**2, np.float32)


def _face(rng: np.random.Generator, plane: Plane, half: float, deepest: float) -> Map:
    """A face with an outline; its rim sharp, rounded or bevelled."""
    outside = _outline(rng, plane, half)
    top = _carrier(rng, plane, half, deepest)
    bevel = rng.uniform(0, 0.4) * half
    if rng.random() < 0.5:
        near = np.clip(outside + bevel, 0, bevel)
        if rng.random() < 0.5:
            top = top - rng.uniform(0.2, STEEPEST) * near
        else:
            top = top - bevel + np.sqrt(np.maximum(bevel**2 - near**2, 0))
    return np.where(outside < 0, top, NOTHING_PX).astype(np.float32)


def _bead(rng: np.random.Generator, plane: Plane, half: float, deepest: float) -> Map:
    """A round bead along an outline's middle: a lip, an O-ring, a wire."""
    outside = _outline(rng, plane, half)
    wide = rng.uniform(1.5, 0.4 * half + 2)
    across = np.abs(outside + wide)
    top = np.sqrt(np.maximum(wide**2 - across**2, 0))
    return np.where(across < wide, top + _carrier(rng, plane, half, deepest / 2), NOTHING_PX)


def _planes(rng: np.random.Generator, plane: Plane, half: float, deepest: float) -> Map:
    """Two to six planes that meet in an edge or a tip, within an outline."""
    u, v = plane
    count = int(rng.choice([2, 2, 3, 3, 4, 6]))
    turns = 2 * np.pi * (np.arange(count) + rng.uniform(-0.3, 0.3, count)) / count
    falls = log_uniform(rng, 0.15, STEEPEST) * rng.uniform(0.6, 1.0, count)
    if rng.random() < 0.4:
        falls[:] = falls.max()
    top = np.min(
        [-f * (np.cos(a) * u + np.sin(a) * v) for a, f in zip(turns, falls, strict=True)], axis=0
    )
    if rng.random() < 0.5:
        top = np.minimum(top, -rng.uniform(0.0, 0.3) * deepest)  # a worn tip
    ended = np.maximum(np.abs(u), np.abs(v)) < half
    return np.where(ended, top, NOTHING_PX).astype(np.float32)


def _cone(rng: np.random.Generator, plane: Plane, half: float, deepest: float) -> Map:
    distance = np.hypot(*plane)
    top = -log_uniform(rng, 0.15, STEEPEST) * distance
    return np.where(distance < half, top, NOTHING_PX).astype(np.float32)


def _textured(rng: np.random.Generator, plane: Plane, half: float, deepest: float) -> Map:
    """A surface with waves or with noise."""
    u, v = plane
    outside, top = _outline(rng, plane, half), _carrier(rng, plane, half, deepest)
    length = log_uniform(rng, 3.5, 24.0)
    height = length * log_uniform(rng, 0.03, 0.3)
    kind = rng.integers(4)
    if kind == 0:  # smooth noise
        grain = rng.standard_normal(u.shape, np.float32)
        smooth = cv2.GaussianBlur(grain, (0, 0), length / 4)
        relief = np.asarray(height * smooth / max(float(smooth.std()), 1e-6) / 2, np.float32)
    else:
        phase = 2 * np.pi * (u + rng.uniform(-0.4, 0.4) * v) / length + rng.uniform(0, 2 * np.pi)
        wave: np.ndarray = np.cos(phase)
        if kind == 2:  # sharp or blunt crests
            wave = 2 * np.abs(phase / (2 * np.pi) % 1 - 0.5) * 2 - 1
        relief = height * np.asarray(wave, np.float32)
        if kind == 3:
            relief = relief * np.cos(2 * np.pi * v / length)
    return np.where(outside < 0, top + relief, NOTHING_PX).astype(np.float32)


def _rod(rng: np.random.Generator, plane: Plane, half: float, deepest: float) -> Map:
    """A lying cylinder, smooth or turned to a profile, perhaps with a lead."""
    u, v = plane
    radius = np.full_like(u, rng.uniform(0.2, 1.0) * half)
    if rng.random() < 0.7:
        pitch, lead = log_uniform(rng, 3.5, 20.0), rng.uniform(-0.3, 0.3)
        wave = np.cos(2 * np.pi * (u + lead * v) / pitch)
        if rng.random() < 0.5:
            wave = np.clip(rng.uniform(1, 2.5) * wave, -1, 1)
        radius = radius + pitch * rng.uniform(0.05, 0.35) * np.asarray(wave, np.float32)
    inside = (np.abs(v) < radius) & (np.abs(u) < half)
    return np.where(inside, np.sqrt(np.maximum(radius**2 - v**2, 0)), NOTHING_PX)


def _many(rng: np.random.Generator, plane: Plane, half: float, deepest: float) -> Map:
    """One small thing on a lattice."""
    pitch = rng.uniform(8, max(12.0, 0.9 * half))
    skew = rng.uniform(0.7, 1.4)
    near = []
    for along, step in zip(plane, (pitch, pitch * skew), strict=True):
        most = max(1, int(half / step))
        near.append(along - np.clip(np.round(along / step), -most, most) * np.float32(step))
    small = OBJECTS[rng.integers(4)]
    top = small(rng, (near[0], near[1]), rng.uniform(0.25, 0.5) * pitch, deepest)
    carrier = _carrier(rng, plane, half, deepest)
    if rng.random() < 0.3:  # on a face
        face = carrier - rng.uniform(0.3, 1.0) * deepest
        low = float(top[top > NOTHING_PX / 2].max(initial=0.0))
        extent = np.maximum(np.abs(plane[0]), np.abs(plane[1])) < half
        return np.maximum(
            np.where(top > NOTHING_PX / 2, top - low + carrier, NOTHING_PX),
            np.where(extent, face, NOTHING_PX),
        ).astype(np.float32)
    return np.where(top > NOTHING_PX / 2, top + carrier, NOTHING_PX).astype(np.float32)


def _grooved(rng: np.random.Generator, plane: Plane, half: float, deepest: float) -> Map:
    """A face cut by grooves in one direction or two."""
    u, v = plane
    top = _face(rng, plane, half, deepest)
    cut = np.zeros(u.shape, bool)
    for _ in range(rng.integers(1, 3)):
        angle = rng.uniform(0, np.pi)
        pitch = rng.uniform(6, 10 + 0.6 * half)
        wide = rng.uniform(0.12, 0.6)
        bend = rng.uniform(0, 0.3) * np.abs(v) if rng.random() < 0.4 else 0
        cut |= ((np.cos(angle) * u + np.sin(angle) * v + bend) / pitch) % 1 < wide
    if cut.all():
        return top
    return np.where(cut & (top > NOTHING_PX / 2), top - rng.uniform(0.2, 3) * deepest, top)


OBJECTS: tuple[Callable[[np.random.Generator, Plane, float, float], Map], ...] = (
    _round,
    _cone,
    _planes,
    _face,
    _face,
    _bead,
    _textured,
    _textured,
    _rod,
    _rod,
    _many,
    _grooved,
    _round,
    _planes,
)
