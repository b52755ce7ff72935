# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Random parts to press in: the plain forms that made things consist of, in random sizes.

Ridges, corners, cones, combs, rods, lattices, grooved faces, rings and plates. Each is the height
of an underside in mm, as ``simulation.indenters`` has them, turned by a random angle.
"""

from collections.abc import Callable, Mapping
from functools import partial
from typing import Final

import numpy as np
from numpy.random import Generator

from simulation.indenters import (
    Indenter,
    Profile,
    ball,
    nearest,
    polygon_distance,
    rounded_edge,
)

Drawn = tuple[Profile, float]
"""An underside, and half of its extent in mm."""

FLANKS: Final = (0.3, 2.0)
"""How steep plane flanks are, mm/mm."""
DEPTHS_MM: Final = (0.12, 1.1)
FACE_MM: Final = 3.0
"""How far above its lowest point a part's underside ends."""


def random_part(rng: Generator, kind: str, widest_mm: float) -> Indenter:
    """A part of a kind, of random size, turn and depth.

    Args:
        rng: draws it.
        kind: one of ``KINDS``.
        widest_mm: no larger than this along both axes.
    """
    profile, half_mm = KINDS[kind](rng, widest_mm / 2)
    return Indenter(
        name=kind,
        profile=partial(turned, profile=profile, angle=rng.uniform(0, 2 * np.pi)),
        size_mm=(min(2 * half_mm, widest_mm),) * 2,
        depth_mm=_spread(rng, *DEPTHS_MM),
    )


def turned(x: np.ndarray, y: np.ndarray, *, profile: Profile, angle: float) -> np.ndarray:
    """Height of an underside that is turned by an angle in radians."""
    cosine, sine = np.cos(angle), np.sin(angle)
    return profile(cosine * x + sine * y, cosine * y - sine * x)


def _spread(rng: Generator, low: float, high: float) -> float:
    """Between two sizes, each octave as likely."""
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


def _ended(height: np.ndarray, inside: np.ndarray) -> np.ndarray:
    return np.where(inside & (height < FACE_MM), height, np.inf)


def _ridge(rng: Generator, half_mm: float) -> Drawn:
    """Two plane flanks that meet in an edge, sharp or blunt."""
    length = rng.uniform(0.25, 1) * half_mm
    left, right = (_spread(rng, *FLANKS) for _ in range(2))
    if rng.random() < 0.6:
        right = left
    return partial(
        _ridge_height,
        flanks=(left, right),
        blunt_mm=_blunt(rng),
        half_mm=(length, half_mm),
    ), half_mm


def _ridge_height(
    x: np.ndarray,
    y: np.ndarray,
    *,
    flanks: tuple[float, float],
    blunt_mm: float,
    half_mm: tuple[float, float],
) -> np.ndarray:
    height = np.where(y < 0, -flanks[0] * y, flanks[1] * y)
    inside = (np.abs(x) < half_mm[0]) & (np.abs(y) < half_mm[1])
    return _ended(np.maximum(height - blunt_mm, 0), inside)


def _blunt(rng: Generator) -> float:
    """By how much of its height, in mm, an edge or a tip is cut off; half of them are sharp."""
    return float(rng.uniform(0, 0.4)) if rng.random() < 0.5 else 0.0


def _corner(rng: Generator, half_mm: float) -> Drawn:
    """Three to six plane faces around a tip; none at all: a cone."""
    return partial(
        _corner_height,
        faces=int(rng.choice([0, 3, 3, 4, 4, 5, 6])),
        flank=_spread(rng, 0.4, FLANKS[1]),
        blunt_mm=_blunt(rng),
        half_mm=half_mm,
    ), half_mm


def _corner_height(
    x: np.ndarray, y: np.ndarray, *, faces: int, flank: float, blunt_mm: float, half_mm: float
) -> np.ndarray:
    away = polygon_distance(x, y, sides=faces)
    return _ended(np.maximum(flank * away - blunt_mm, 0), np.hypot(x, y) < half_mm)


def _wave(rng: Generator, pitch_mm: float) -> Callable[[np.ndarray], np.ndarray]:
    """Height over a repeated length, 0 at its crests: round, sharp, flat or smooth ones."""
    return partial(
        _wave_height,
        pitch_mm=pitch_mm,
        form=int(rng.integers(4)),
        height_mm=pitch_mm * rng.uniform(0.15, 0.6),
        crest=rng.uniform(0.2, 0.7),
    )


