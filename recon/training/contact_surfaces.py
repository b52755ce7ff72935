# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Random contacts as sensors know them: balls, prisms, bars, discs, rings, threads, edges, cones.

One or several at a time, some across the border, under a gel that follows beside them and rounds
their rims.
"""

import math
from collections.abc import Callable

import cv2
import numpy as np
from jaxtyping import Float32

from recon.training.chance import log_uniform

Surface = Float32[np.ndarray, "h w"]
Offsets = Float32[np.ndarray, "h w"]

STEEPEST_SLOPE = 2.5  # a ball pressed to 0.9 of its radius has 2.07 at its rim
EMPTY_SHARE = 0.05  # untouched gel, so that noise alone is answered with zero
SINGLE_SHARE = 0.5
ACROSS_BORDER_SHARE = 0.15
COLLAR_SHARE = 0.75


def contact_surface(rng: np.random.Generator, height_px: int, width_px: int) -> Surface:
    """Depth of one pressed gel in pixels: non-negative, slopes at most ``STEEPEST_SLOPE``.

    Args:
        rng: the only source of chance; the same state gives the same surface.
        height_px: rows, at least 8.
        width_px: columns, at least 8.
    """
    depth = np.zeros((height_px, width_px), np.float32)
    if rng.random() < EMPTY_SHARE:
        return depth
    single = rng.random() < SINGLE_SHARE
    room_px = min(height_px, width_px) * (1.0 if single else 0.55)
    for _ in range(1 if single else rng.integers(2, 6)):
        depth = np.maximum(depth, _pressed(rng, depth.shape, room_px))
    depth = _under_gel(rng, depth)
    steepest = float(np.linalg.norm(surface_gradient(depth), axis=-1).max())
    return depth * np.float32(min(1.0, STEEPEST_SLOPE / max(steepest, 1e-6)))


def surface_gradient(depth_px: Surface) -> Float32[np.ndarray, "h w 2"]:
    """(∂depth/∂x, ∂depth/∂y) in px/px by central differences, one-sided on the border."""
    along_y, along_x = np.gradient(depth_px)
    return np.stack([along_x, along_y], axis=-1)


def _pressed(rng: np.random.Generator, shape: tuple[int, ...], room_px: float) -> Surface:
    """One object somewhere, turned somehow; its half width is 0.06 to 0.42 of the room."""
    reach = rng.uniform(0.06, 0.42) * room_px
    margin = reach * (0.3 if rng.random() < ACROSS_BORDER_SHARE else 1.1)
    center_y, center_x = (
        rng.uniform(margin, side - margin) if side > 2 * margin else side / 2 for side in shape
    )
    y, x = np.mgrid[: shape[0], : shape[1]].astype(np.float32)
    x, y = x - np.float32(center_x), y - np.float32(center_y)
    angle = np.float32(rng.uniform(0, np.pi))
    u, v = np.cos(angle) * x + np.sin(angle) * y, np.cos(angle) * y - np.sin(angle) * x
    make = SHAPES[rng.integers(len(SHAPES))]
    return np.maximum(make(rng, u, v, reach), 0).astype(np.float32)


def _ball(rng: np.random.Generator, u: Offsets, v: Offsets, reach: float) -> Surface:
    radius = reach / rng.uniform(0.2, 0.9)
    return _sunk(u**2 + v**2, radius, reach)


def _ellipsoid(rng: np.random.Generator, u: Offsets, v: Offsets, reach: float) -> Surface:
    radius, aspect = reach / rng.uniform(0.2, 0.9), float(np.exp(rng.uniform(-0.5, 0.5)))
    return _sunk((u * aspect) ** 2 + (v / aspect) ** 2, radius, reach)


def _prism(rng: np.random.Generator, u: Offsets, v: Offsets, reach: float) -> Surface:
    sides = int(rng.integers(3, 7))
    angles = [2 * np.pi * side / sides for side in range(sides)]
    outside = np.max([math.cos(a) * u + math.sin(a) * v for a in angles], axis=0) - 0.8 * reach
    return _flat_top(rng, outside, reach)


def _bar(rng: np.random.Generator, u: Offsets, v: Offsets, reach: float) -> Surface:
    half_width = rng.uniform(0.25, 1.0) * reach
    return _flat_top(rng, np.maximum(np.abs(u) - reach, np.abs(v) - half_width), half_width)


def _disc(rng: np.random.Generator, u: Offsets, v: Offsets, reach: float) -> Surface:
    return _flat_top(rng, np.hypot(u, v) - reach, reach)


def _ring(rng: np.random.Generator, u: Offsets, v: Offsets, reach: float) -> Surface:
    from_center = np.hypot(u, v)
    inner = rng.uniform(0.3, 0.7) * reach
    return _flat_top(rng, np.maximum(from_center - reach, inner - from_center), reach)


def _thread(rng: np.random.Generator, u: Offsets, v: Offsets, reach: float) -> Surface:
    """A lying cylinder, in most cases with a thread cut into it."""
    half_width = rng.uniform(0.15, 0.5) * reach
    depth = _sunk(v**2, half_width / rng.uniform(0.3, 0.9), half_width)
    if rng.random() < 0.6:
        pitch, lead = rng.uniform(5, 16), rng.uniform(-0.3, 0.3)
        groove = rng.uniform(0.05, 0.35) * pitch
        depth = depth - groove * (0.5 + 0.5 * np.cos(2 * np.pi * (u + lead * v) / pitch))
    end = rng.uniform(1.0, 2.5) * reach
    return np.minimum(depth, rng.uniform(0.2, 2.5) * (end - np.abs(u)))


def _edge(rng: np.random.Generator, u: Offsets, v: Offsets, reach: float) -> Surface:
    across = rng.uniform(1.0, 4.0) * np.abs(v)
    return rng.uniform(0.1, 1.25) * (reach - np.maximum(across, np.abs(u)))


def _cone(rng: np.random.Generator, u: Offsets, v: Offsets, reach: float) -> Surface:
    return rng.uniform(0.1, 1.25) * (reach - np.hypot(u, v))


SHAPES: tuple[Callable[[np.random.Generator, Offsets, Offsets, float], Surface], ...] = (
    _ball,
    _ball,  # twice as frequent: fingertips, fruit and every calibration
    _ellipsoid,
    _prism,
    _bar,
    _disc,
    _ring,
    _thread,
    _edge,
    _cone,
)


def _sunk(squared: Offsets, radius: float, reach: float) -> Surface:
    """A sphere or cylinder whose circle of contact has the radius ``reach``; negative outside."""
    height = np.sqrt(np.maximum(radius**2 - squared, 0))
    return height - np.float32(np.sqrt(radius**2 - reach**2))


def _flat_top(rng: np.random.Generator, outside: Offsets, reach: float) -> Surface:
    """A flat face with bevelled sides, from the signed distance to its outline."""
    height = rng.uniform(0.05, 0.4) * reach
    return np.clip(-rng.uniform(0.2, 2.5) * outside, 0, height)


def _under_gel(rng: np.random.Generator, depth: Surface) -> Surface:
    """Gel bends beside what touches it, and rounds every rim."""
    if rng.random() < COLLAR_SHARE:
        wide_px = log_uniform(rng, 1.5, 8.0)
        follows = cv2.GaussianBlur(depth, (0, 0), wide_px, borderType=cv2.BORDER_REPLICATE)
        depth = np.maximum(depth, np.float32(rng.uniform(0.3, 1.0)) * follows)
    rounded_px = rng.uniform(0.0, 1.8)
    if rounded_px < 0.4:
        return depth
    return cv2.GaussianBlur(depth, (0, 0), rounded_px, borderType=cv2.BORDER_REPLICATE)
