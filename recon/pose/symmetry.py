# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""A mesh's own rotations: the turns after which nobody can tell that it was turned.

A turn of the mesh onto itself takes its centre to itself and each flat facet to one of the same
area, distance and spread. Two facets fix a turn, so all turns that take the rarest pair of facets
to a like pair are tried, and those kept that take every facet to its like. How facets are cut into
triangles does not matter.

Every turn is tried on some facets. A turn that is two known ones after each other needs no trial on
the others: each of the two takes all of them to their likes. That some of its own are tried as well
keeps small unlikenesses, as those between neighbours around an ellipse, from adding up.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Float, Int
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from recon.pose.mesh import Mesh
from recon.pose.rigid import Transform, rigid

ALIKE = 1e-3
"""Of the mesh's radius: what is alike but for so much is alike to a touch."""
FLAT_RAD = 2e-3
"""Neighbours whose normals differ by less are of one facet."""
UNLIKE_AREA = 1e-4
"""Of the whole area: slivers whose place is a matter of rounding."""
MOST_FACETS = 20_000
"""A mesh of more is a scan, or all curves."""
MOST_ROTATIONS = 500
GLANCED, PROBED = 8, 200
"""Facets, from the largest to the smallest, that every turn is tried on."""
COUNTED = 100
"""Looks, the rarest first by a rough count, that are counted closely."""


@dataclass(frozen=True, kw_only=True)
class _Facets:
    """Flat parts of a surface, in units of its radius, about its centre."""

    middles: Float[np.ndarray, "f 3"]
    areas: Float[np.ndarray, " f"]
    spreads: Float[np.ndarray, "f 3 3"]
    """Covariance of the places on each."""

    @cached_property
    def looks(self) -> Float[np.ndarray, "f 4"]:
        """Lengths that no turn changes."""
        along = np.sqrt(np.maximum(np.linalg.eigvalsh(self.spreads)[:, 1:], 0))
        distances = np.linalg.norm(self.middles, axis=1)
        return np.column_stack([np.sqrt(self.areas), distances, along])

    @cached_property
    def tree(self) -> cKDTree:
        """By place and looks: of two facets with one middle, the like one is found."""
        return cKDTree(np.column_stack([self.middles, self.looks]))

    def possible(
        self, turns: Float[np.ndarray, "n 3 3"], some: Int[np.ndarray, " s"]
    ) -> Float[np.ndarray, "m 3 3"]:
        """The turns that bring some facets to where like ones are, the least first."""
        turns = turns[np.argsort(-np.trace(turns, axis1=1, axis2=2), kind="stable")]
        moved = (self.middles[some] @ turns.transpose(0, 2, 1)).reshape(-1, 3)
        places = np.column_stack([moved, np.tile(self.looks[some], (len(turns), 1))])
        away = self.tree.query(places, distance_upper_bound=4 * ALIKE)[0].reshape(-1, len(some))
        unlike = np.where(np.isfinite(away), 0, self.areas[some]).sum(1)
        return turns[unlike <= UNLIKE_AREA * self.areas.sum()]

    def fitted(
        self, turn: Float[np.ndarray, "3 3"], some: Int[np.ndarray, " n"]
    ) -> Float[np.ndarray, "3 3"] | None:
        """The turn that takes some facets to their likes best; ``None`` where some have none."""
        places = np.column_stack([self.middles[some] @ turn.T, self.looks[some]])
        away, other = self.tree.query(places, distance_upper_bound=4 * ALIKE)
        other = np.minimum(other, len(self.areas) - 1)  # of those that have none
        spreads = turn @ self.spreads[some] @ turn.T - self.spreads[other]
        size = np.sqrt(np.trace(self.spreads[some], axis1=1, axis2=2)) + ALIKE
        alike = (away < 4 * ALIKE) & (np.abs(spreads).max((1, 2)) < 4 * ALIKE * size)
        if self.areas[some][~alike].sum() > UNLIKE_AREA * self.areas.sum():
            return None
        weights = self.areas[some] * alike
        found = Rotation.align_vectors(self.middles[other], self.middles[some], weights=weights)
        exact: np.ndarray = found[0].as_matrix()
        return exact