def _wave_height(
    along: np.ndarray, *, pitch_mm: float, form: int, height_mm: float, crest: float
) -> np.ndarray:
    away = np.abs((along / pitch_mm + 0.5) % 1 - 0.5) * 2  # 0 at a crest, 1 between two
    if form == 0:
        return pitch_mm / 2 * (1 - np.sqrt(np.maximum(1 - away**2, 0)))
    if form == 1:
        return height_mm * away
    if form == 2:
        return height_mm * np.clip((away - crest) / (0.2 * (1 - crest)), 0, 1)
    return height_mm * (1 - np.cos(np.pi * away)) / 2


def _comb(rng: Generator, half_mm: float) -> Drawn:
    """Equal bars side by side, or a face with waves both ways."""
    pitch_mm = _spread(rng, 0.5, 0.8 * half_mm)
    across = _wave(rng, pitch_mm * rng.uniform(0.7, 1.5)) if rng.random() < 0.3 else None
    half_mm = rng.uniform(0.3, 1) * half_mm
    return partial(
        _comb_height, wave=_wave(rng, pitch_mm), across=across, half_mm=half_mm
    ), half_mm  # fmt: skip


def _comb_height(
    x: np.ndarray,
    y: np.ndarray,
    *,
    wave: Callable[[np.ndarray], np.ndarray],
    across: Callable[[np.ndarray], np.ndarray] | None,
    half_mm: float,
) -> np.ndarray:
    height = wave(x) if across is None else np.maximum(wave(x), across(y))
    return _ended(height, np.maximum(np.abs(x), np.abs(y)) < half_mm)


def _rod(rng: Generator, half_mm: float) -> Drawn:
    """A lying cylinder, smooth, turned, or with a thread."""
    pitch_mm = _spread(rng, 0.3, 1.6)
    return partial(
        _rod_height,
        radius_mm=_spread(rng, 0.4, max(0.6, 0.8 * half_mm)),
        length_mm=rng.uniform(0.3, 1) * half_mm,
        wave=_wave(rng, pitch_mm) if rng.random() < 0.6 else None,
        lead_mm=float(rng.choice([0.0, pitch_mm])),
    ), half_mm


def _rod_height(
    x: np.ndarray,
    y: np.ndarray,
    *,
    radius_mm: float,
    length_mm: float,
    wave: Callable[[np.ndarray], np.ndarray] | None,
    lead_mm: float,
) -> np.ndarray:
    turn = np.arcsin(np.clip(y / radius_mm, -1, 1)) / (2 * np.pi)
    radius = radius_mm - (
        0 if wave is None else np.minimum(wave(x + lead_mm * turn), radius_mm / 2)
    )
    inside = (np.abs(x) < length_mm) & (np.abs(y) < radius)
    return _ended(radius_mm - np.sqrt(np.where(inside, radius**2 - y**2, 0)), inside)


def _lattice(rng: Generator, half_mm: float) -> Drawn:
    """Balls, tips or studs side by side, perhaps on a plate."""
    pitch_mm = _spread(rng, 1.0, max(1.2, 1.2 * half_mm))
    most = max(1, min(5, int(2 * half_mm / pitch_mm)))
    size_mm = pitch_mm * rng.uniform(0.2, 0.5)
    form = rng.integers(3)
    if form == 0:
        one: Profile = partial(ball, radius_mm=size_mm)
    elif form == 1:
        one = partial(_corner_height, faces=int(rng.choice([0, 3, 4, 6])),
                      flank=_spread(rng, *FLANKS), blunt_mm=0.0, half_mm=size_mm)  # fmt: skip
    else:
        hole_mm = size_mm * max(0.0, rng.uniform(-1, 0.6))
        edge_mm = min((size_mm - hole_mm) / 2, rng.uniform(0.05, 0.3))
        one = partial(_plate_height, sides=0, rim_mm=size_mm, edge_mm=edge_mm, hole_mm=hole_mm)
    count = int(rng.integers(1, most + 1)), int(rng.integers(1, most + 1))
    plate_mm = rng.uniform(0.2, 2) if rng.random() < 0.5 else np.inf
    return partial(
        _lattice_height, one=one, pitch_mm=pitch_mm, count=count, plate_mm=plate_mm
    ), half_mm  # fmt: skip


