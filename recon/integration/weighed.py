# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Depth by slopes that count by how certain they are.

The plain integral (``recon.integration.poisson``) takes every slope to be as wrong as every other,
so that a misread wall tilts the gel all around it. But gel that did not move is known to be flat,
steep skin is read worse than gentle skin, and a slope that was inferred is less certain than one
that was measured. With a doubt d of every slope, depth z should minimize

    sum ((grad z - slope) / d)^2.

and besides, where gel lies as it did before anything touched it, the sum of (z / (d l))^2 with a
length l: a contact that the frame cuts leaves the depth a free border, and what lies beside it
says how deep all is (``resting``). Where d is the same everywhere and nothing rests, that is the
plain integral. Where it is not, the two differ by what varies slowly. So only their difference is
sought, bilinear between the middles of cells of a sixtieth of the frame's shorter side. Conjugate
gradients find it, helped by the plain integral's own solver between square roots of the weights
(Concus and Golub, SIAM J. Numer. Anal. 10(6), 1973).
"""

from dataclasses import dataclass

import cv2
import numpy as np
from jaxtyping import Bool, Float32

from recon.arrays import DepthMap, GradientField
from recon.integration.poisson import Boundary, eigenvalues, midpoint_slopes
from recon.integration.waves import waves
from recon.lights import Axis
from sensor.toml import Pair

STILL = 0.3
"""Doubt of gel that is known to be flat, as drift and faint touches are overlooked; flat gel that
may have moved has 1."""
MORE_PER_SLOPE = 0.5
"""How much the doubt grows with the steepness."""
MEASURED = 0.1
"""Slope, mm/mm: one of flat gel that was inferred, and may err by so much, weighs half as much."""
HELD = 1 / 8
"""Of the frame's shorter side: over this length what lifts or sinks gel that rests dies away."""
AT_LEVEL = 1 / 200
"""Of the frame's shorter side: a part of the still gel that the plain integral puts deeper than
this below another is the flat top of something wide, whose colour did not change."""
LARGE = 0.05
"""Of the still gel: a smaller part does not say where the rest lies."""
CELLS = 60
"""Along the frame's shorter side."""
STEPS = 24
"""At most; ten to fourteen suffice for most frames."""
ENOUGH = 1e-4
"""Of the first residual's energy: about a hundredth of the change is left, no more steps."""
LEAST_WEIGHT = 1e-3
"""By which the steps are helped in cells that lie mostly beyond a free border."""

Map = Float32[np.ndarray, "h w"]
Mask = Bool[np.ndarray, "h w"]
Doubts = Float32[np.ndarray, "h w 2"]
Cells = Float32[np.ndarray, "rows columns"]


@dataclass(frozen=True, kw_only=True)
class BetweenCells:
    """What lies between the middles of neighbouring cells, the border's own neighbours included.

    Beyond a zero border lies a ring of cells at zero, beyond a free one nothing that has weight.
    """

    weight_x: Float32[np.ndarray, "rows between_x"]
    """Mean of 1 / d^2."""
    weight_y: Float32[np.ndarray, "between_y columns"]
    pull_x: Float32[np.ndarray, "rows between_x"]
    """Mean of what the plain integral's slope lacks, mm/mm, times 1 / d^2."""
    pull_y: Float32[np.ndarray, "between_y columns"]


@dataclass(frozen=True, kw_only=True)
class Rest:
    """How firmly each cell is held at zero, none but those inside the frame."""

    weight: Cells
    """Mean of 1 / (d l)^2, mm^-2, and zero where gel may have moved."""
    pull: Cells
    """Mean of what the plain integral puts too deep times that, mm^-1."""


def slope_doubt(gradient: GradientField) -> Map:
    """How wrong slopes are, relative to one another.

    Args:
        gradient: (h, w, 2), mm/mm; exactly zero where the gel is known to be flat.
    """
    steepness = np.sqrt(np.square(gradient).sum(-1))
    return np.where(steepness > 0, 1 + MORE_PER_SLOPE * steepness, STILL).astype(np.float32)


def inferred_doubts(gradient: GradientField, inferred: Axis, doubt: Map) -> Doubts:
    """How wrong the slopes along both axes are where one of them was inferred.

    Args:
        gradient: (h, w, 2), mm/mm; exactly zero where the gel is known to be flat.
        inferred: the axis.
        doubt: (h, w), mm/mm; how far off its slope is expected to be.
    """
    measured = slope_doubt(gradient)
    more = np.hypot(measured, doubt / np.float32(MEASURED))
    return np.stack((more, measured) if inferred == "x" else (measured, more), -1)


