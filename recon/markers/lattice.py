# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Dots to rows and columns: a bent grid grown from its most regular place."""

import heapq
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float64, Int32
from scipy.spatial import KDTree

from sensor.toml import Pair

Points = Float64[np.ndarray, "n 2"]
Cells = Int32[np.ndarray, "n 2"]
"""Row and column of each dot; rows may begin below zero."""

NEIGHBORS = 8
LONGEST_STEP = 1.75
"""Of the nearest neighbours' distance: the diagonals of a grid still count, second ones do not."""
SAME_STEP = 0.25
"""Steps that differ by less than this share of the spacing are the same."""
LEAST_ANGLE_DEG = 35.0
"""Between the two steps of a grid."""
TOLERANCE = 0.3
"""A dot belongs to the cell whose predicted place it is nearer than this share of the spacing."""
MEMORY = 0.5
"""How much of a neighbour's step the next prediction keeps; the rest is the step just seen."""
DIRECTIONS = ((0, 1), (0, -1), (1, 0), (-1, 0))


@dataclass(frozen=True, kw_only=True)
class Lattice:
    """A grid that explains dots."""

    dots: Int32[np.ndarray, " n"]
    """Which of the given points lie on it."""
    cells: Cells
    """Their rows and columns."""
    empty_cells: Int32[np.ndarray, "e 2"]
    """Cells beside occupied ones where no point lies."""
    empty_px: Float64[np.ndarray, "e 2"]
    """Where a dot of an empty cell should be."""
    spacing_px: float
    """Median distance between neighbours on the grid."""


def grow_lattice(points: Points) -> Lattice | None:
    """The largest grid that grows over points from one seed; ``None`` where none begins.

    Each dot predicts its four neighbours by the steps that led to it, so the grid may bend, as
    it does under a lens or a press. The best fitting prediction is taken first.
    """
    steps = grid_steps(points)
    if steps is None:
        return None
    tree = KDTree(points)
    spacing = float(np.mean(np.linalg.norm(steps, axis=1)))
    seed = _most_regular(points, tree, steps, spacing)
    found: dict[tuple[int, int], int] = {}
    owner: dict[int, tuple[int, int]] = {}
    expected: dict[tuple[int, int], Pair] = {}
    queue: list[tuple[float, int, tuple[int, int], tuple[Pair, Pair]]] = [
        (0.0, seed, (0, 0), (_pair(steps[0]), _pair(steps[1])))
    ]
    lengths: list[float] = []
    while queue:
        _, dot, cell, basis = heapq.heappop(queue)
        if cell in found or dot in owner:
            continue
        found[cell], owner[dot] = dot, cell
        for d_row, d_column in DIRECTIONS:
            beside = (cell[0] + d_row, cell[1] + d_column)
            if beside in found:
                continue
            step = np.array(basis[0] if d_column else basis[1]) * (d_row + d_column)
            place = points[dot] + step
            away, other = tree.query(place)
            if away > TOLERANCE * np.linalg.norm(step) or int(other) in owner:
                expected.setdefault(beside, _pair(place))
                continue
            seen = (points[other] - points[dot]) * (d_row + d_column)
            mixed = MEMORY * np.array(basis[0 if d_column else 1]) + (1 - MEMORY) * seen
            turned = (_pair(mixed), basis[1]) if d_column else (basis[0], _pair(mixed))
            lengths.append(float(np.linalg.norm(seen)))
            heapq.heappush(queue, (float(away), int(other), beside, turned))
    empty = {cell: place for cell, place in expected.items() if cell not in found}
    return Lattice(
        dots=np.array(list(found.values()), np.int32),
        cells=np.array(list(found), np.int32).reshape(-1, 2),
        empty_cells=np.array(list(empty), np.int32).reshape(-1, 2),
        empty_px=np.array(list(empty.values()), np.float64).reshape(-1, 2),
        spacing_px=float(np.median(lengths)) if lengths else spacing,
    )


def grid_steps(points: Points) -> Float64[np.ndarray, "2 2"] | None:
    """The steps along a row and along a column that most points share, x first."""
    if len(points) < 4:
        return None
    count = min(NEIGHBORS, len(points) - 1)
    away, others = KDTree(points).query(points, k=count + 1)
    nearest = float(np.median(away[:, 1]))
    steps = (points[others[:, 1:]] - points[:, None]).reshape(-1, 2)
    lengths = np.linalg.norm(steps, axis=1)
    steps = steps[(lengths > SAME_STEP * nearest) & (lengths < LONGEST_STEP * nearest)]
    if len(steps) < 2:
        return None
    first = _shared_step(steps, nearest)
    if first is None:
        return None
    second = _shared_step(steps[_angles_deg(steps, first) > LEAST_ANGLE_DEG], nearest)
    if second is None:
        return None
    along_x, along_y = sorted((first, second), key=lambda step: abs(step[1]) - abs(step[0]))
    return np.stack([np.sign(along_x[0]) * along_x, np.sign(along_y[1]) * along_y])


def _shared_step(steps: Points, nearest: float) -> Float64[np.ndarray, " 2"] | None:
    """The mean of the most frequent step; a short one before a long one."""
    if not len(steps):
        return None
    both = np.concatenate([steps, -steps])
    tree = KDTree(both)
    support = np.array([len(near) for near in tree.query_ball_point(steps, SAME_STEP * nearest)])
    best = int(np.argmax(support / np.linalg.norm(steps, axis=1)))
    return both[tree.query_ball_point(steps[best], SAME_STEP * nearest)].mean(0)


def _angles_deg(steps: Points, reference: np.ndarray) -> Float64[np.ndarray, " n"]:
    """Between each step and a line, 0 to 90."""
    lengths = np.linalg.norm(steps, axis=1) * np.linalg.norm(reference)
    cosine = np.abs(steps @ reference) / np.maximum(lengths, 1e-12)
    return np.degrees(np.arccos(np.clip(cosine, 0, 1)))


def _most_regular(points: Points, tree: KDTree, steps: np.ndarray, spacing: float) -> int:
    """The point whose four neighbours lie nearest to where the steps say."""
    arms = np.concatenate([steps, -steps])
    away, _ = tree.query(points[:, None] + arms)
    return int(np.argmin(np.minimum(away, spacing).sum(1)))


def _pair(vector: np.ndarray) -> Pair:
    return float(vector[0]), float(vector[1])