def own_rotations(mesh: Mesh) -> list[Transform]:
    """The turns of the object's frame that take a mesh to itself, the identity first.

    A pose ``T`` and ``T @ turn`` look the same. Mirror images do not count: no motion leads there.
    Of a mesh of more than 20 000 facets, or with more than 500 such turns, which is round, only
    the identity is given.
    """
    found = _facets(mesh)
    if found is None:
        return [np.eye(4)]
    facets, center_mm = found
    every = np.argsort(-facets.areas)
    some = every[:: -(-len(every) // PROBED)]
    turns = np.eye(3)[None]
    for candidate in facets.possible(_candidates(facets), some[:GLANCED]):
        turn = facets.fitted(candidate, some)
        if turn is not None and _between(turns, turn[None] @ turns.transpose(0, 2, 1)) > ALIKE:
            turn = facets.fitted(candidate, every)
        if turn is not None and _between(turns, turn[None]) > 10 * ALIKE:
            turns = np.concatenate([turns, turn[None]])
        if len(turns) > MOST_ROTATIONS:
            return [np.eye(4)]
    return [rigid(turn, center_mm - turn @ center_mm) for turn in turns]


def nearest_turn(
    pose: Transform, reference: Transform, rotations: Sequence[Transform]
) -> Transform:
    """That of an object's own rotations after which a pose is turned least from a reference."""
    away = reference[:3, :3].T @ pose[:3, :3]
    return max(rotations, key=lambda turn: float((away.T * turn[:3, :3]).sum()))


def _facets(mesh: Mesh) -> tuple[_Facets, Float[np.ndarray, "3"]] | None:
    """The flat parts, and the centre of the surface in mm; ``None`` where they are too many."""
    rough = mesh.vertices_mm.mean(0)
    radius = float(np.linalg.norm(mesh.vertices_mm - rough, axis=1).max())
    places = (mesh.vertices_mm - rough) / radius
    corners = places[mesh.triangles]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    areas = np.linalg.norm(normals, axis=1) / 2
    there = areas > 1e-12
    corners, normals, areas = corners[there], normals[there], areas[there]
    number, facet = connected_components(_neighbors(mesh.triangles[there], places, normals))
    if not 2 <= number <= MOST_FACETS:
        return None
    total = np.bincount(facet, areas)
    middles = _summed(facet, areas[:, None] * corners.mean(1)) / total[:, None]
    about = corners - middles[facet][:, None]
    squares = np.einsum("tia,tib->tab", about, about)
    sums = about.sum(1)
    squares += sums[:, :, None] * sums[:, None, :]
    spreads = _summed(facet, (areas[:, None, None] * squares / 12).reshape(-1, 9))
    center = total @ middles / total.sum()
    facets = _Facets(
        middles=middles - center,
        areas=total,
        spreads=spreads.reshape(-1, 3, 3) / total[:, None, None],
    )
    return facets, rough + radius * center


def _neighbors(
    triangles: Int[np.ndarray, "t 3"],
    places: Float[np.ndarray, "v 3"],
    normals: Float[np.ndarray, "t 3"],
) -> coo_array:
    """Which triangles share an edge and lie in one plane."""
    _, welded = np.unique(np.round(places / ALIKE**2), axis=0, return_inverse=True)
    ends = welded.reshape(-1)[triangles][:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
    order = np.lexsort(np.sort(ends, 1).T)
    ends, owner = np.sort(ends, 1)[order], np.repeat(np.arange(len(triangles)), 3)[order]
    same = (ends[1:] == ends[:-1]).all(1)
    one, other = owner[:-1][same], owner[1:][same]
    unit = normals / np.linalg.norm(normals, axis=1, keepdims=True)
    flat = np.linalg.norm(np.cross(unit[one], unit[other]), axis=1) < FLAT_RAD
    count = len(triangles)
    return coo_array((np.ones(flat.sum()), (one[flat], other[flat])), shape=(count, count))


def _summed(facet: Int[np.ndarray, " t"], rows: Float[np.ndarray, "t n"]) -> np.ndarray:
    return np.stack([np.bincount(facet, column) for column in rows.T], -1)


def _candidates(facets: _Facets) -> Float[np.ndarray, "n 3 3"]:
    """Turns that take two facets of the rarest looks to two such."""
    tree = cKDTree(facets.looks)
    distances = np.linalg.norm(facets.middles, axis=1)
    far = np.flatnonzero(distances > 0.05)
    if not len(far):
        return np.zeros((0, 3, 3))
    one = _rarest(facets.looks, far, tree)
    aside = np.linalg.norm(np.cross(facets.middles[far], facets.middles[one]), axis=1)
    askew = far[aside > 0.2 * distances[far] * distances[one]]
    if not len(askew):
        return np.zeros((0, 3, 3))
    two = _rarest(facets.looks, askew, tree)
    ones, twos = (
        np.array(tree.query_ball_point(facets.looks[index], 4 * ALIKE)) for index in (one, two)
    )
    products = facets.middles[ones] @ facets.middles[twos].T
    apart = np.abs(products - facets.middles[one] @ facets.middles[two])
    lengths = np.outer(distances[ones], distances[twos])
    first, second = np.nonzero((apart < 4 * ALIKE) & (np.abs(products) < 0.99 * lengths))
    start = _frames(facets.middles[[one]], facets.middles[[two]])[0]
    return _frames(facets.middles[ones[first]], facets.middles[twos[second]]) @ start.T


def _rarest(looks: Float[np.ndarray, "f 4"], some: Int[np.ndarray, " n"], tree: cKDTree) -> int:
    """Of some facets one to which few are alike."""
    cells = np.round(looks[some] / (4 * ALIKE))
    _, first, count = np.unique(cells, axis=0, return_index=True, return_counts=True)
    few = some[first[np.argsort(count, kind="stable")[:COUNTED]]]
    alike = tree.query_ball_point(looks[few], 4 * ALIKE, return_length=True)
    return int(few[np.argmin(alike)])


def _between(turns: Float[np.ndarray, "n 3 3"], others: Float[np.ndarray, "m 3 3"]) -> float:
    """The least angle between a turn and another, in rad, if it is small."""
    nearest = float((turns.reshape(-1, 9) @ others.reshape(-1, 9).T).max())
    return np.sqrt(max(3 - nearest, 0.0))


def _frames(one: Float[np.ndarray, "n 3"], two: Float[np.ndarray, "n 3"]) -> np.ndarray:
    """Right-handed axes in columns: along the first, and across the plane of both."""
    along = one / np.linalg.norm(one, axis=1, keepdims=True)
    across = np.cross(one, two)
    across /= np.linalg.norm(across, axis=1, keepdims=True)
    return np.stack([along, across, np.cross(along, across)], -1)
