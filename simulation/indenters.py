# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Objects to press into the gel, as the height of their underside above their lowest point.

An indenter is a function of x and y in mm, from its own centre, that returns heights in mm, and
infinity where it has no underside.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial

import numpy as np

from sensor.errors import WedgeError

Profile = Callable[[np.ndarray, np.ndarray], np.ndarray]
CALIBRATION_BALL_MM = 2.4
"""Radius of the paper's calibration ball."""


@dataclass(frozen=True, kw_only=True)
class Indenter:
    """An object, its extent and how far it is pressed in."""

    name: str
    profile: Profile
    size_mm: tuple[float, float]
    """Along x and y."""
    depth_mm: float
    """Of its lowest point, when nothing else is said."""
    round_mm: float = 0.0
    """Radius of an underside that is one ball; 0 for any other."""
    middle_mm: float = np.inf
    """Height of a round object's middle, where its underside ends: no press is deeper."""


def ball(x: np.ndarray, y: np.ndarray, *, radius_mm: float) -> np.ndarray:
    """The lower half of a ball."""
    squared = x**2 + y**2
    inside = squared < radius_mm**2
    return np.where(
        inside, radius_mm - np.sqrt(np.where(inside, radius_mm**2 - squared, 0)), np.inf
    )


def ball_array(
    x: np.ndarray, y: np.ndarray, *, radius_mm: float, pitch_mm: float, count: tuple[int, int]
) -> np.ndarray:
    """Balls side by side on a square lattice."""
    return ball(nearest(x, pitch_mm, count[0]), nearest(y, pitch_mm, count[1]), radius_mm=radius_mm)


def lego_brick(x: np.ndarray, y: np.ndarray, *, studs: tuple[int, int]) -> np.ndarray:
    """The studded top of a toy brick: studs of 4.8 mm, 1.8 mm high, 8 mm apart."""
    pitch, radius, height = 8.0, 2.4, 1.8
    from_stud = np.hypot(nearest(x, pitch, studs[0]), nearest(y, pitch, studs[1]))
    inside = (np.abs(x) < studs[0] * pitch / 2) & (np.abs(y) < studs[1] * pitch / 2)
    edge = 0.15  # the studs' rounded edge
    top = np.where(from_stud < radius, rounded_edge(from_stud - radius + edge, edge), height)
    return np.where(inside, top, np.inf)


def screw_cap(
    x: np.ndarray, y: np.ndarray, *, radius_mm: float, wall_mm: float, ridges: int
) -> np.ndarray:
    """The open end of a small cap: a ring with a ridged outside, and a bead along its rim."""
    distance, azimuth = np.hypot(x, y), np.arctan2(y, x)
    outer = radius_mm - 0.25 * wall_mm * (1 + np.cos(ridges * azimuth))
    inner = radius_mm - 1.5 * wall_mm
    middle, half = (outer + inner) / 2, (outer - inner) / 2
    across = np.clip((distance - middle) / half, -1, 1)
    ring = half * (1 - np.sqrt(1 - across**2))
    return np.where(np.abs(distance - middle) < half, ring, np.inf)


def m2_screw(x: np.ndarray, y: np.ndarray, *, length_mm: float) -> np.ndarray:
    """The shank of an M2 screw lying along x: a thread of pitch 0.4 mm (ISO 68-1)."""
    pitch, major = 0.4, 1.0
    thread_depth = 0.613 * pitch
    azimuth = np.arcsin(np.clip(y / major, -1, 1))
    turn = np.abs((x / pitch + azimuth / (2 * np.pi)) % 1 - 0.5) * 2
    radius = major - thread_depth * np.clip(turn * 1.25 - 0.125, 0, 1)
    inside = (np.abs(x) < length_mm / 2) & (np.abs(y) < radius)
    return np.where(inside, major - np.sqrt(np.where(inside, radius**2 - y**2, 0)), np.inf)


def thread_rod(x: np.ndarray, y: np.ndarray, *, pitch_mm: float, size_mm: float) -> np.ndarray:
    """Parallel round threads along y, side by side at a pitch: a comb to tell what is resolved."""
    radius = pitch_mm / 2
    across = np.abs((x / pitch_mm) % 1 - 0.5) * pitch_mm
    height = radius - np.sqrt(np.maximum(radius**2 - across**2, 0))
    return np.where(np.maximum(np.abs(x), np.abs(y)) < size_mm / 2, height, np.inf)


def tyre_tread(x: np.ndarray, y: np.ndarray, *, size_mm: float) -> np.ndarray:
    """A model car's tyre: blocks between a zigzag groove and cross grooves, on a wheel along y."""
    wheel, groove, depth = 30.0, 0.09 * size_mm, 0.8
    pitch = size_mm / 4
    zigzag = groove * (np.abs((y / pitch) % 2 - 1) - 0.5) * 2
    grooved = np.abs(x - zigzag) < groove / 2
    side = np.where(x > zigzag, 0.5, 0.0)
    grooved |= np.abs((y / pitch + side + 0.15 * np.abs(x) / pitch) % 1 - 0.5) < groove / pitch / 2
    round_wheel = wheel - np.sqrt(wheel**2 - np.clip(y, -wheel, wheel) ** 2)
    inside = np.maximum(np.abs(x), np.abs(y)) < size_mm / 2
    return np.where(inside, round_wheel + np.where(grooved, depth, 0.0), np.inf)


def cube_corner(x: np.ndarray, y: np.ndarray, *, edge_mm: float) -> np.ndarray:
    """The corner of a cube that stands on it: three faces, each of slope sqrt(2)."""
    angles = np.radians([90.0, 210.0, 330.0])
    height = np.sqrt(2) * np.max([x * np.cos(a) + y * np.sin(a) for a in angles], axis=0)
    return np.where(height < edge_mm / np.sqrt(3), height, np.inf)