def _lattice_height(
    x: np.ndarray,
    y: np.ndarray,
    *,
    one: Profile,
    pitch_mm: float,
    count: tuple[int, int],
    plate_mm: float,
) -> np.ndarray:
    reach_x, reach_y = (n * pitch_mm / 2 for n in count)
    height = one(nearest(x, pitch_mm, count[0]), nearest(y, pitch_mm, count[1]))
    inside = (np.abs(x) < reach_x) & (np.abs(y) < reach_y)
    return np.where(inside, np.minimum(height, plate_mm), np.inf)


def _plate(rng: Generator, half_mm: float) -> Drawn:
    """A flat top, round or with three to six sides, its edge rounded, perhaps with a hole."""
    half_mm = rng.uniform(0.15, 0.9) * half_mm
    sides = int(rng.choice([0, 0, 3, 4, 4, 5, 6]))
    rim_mm = half_mm * np.cos(np.pi / sides) if sides else half_mm
    hole_mm = rim_mm * max(0.0, rng.uniform(-0.8, 0.8))
    return partial(
        _plate_height,
        sides=sides,
        rim_mm=rim_mm,
        edge_mm=min((rim_mm - hole_mm) / 2, rng.uniform(0.05, 0.6)),
        hole_mm=hole_mm,
    ), half_mm


def _plate_height(
    x: np.ndarray, y: np.ndarray, *, sides: int, rim_mm: float, edge_mm: float, hole_mm: float
) -> np.ndarray:
    rim = polygon_distance(x, y, sides=sides)
    past = np.maximum(rim - rim_mm, hole_mm - np.hypot(x, y)) + edge_mm
    return np.where(past < edge_mm, rounded_edge(past, edge_mm), np.inf)


def _ring(rng: Generator, half_mm: float) -> Drawn:
    """A ring of round section, smooth or knurled."""
    radius_mm = rng.uniform(0.25, 0.85) * half_mm
    return partial(
        _ring_height,
        radius_mm=radius_mm,
        wall_mm=radius_mm * _spread(rng, 0.08, 0.7),
        ridges=int(rng.choice([0, 0, 6, 12, 18, 30])),
    ), half_mm


def _ring_height(
    x: np.ndarray, y: np.ndarray, *, radius_mm: float, wall_mm: float, ridges: int
) -> np.ndarray:
    away, azimuth = np.hypot(x, y), np.arctan2(y, x)
    half = wall_mm * (0.5 - (0.12 * (1 + np.cos(ridges * azimuth)) if ridges else 0))
    across = np.clip((away - radius_mm) / half, -1, 1)
    return _ended(half * (1 - np.sqrt(1 - across**2)), np.abs(away - radius_mm) < half)


def _grooved(rng: Generator, half_mm: float) -> Drawn:
    """A flat, cylindrical or spherical face, cut by grooves of one direction or two."""
    half_mm = rng.uniform(0.35, 1) * half_mm
    bends = [1 / _spread(rng, 6, 60) if rng.random() < 0.5 else 0.0 for _ in range(2)]
    grooves = [
        (rng.uniform(0, np.pi), _spread(rng, 0.8, half_mm + 0.5), rng.uniform(0.15, 0.5),
         _spread(rng, 0.1, 1.0))
        for _ in range(rng.integers(0, 3))
    ]  # fmt: skip
    return partial(_grooved_height, half_mm=half_mm, bends=bends, grooves=grooves), half_mm


def _grooved_height(
    x: np.ndarray,
    y: np.ndarray,
    *,
    half_mm: float,
    bends: list[float],
    grooves: list[tuple[float, float, float, float]],
) -> np.ndarray:
    face = (bends[0] * x**2 + bends[1] * y**2) / 2
    cut = np.zeros(x.shape)
    for angle, pitch_mm, share, depth_mm in grooves:
        along = (x * np.cos(angle) + y * np.sin(angle)) / pitch_mm
        cut = np.maximum(cut, np.where((along % 1) < share, depth_mm, 0))
    return _ended(face + cut, np.maximum(np.abs(x), np.abs(y)) < half_mm)


KINDS: Final[Mapping[str, Callable[[Generator, float], Drawn]]] = {
    "ridge": _ridge,
    "corner": _corner,
    "comb": _comb,
    "rod": _rod,
    "lattice": _lattice,
    "plate": _plate,
    "ring": _ring,
    "grooved": _grooved,
}