def weighed_depth(
    free_mm: DepthMap,
    gradient: GradientField,
    mm_per_px: Pair,
    boundary: Boundary,
    doubts: Doubts | None = None,
    rests: Mask | None = None,
) -> DepthMap:
    """The depth whose slopes differ least from the measured ones, each difference by its doubt.

    Args:
        free_mm: (h, w), mm; the plain integral of the slopes with that boundary.
        gradient: (h, w, 2), mm/mm; exactly zero where the gel is known to be flat.
        mm_per_px: pixel pitch along x and y.
        boundary: that ``free_mm`` was integrated with.
        doubts: of the slopes along x and y; ``slope_doubt`` of both unless given.
        rests: (h, w), gel that is known to lie at depth zero; none unless given.

    Returns:
        (h, w), mm; with a free border and nothing at rest as deep on average as ``free_mm``.
    """
    side_px, ring_px = cell_sides_px(free_mm.shape, boundary)
    around = [(ring_px, ring_px + (-size) % side_px) for size in free_mm.shape]
    depth = np.pad(free_mm.astype(np.float32), around)
    slopes = np.pad(gradient.astype(np.float32), [*around, (0, 0)])
    if doubts is None:
        doubts = np.repeat(slope_doubt(gradient)[..., None], 2, -1)
    doubts = np.pad(doubts, [*around, (0, 0)], constant_values=STILL)
    if not ring_px:
        doubts[free_mm.shape[0] :] = doubts[:, free_mm.shape[1] :] = np.inf
    variance, (slope_x, slope_y) = np.square(doubts), midpoint_slopes(slopes)
    weight_x = 2 / (variance[:, :-1, 0] + variance[:, 1:, 0])
    weight_y = 2 / (variance[:-1, :, 1] + variance[1:, :, 1])
    lacks_x = slope_x - np.diff(depth, axis=1) / mm_per_px[0]
    lacks_y = slope_y - np.diff(depth, axis=0) / mm_per_px[1]
    between = BetweenCells(
        weight_x=_between(weight_x, side_px, boundary),
        weight_y=_between(weight_y.T, side_px, boundary).T,
        pull_x=_between(weight_x * lacks_x, side_px, boundary),
        pull_y=_between((weight_y * lacks_y).T, side_px, boundary).T,
    )
    rest, level_mm = None, 0.0
    if rests is not None and rests.any():
        level_mm = float(free_mm[rests].mean()) if boundary == "neumann" else 0.0
        inside = np.pad(rests.astype(np.float32), around)
        firmness = held_weight(free_mm.shape, mm_per_px)
        rest = Rest(
            weight=firmness * _in_cells(inside, side_px, boundary),
            pull=firmness * _in_cells(inside * (depth - level_mm), side_px, boundary),
        )
    cells_mm = side_px * mm_per_px[0], side_px * mm_per_px[1]
    change = spread(cells_change(between, cells_mm, boundary, rest), free_mm.shape, boundary, rest)
    return np.asarray(free_mm - level_mm + change, free_mm.dtype)


def resting(gradient: GradientField, plain_mm: DepthMap, side_mm: float) -> Mask:
    """Where gel lies as it did before anything touched it.

    Of the parts of the still gel that hang together the highest large one, as skin is only pressed
    in, and all that lie as high.

    Args:
        gradient: (h, w, 2), mm/mm; exactly zero where the gel is known to be flat.
        plain_mm: (h, w), mm, its plain integral.
        side_mm: of the frame, the shorter one.
    """
    still = np.asarray(~gradient.any(-1))
    count, parts = cv2.connectedComponents(still.astype(np.uint8), connectivity=4)
    if count == 1:
        return still
    sizes = np.bincount(parts.ravel(), minlength=count)[1:]
    sums_mm = np.bincount(parts.ravel(), plain_mm.ravel(), minlength=count)[1:]
    depths_mm = sums_mm / sizes
    highest_mm = depths_mm[sizes >= LARGE * sizes.max()].min()
    rests = np.abs(depths_mm - highest_mm) <= AT_LEVEL * side_mm
    return np.asarray(still & np.append(False, rests)[parts])


def held_weight(shape: tuple[int, ...], mm_per_px: Pair) -> float:
    """1 / (d l)^2 of gel that rests, mm^-2."""
    return (STILL * HELD * shorter_side_mm(shape, mm_per_px)) ** -2


def shorter_side_mm(shape: tuple[int, ...], mm_per_px: Pair) -> float:
    """Of a frame of (height, width)."""
    return min(shape[1] * mm_per_px[0], shape[0] * mm_per_px[1])


