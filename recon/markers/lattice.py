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

NEIGHBORS = 16
"""Looked at around a dot: with columns three steps apart, six of its own row come first."""
LONGEST_STEP = 1.75
"""Of the nearest neighbours' distance: the diagonals of a grid still count, second ones do not."""
LONGEST_ACROSS = 3.3
"""Of the same: rows and columns may be three times as far apart as the dots in them."""
SAME_STEP = 0.25
"""Steps that differ by less than this share of the spacing are the same."""
LEAST_ANGLE_DEG = 35.0
"""Between the two steps of a grid."""
TOLERANCE = 0.3
"""A dot belongs to the cell whose predicted place it is nearer than this share of the spacing."""
MOST_MISSING = 2
"""Cells in a line without dots, as under a scratch, that the grid steps over..."""
LEAST_BESIDE = 2
"""...to a dot with so many of its own neighbours: a speck has none."""
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
    it does under a lens or a press. The best fitting prediction is taken first. Where dots are
    missing and no way leads around, the grid steps over them.
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
    queue: list[tuple[int, float, int, tuple[int, int], tuple[Pair, Pair]]] = [
        (0, 0.0, seed, (0, 0), (_pair(steps[0]), _pair(steps[1])))
    ]
    lengths: tuple[list[float], list[float]] = ([], [])
    while queue:
        missing, _, dot, cell, basis = heapq.heappop(queue)
        if cell in found or dot in owner:
            continue
        reach = TOLERANCE * min(np.linalg.norm(basis, axis=1))
        if missing and _count_beside(tree, points[dot], basis, reach) < LEAST_BESIDE:
            continue
        found[cell], owner[dot] = dot, cell
        for d_row, d_column in DIRECTIONS:
            axis, sign = int(d_row != 0), d_row + d_column
            step = sign * np.array(basis[axis])
            for count in range(1, MOST_MISSING + 2):
                beside = (cell[0] + count * d_row, cell[1] + count * d_column)
                if beside in found:
                    break
                place = points[dot] + count * step
                away, other = tree.query(place)
                if away <= reach and int(other) not in owner:
                    seen = sign * (points[other] - points[dot]) / count
                    mixed = _pair(MEMORY * np.array(basis[axis]) + (1 - MEMORY) * seen)
                    turned = (basis[0], mixed) if axis else (mixed, basis[1])
                    if count == 1:
                        lengths[axis].append(float(np.linalg.norm(seen)))
                    heapq.heappush(queue, (count - 1, float(away), int(other), beside, turned))
                    break
                if count == 1:
                    expected.setdefault(beside, _pair(place))
                if away <= reach:  # another cell's dot: nothing is missing here
                    break
    shorter, longer = np.sort(np.linalg.norm(steps, axis=1))
    if longer > LONGEST_STEP * shorter and np.ptp(list(found), axis=0).min() < 2:
        return None  # two lines far apart are the edges of something
    empty = {cell: place for cell, place in expected.items() if cell not in found}
    return Lattice(
        dots=np.array(list(found.values()), np.int32),
        cells=np.array(list(found), np.int32).reshape(-1, 2),
        empty_cells=np.array(list(empty), np.int32).reshape(-1, 2),
        empty_px=np.array(list(empty.values()), np.float64).reshape(-1, 2),
        spacing_px=median_length(*map(np.array, lengths)) or spacing,
    )


def grid_steps(points: Points) -> Float64[np.ndarray, "2 2"] | None:
    """The steps along a row and along a column that most points share, x first."""
    if len(points) < 4:
        return None
    count = min(NEIGHBORS, len(points) - 1)
    away, others = KDTree(points).query(points, k=count + 1)
    nearest = float(np.median(away[:, 1]))
    steps = points[others[:, 1:]] - points[:, None]
    away = away[:, 1:]
    away = np.where(away > SAME_STEP * nearest, away, np.inf)  # else a dot seen twice
    first = _shared_step(steps[away < LONGEST_STEP * nearest], nearest)
    if first is None:
        return None
    across = np.where(_angles_deg(steps, first) > LEAST_ANGLE_DEG, away, np.inf)
    shortest = across.argmin(1)[:, None]
    near = np.take_along_axis(across, shortest, 1)[:, 0] < LONGEST_ACROSS * nearest
    second = _shared_step(np.take_along_axis(steps, shortest[..., None], 1)[near, 0], nearest)
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
    support = tree.query_ball_point(steps, SAME_STEP * nearest, return_length=True)
    best = int(np.argmax(support / np.linalg.norm(steps, axis=1)))
    return both[tree.query_ball_point(steps[best], SAME_STEP * nearest)].mean(0)


def _angles_deg(
    steps: Float64[np.ndarray, "n k 2"], reference: np.ndarray
) -> Float64[np.ndarray, "n k"]:
    """Between each step and a line, 0 to 90."""
    lengths = np.linalg.norm(steps, axis=-1) * np.linalg.norm(reference)
    cosine = np.abs(steps @ reference) / np.maximum(lengths, 1e-12)
    return np.degrees(np.arccos(np.clip(cosine, 0, 1)))


def _most_regular(points: Points, tree: KDTree, steps: np.ndarray, spacing: float) -> int:
    """The point whose four neighbours lie nearest to where the steps say."""
    arms = np.concatenate([steps, -steps])
    away, _ = tree.query(points[:, None] + arms)
    return int(np.argmin(np.minimum(away, spacing).sum(1)))


def _count_beside(
    tree: KDTree, place: np.ndarray, basis: tuple[Pair, Pair], reach_px: float
) -> int:
    """How many of a place's four neighbours are there."""
    arms = np.concatenate([basis, np.negative(basis)])
    away, _ = tree.query(place + arms)
    return int((away <= reach_px).sum())


def grid_spacing(places: Points, cells: Cells) -> float:
    """Median distance between neighbours on a grid, whose places may have any unit."""
    lengths = []
    for beside in (1, int(np.ptp(cells[:, 1])) + 2):  # in the row, in the column
        number = (cells - cells.min(0)) @ (int(np.ptp(cells[:, 1])) + 2, 1)
        _, here, there = np.intersect1d(number + beside, number, return_indices=True)
        lengths.append(np.linalg.norm(places[there] - places[here], axis=1))
    return median_length(*lengths)


def median_length(along_rows: np.ndarray, along_columns: np.ndarray) -> float:
    """The median step; of the shorter ones only, where rows and columns differ that much."""
    both = along_rows, along_columns
    lengths = np.concatenate(both)
    shorter = min((np.median(steps) for steps in both if len(steps)), default=0)
    near = lengths[lengths < LONGEST_STEP * shorter]
    return float(np.median(near)) if len(near) else 0.0


def _pair(vector: np.ndarray) -> Pair:
    return float(vector[0]), float(vector[1])