def prism(x: np.ndarray, y: np.ndarray, *, length_mm: float, half_angle_deg: float) -> np.ndarray:
    """The edge of a prism along x."""
    height = np.abs(y) / np.tan(np.radians(half_angle_deg))
    return np.where((np.abs(x) < length_mm / 2) & (height < 3), height, np.inf)


def polygon_distance(x: np.ndarray, y: np.ndarray, *, sides: int) -> np.ndarray:
    """Distance in mm from a regular polygon's middle toward its nearest side; 0 sides: a circle.

    One side lies to the right.
    """
    if sides == 0:
        return np.hypot(x, y)
    angles = 2 * np.pi * np.arange(sides) / sides
    return np.asarray(np.max([x * np.cos(a) + y * np.sin(a) for a in angles], axis=0))


def rounded_edge(past: np.ndarray, edge_mm: float) -> np.ndarray:
    """Height of a flat face's edge of that radius, ``past`` mm from where its rounding begins."""
    return np.asarray(
        edge_mm - np.sqrt(np.clip(edge_mm**2 - np.clip(past, 0, edge_mm) ** 2, 0, None))
    )


def nearest(along: np.ndarray, pitch_mm: float, count: int) -> np.ndarray:
    """Distance in mm from the nearest of ``count`` points at a pitch, centred on zero."""
    middle = (count - 1) / 2
    index = np.clip(np.round(along / pitch_mm + middle), 0, count - 1)
    return along - (index - middle) * pitch_mm


def calibration_ball(radius_mm: float = CALIBRATION_BALL_MM) -> Indenter:
    """The ball that labels are made with."""
    return Indenter(
        name="ball",
        profile=partial(ball, radius_mm=radius_mm),
        size_mm=(2 * radius_mm, 2 * radius_mm),
        depth_mm=0.3 * radius_mm,
        round_mm=radius_mm,
        middle_mm=radius_mm,
    )


def shapes(pad_size_mm: tuple[float, float]) -> Mapping[str, Indenter]:
    """The paper's showcase objects and three plain solids, as large as suits the pad."""
    least = min(pad_size_mm)
    studs = max(1, int(min(16.0, 0.9 * least) // 8))
    cap, tyre, screw = min(5.0, 0.4 * least), min(12.0, 0.8 * least), min(8.0, 0.6 * least)
    balls = max(2, min(4, int(0.9 * least // 3)))
    rows = [
        (
            "ball_array",
            partial(ball_array, radius_mm=1.2, pitch_mm=3.0, count=(balls, balls)),
            (3.0 * balls, 3.0 * balls),
            0.5,
        ),
        ("lego", partial(lego_brick, studs=(studs, studs)), (8.0 * studs, 8.0 * studs), 0.5),
        (
            "screw_cap",
            partial(screw_cap, radius_mm=cap, wall_mm=0.16 * cap, ridges=24),
            (2 * cap, 2 * cap),
            0.4,
        ),
        ("m2_screw", partial(m2_screw, length_mm=screw), (screw, 2.0), 0.6),
        ("tyre", partial(tyre_tread, size_mm=tyre), (tyre, tyre), 0.5),
        ("cube_corner", partial(cube_corner, edge_mm=6.0), (7.0, 7.0), 1.2),
        ("prism", partial(prism, length_mm=5.0, half_angle_deg=60.0), (5.0, 3.0), 0.5),
        ("threads", partial(thread_rod, pitch_mm=0.8, size_mm=6.0), (6.0, 6.0), 0.3),
    ]
    middles_mm = {"ball_array": 1.2, "m2_screw": 1.0}
    return {
        name: Indenter(
            name=name,
            profile=profile,
            size_mm=size,
            depth_mm=depth,
            middle_mm=middles_mm.get(name, np.inf),
        )
        for name, profile, size, depth in rows
    }


def refuse_depth(indenter: Indenter, depth_mm: float) -> None:
    """Refuse a depth to which an object cannot be pressed, whatever the gel.

    Raises:
        WedgeError: the depth is not finite or not positive, or sinks a round object past its
            middle.
    """
    if not depth_mm > 0:
        raise WedgeError(f"{indenter.name}: a press of {depth_mm:g} mm must be deeper than zero.")
    if not np.isfinite(depth_mm):
        raise WedgeError(f"{indenter.name}: a press of {depth_mm:g} mm must be a finite number.")
    if depth_mm > indenter.middle_mm:
        raise WedgeError(
            f"{indenter.name}: a press of {depth_mm:g} mm pushes it in past its middle, "
            f"{indenter.middle_mm:g} mm above its lowest point: press less deep."
        )


def refuse_size(indenter: Indenter, pad_size_mm: tuple[float, float]) -> None:
    """Refuse an object that does not fit the pad.

    Raises:
        WedgeError: it is larger than the pad, or has no size.
    """
    if not all(size > 0 for size in indenter.size_mm):
        raise WedgeError(
            f"{indenter.name} of {indenter.size_mm[0]:g} x {indenter.size_mm[1]:g} mm must be "
            "larger than zero."
        )
    if any(size > pad for size, pad in zip(indenter.size_mm, pad_size_mm, strict=True)):
        raise WedgeError(
            f"{indenter.name} of {indenter.size_mm[0]:g} x {indenter.size_mm[1]:g} mm is larger "
            f"than the pad of {pad_size_mm[0]:g} x {pad_size_mm[1]:g} mm: take a "
            "smaller one, name an object that fits, or widen the pad."
        )