def cell_sides_px(shape: tuple[int, ...], boundary: Boundary) -> tuple[int, int]:
    """Of the cells of a frame, and of those around it."""
    side_px = max(1, round(min(shape) / CELLS))
    return side_px, side_px if boundary == "dirichlet" else 0


def spread(
    change: Cells, shape: tuple[int, ...], boundary: Boundary, rest: Rest | None = None
) -> Map:
    """The cells' change at every pixel of the frame, of mean zero if nothing holds them."""
    side_px, ring_px = cell_sides_px(shape, boundary)
    ringed = np.pad(change, 1) if ring_px else change
    every = cv2.resize(ringed, (ringed.shape[1] * side_px, ringed.shape[0] * side_px))
    inside = every[ring_px : ring_px + shape[0], ring_px : ring_px + shape[1]]
    return inside if ring_px or rest is not None else inside - inside.mean()


def cells_change(
    between: BetweenCells, pitch_mm: Pair, boundary: Boundary, rest: Rest | None = None
) -> Cells:
    """Of each cell's depth, mm, by preconditioned conjugate gradients.

    Args:
        between: weights, and what is lacking.
        pitch_mm: of the cells, along x and y.
        boundary: zero or free.
        rest: which cells are held at zero; none unless given.
    """
    across, along = between.weight_x / pitch_mm[0] ** 2, between.weight_y / pitch_mm[1] ** 2
    residual = -np.diff(between.pull_x, axis=1) / pitch_mm[0]
    residual -= np.diff(between.pull_y, axis=0) / pitch_mm[1]
    stiffness = -eigenvalues(*residual.shape, pitch_mm, boundary, "f")
    waves_y, waves_x = (waves(count, boundary) for count in residual.shape)
    mean_x = (between.weight_x[:, 1:] + between.weight_x[:, :-1]) / 4
    mean_y = (between.weight_y[1:] + between.weight_y[:-1]) / 4
    root = 1 / np.sqrt(np.maximum(mean_x + mean_y, LEAST_WEIGHT))
    if boundary == "neumann":
        stiffness[0, 0] = 0 if rest is not None else np.inf  # a constant costs nothing
    if rest is not None:
        residual -= rest.pull
        stiffness += (rest.weight * root**2).mean()
    inverse = 1 / stiffness

    def helped(of: Cells) -> Cells:
        spectrum = waves_y @ (root * of) @ waves_x.T
        return np.asarray(root * (waves_y.T @ (inverse * spectrum) @ waves_x))

    rows, columns = residual.shape
    ringed = np.zeros((rows + 2, columns + 2), np.float32)  # zero beyond the border

    def force(depth: Cells) -> Cells:
        ringed[1:-1, 1:-1] = depth
        stress_x = ringed[1:-1, 1:] - ringed[1:-1, :-1]
        stress_y = ringed[1:, 1:-1] - ringed[:-1, 1:-1]
        stress_x *= across
        stress_y *= along
        resisted = stress_x[:, :-1] - stress_x[:, 1:]
        resisted -= stress_y[1:] - stress_y[:-1]
        if rest is not None:
            resisted += rest.weight * depth
        return resisted

    change = np.zeros_like(residual)
    direction = helped(residual)
    energy = first = float(np.vdot(residual, direction))
    for _ in range(STEPS):
        if energy <= ENOUGH * first:
            break
        resisted = force(direction)
        stride = energy / float(np.vdot(direction, resisted))
        change += stride * direction
        residual -= stride * resisted
        towards = helped(residual)
        before, energy = energy, float(np.vdot(residual, towards))
        direction = towards + (energy / before) * direction
    return change


def without_ring(
    between: Float32[np.ndarray, "a b"], boundary: Boundary
) -> Float32[np.ndarray, "rows between"]:
    """What lies between horizontal neighbours within the frame, and between it and its border."""
    return between[1:-1] if boundary == "dirichlet" else np.pad(between, ((0, 0), (1, 1)))


def _in_cells(every: Map, side_px: int, boundary: Boundary) -> Cells:
    """Means of the cells, less those of the ring around a zero border."""
    rows, columns = (size // side_px for size in every.shape)
    cells = every.reshape(rows, side_px, columns, side_px).mean((1, 3))
    return cells[1:-1, 1:-1] if boundary == "dirichlet" else cells


def _between(halves: Map, side_px: int, boundary: Boundary) -> Float32[np.ndarray, "rows between"]:
    """Means of what lies halfway between horizontal neighbours, from cell to cell."""
    rows, count = halves.shape[0] // side_px, (halves.shape[1] + 1) // side_px - 1
    first = side_px // 2
    some = halves[:, first : first + count * side_px]
    return without_ring(some.reshape(rows, side_px, count, side_px).mean((1, 3)), boundary)
