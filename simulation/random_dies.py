# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Random dies to press in: flat faces within sharp outlines, whose walls are steeper than balls.

A die's outline is a disc or a polygon, perhaps stretched, pierced, with a corner cut out, or
repeated as pins; its edge is hardly rounded.
"""

from functools import partial
from typing import Final

import numpy as np
from numpy.random import Generator

from simulation.indenters import Indenter, nearest, polygon_distance, rounded_edge
from simulation.random_parts import turned

DEPTHS_MM: Final = (0.3, 1.0)
EDGES_MM: Final = (0.01, 0.15)
"""Radii of the rounded edge."""
LONGEST: Final = 5.0
"""Times as long as wide."""

Cut = tuple[float, float, float]
"""Direction of a first side, how far from the middle both lie (of the rim), angle between them."""


def random_die(rng: Generator, widest_mm: float) -> Indenter:
    """A die of random outline, size, turn and depth.

    Args:
        rng: draws it.
        widest_mm: no larger than this along both axes.
    """
    half_mm = rng.uniform(0.2, 0.8) * widest_mm / 2
    sides = int(rng.choice([0, 0, 3, 4, 4, 5, 6]))
    rim_mm = half_mm * np.cos(np.pi / sides) if sides else half_mm
    count = int(rng.choice([1, 1, 1, 2, 3]))
    pitch_mm = half_mm * 2 / count * 1.15
    if count > 1:
        rim_mm = rim_mm / count * rng.uniform(0.4, 0.9)
    profile = partial(
        _die_height,
        sides=sides,
        rim_mm=rim_mm,
        stretch=float(np.exp(rng.uniform(0, np.log(LONGEST)))) if rng.random() < 0.4 else 1.0,
        hole_mm=rim_mm * max(0.0, rng.uniform(-1, 0.7)),
        cut=(rng.uniform(0, 6.3), rng.uniform(-0.3, 0.5), rng.uniform(0.6, 2.4))
        if rng.random() < 0.35
        else None,
        edge_mm=rng.uniform(*EDGES_MM),
        count=count,
        pitch_mm=pitch_mm,
    )
    return Indenter(
        name="die",
        profile=partial(turned, profile=profile, angle=rng.uniform(0, 6.28)),
        size_mm=(min(2.4 * half_mm, widest_mm),) * 2,
        depth_mm=float(rng.uniform(*DEPTHS_MM)),
    )


def _die_height(
    x: np.ndarray,
    y: np.ndarray,
    *,
    sides: int,
    rim_mm: float,
    stretch: float,
    hole_mm: float,
    cut: Cut | None,
    edge_mm: float,
    count: int,
    pitch_mm: float,
) -> np.ndarray:
    if count > 1:
        x, y = nearest(x, pitch_mm, count), nearest(y, pitch_mm, count)
    y = y * stretch
    rim = polygon_distance(x, y, sides=sides)
    past = np.maximum(rim - rim_mm, hole_mm - np.hypot(x, y))
    if cut is not None:
        first, apart, between = cut
        inside = [
            x * np.cos(angle) + y * np.sin(angle) - apart * rim_mm
            for angle in (first, first + between)
        ]
        past = np.maximum(past, np.minimum(*inside))
    past = past + edge_mm
    return np.where(past < edge_mm, rounded_edge(past, edge_mm), np.inf)
