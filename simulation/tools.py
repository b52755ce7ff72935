# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Plain tools to press in: flat tops, edges, steps, pins and round things, each at two depths.

Made things mostly have what neither a ball nor an odd thing shows: a flat face between edges, read
from the gel beside it alone. None of them is taught to any estimator, nor drawn at random.
"""

from collections.abc import Mapping
from functools import partial
from typing import Final

import numpy as np

from simulation.indenters import Indenter, Profile, ball, nearest, polygon_distance

DEPTHS_MM: Final = {"shallow": 0.3, "deep": 0.7}
LARGEST_UNIT_MM: Final = 1.5
"""Of which the smallest pad's are a tenth of its width."""
STEP: Final = 0.2
"""Between the two faces of a stepped tool, in units."""


def tools(pad_size_mm: tuple[float, float]) -> Mapping[str, Indenter]:
    """Every tool at every depth by its name, as large as suits the pad.

    Args:
        pad_size_mm: along x and y.
    """
    unit_mm = min(LARGEST_UNIT_MM, min(pad_size_mm) / 10)
    return {
        f"{name}_{how}": Indenter(
            name=f"{name}_{how}",
            profile=partial(_scaled, profile=profile, unit_mm=unit_mm),
            size_mm=(2 * half * unit_mm,) * 2,
            depth_mm=depth_mm,
        )
        for name, (profile, half) in TOOLS.items()
        for how, depth_mm in DEPTHS_MM.items()
    }


def _scaled(x: np.ndarray, y: np.ndarray, *, profile: Profile, unit_mm: float) -> np.ndarray:
    return unit_mm * profile(x / unit_mm, y / unit_mm)


def _flat(inside: np.ndarray, height: float = 0.0) -> np.ndarray:
    return np.where(inside, height, np.inf)


def _disc(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    return _flat(np.hypot(x, y) < 2)


def _peg(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    return _flat(np.hypot(x, y) < 0.8)


def _square(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    return _flat(np.maximum(np.abs(x), np.abs(y)) < 1.6)


def _triangle(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    return _flat(polygon_distance(x, y, sides=3) < 1.2)


def _hexagon(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    return _flat(polygon_distance(x, y, sides=6) < 1.8)


def _bar(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    return _flat((np.abs(x) < 3) & (np.abs(y) < 0.6))


def _cross(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    return np.minimum(_bar(x, y), _bar(y, x))


def _ring(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    return _flat(np.abs(np.hypot(x, y) - 2) < 0.5)


def _sector(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Three quarters of a disc."""
    return np.where((x > 0) & (y > 0), np.inf, _flat(np.hypot(x, y) < 2.2))


def _moon(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    return np.where(np.hypot(x - 1.3, y) < 1.7, np.inf, _flat(np.hypot(x, y) < 2.2))


def _step(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """A disc with a lower one on it."""
    return np.minimum(_flat(np.hypot(x, y) < 1), _flat(np.hypot(x, y) < 2.4, STEP))


def _pins(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Nine flat pins."""
    return _flat(np.hypot(nearest(x, 1.8, 3), nearest(y, 1.8, 3)) < 0.5)


def _grooves(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Four bars on a deeper face."""
    inside = np.maximum(np.abs(x), np.abs(y)) < 2.4
    bars = np.abs(nearest(x, 1.2, 4)) < 0.3
    return np.where(inside, np.where(bars, 0.0, 1.0), np.inf)


def _frustum(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """A pyramid without its top, its flanks at 45 degrees."""
    away = np.maximum(np.abs(x), np.abs(y))
    return np.where(away < 2.2, np.maximum(away - 1, 0), np.inf)


def _cone(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    away = np.hypot(x, y)
    return np.where(away < 2.4, 0.6 * away, np.inf)


def _dome(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """A ball's cap that ends in an edge."""
    return np.where(np.hypot(x, y) < 1.8, ball(x, y, radius_mm=3.0), np.inf)


def _roller(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """A rod that lies along x, with flat ends."""
    return np.where(np.abs(x) < 2.5, ball(np.zeros_like(y), y, radius_mm=2.0), np.inf)


def _wave(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    inside = np.maximum(np.abs(x), np.abs(y)) < 2.5
    return np.where(inside, 0.2 * (1 - np.cos(2 * np.pi * x / 1.6)), np.inf)


TOOLS: Final[Mapping[str, tuple[Profile, float]]] = {
    "disc": (_disc, 2.0),
    "peg": (_peg, 0.8),
    "square": (_square, 1.6),
    "triangle": (_triangle, 2.4),
    "hexagon": (_hexagon, 2.1),
    "bar": (_bar, 3.0),
    "cross": (_cross, 3.0),
    "ring": (_ring, 2.5),
    "sector": (_sector, 2.2),
    "moon": (_moon, 2.2),
    "step": (_step, 2.4),
    "pins": (_pins, 2.3),
    "grooves": (_grooves, 2.4),
    "frustum": (_frustum, 2.2),
    "cone": (_cone, 2.4),
    "dome": (_dome, 1.8),
    "roller": (_roller, 2.5),
    "wave": (_wave, 2.5),
}
"""Undersides and half of their extents, in units."""
