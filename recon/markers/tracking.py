# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Dots followed from the gel at rest through a press, each under its own number.

The skin stretches smoothly, so a dot moves nearly as its neighbours do. A spot that fits that is
the dot; a dot without such a spot is not seen, and is carried along by its neighbours until it
shows again: behind an object's edge, or beyond the frame's.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Bool, Float64
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import KDTree

from recon.arrays import ContactMask, Unwarped
from recon.markers.detection import (
    WEAKER_ON_GRID,
    Markers,
    dark_spots,
    find_markers,
    inside,
)
from recon.markers.lattice import Points
from recon.markers.shapes import DotShapes, dot_shapes
from sensor.toml import Pair

Places = Float64[np.ndarray, "m 2"]

NEIGHBORS = 8
REACH = 0.45
"""A spot may be the dot if it is nearer to the expected place than this, in spacings."""
DISAGREEMENT = 0.3
"""A dot moves like its neighbours, give or take this, in spacings."""
ROUNDS = 4
LEAST_SEEN = 0.5
"""Share of the dots in sight, below which nothing is known of where they are."""
LONGEST_STEP = 0.35
"""A longer median step, in spacings, may have moved every dot onto its neighbour's place."""
STEEPEST = 0.5
"""Neighbours whose shifts differ by a larger share of their distance are not both who they seem. It
was 0.35 at most on 123 real frames of three gels, and 0.6 or more with dots taken for others."""
RIM = 2
"""Dots so many neighbours away from a tear are who they seem, on one side of it."""
LEAST_BESIDE = 2
"""Neighbours whose places must be known before they tell a dot's."""
NEARLY_ALL = 0.95
"""Share of the dots that is seen where none is taken for its neighbour: each mistake hides some."""
AT_REST = 0.1
"""With nearly all dots this near to where they rest, in spacings, the gel rests: only a shear by a
whole spacing everywhere would else bring them there."""


@dataclass(frozen=True, kw_only=True)
class Tracked:
    """Where the dots of a gel are in one frame."""

    markers: Markers
    """The dots at rest."""
    position_px: Points
    """(n, 2), column and row of the unwarped frame."""
    seen: Bool[np.ndarray, " n"]
    """False where a dot was carried along by its neighbours."""
    jumped: bool
    """A dot may have been taken for its neighbour since the gel was last seen at rest."""

    @property
    def displacement_px(self) -> Float64[np.ndarray, "n 2"]:
        """From rest."""
        return self.position_px - self.markers.position_px

    def displacement_mm(self, mm_per_px: Pair) -> Float64[np.ndarray, "n 2"]:
        """From rest, in the gel frame."""
        return self.displacement_px * np.array(mm_per_px)

    @property
    def word(self) -> str:
        """How far this can be trusted: "tracked", "jumped" or "lost"."""
        if self.seen.mean() < LEAST_SEEN:
            return "lost"
        return "jumped" if self.jumped else "tracked"


class MarkerTracker:
    """The dots of one gel: found on its blank frame, then followed."""

    def __init__(self, markers: Markers, blank: Unwarped) -> None:
        """Prepare for frames of the gel.

        Args:
            markers: found on the blank frame.
            blank: the unwarped blank frame.
        """
        self.markers = markers
        self._blank = blank
        away_px, near = KDTree(markers.position_px).query(
            markers.position_px, k=min(NEIGHBORS, len(markers) - 1) + 1
        )
        self._near = near[:, 1:]
        self._away_px = np.maximum(away_px[:, 1:], markers.spacing_px)

    @cached_property
    def shapes(self) -> DotShapes:
        """What the dots hide at rest."""
        return dot_shapes(self._blank, self.markers)

    def track(self, image: Unwarped, before: Tracked | None = None) -> Tracked:
        """Find every dot in a frame.

        Args:
            image: the unwarped frame.
            before: the last frame's dots; by default they are sought from rest, which suits
                single pictures.
        """
        start = (
            np.zeros_like(self.markers.position_px) if before is None else before.displacement_px
        )
        unsure = before is not None and before.jumped
        places = self._places(image)
        if not len(places):
            return self._tracked(start, np.zeros(len(start), bool), jumped=unsure)
        moved, seen = self._settled(start, places)
        if unsure:
            again = self._settled(np.zeros_like(start), places)
            if self._rests(*again):
                return self._tracked(*again, jumped=False)
        torn = self._torn(moved, seen)
        if torn.any():
            grown, found = self._grown(self._largest_whole(seen, torn), moved, places)
            if found.mean() >= NEARLY_ALL and not self._torn(grown, found).any():
                moved, seen, torn = grown, found, torn[:0]
        step = np.linalg.norm((moved - start)[seen], axis=1)
        far = bool(len(step)) and float(np.median(step)) > LONGEST_STEP * self.markers.spacing_px
        return self._tracked(moved, seen, jumped=unsure or far or bool(torn.any()))

    def hidden(self, tracked: Tracked | None = None) -> ContactMask:
        """The pixels whose difference to the blank a dot spoils: there at rest, or there now."""
        moved = np.zeros((len(self.markers), 2)) if tracked is None else tracked.displacement_px
        return self.shapes.hidden(moved)

    def _places(self, image: Unwarped) -> Places:
        """Of the spots that may be dots."""
        markers = self.markers
        spots = dark_spots(image, markers.scale_px)
        whole = inside(spots.position_px, image.shape[:2])
        strong = spots.response >= WEAKER_ON_GRID * np.median(markers.response)
        return spots.position_px[whole & strong]

    def _tracked(self, moved: Points, seen: Bool[np.ndarray, " n"], *, jumped: bool) -> Tracked:
        rest = self.markers.position_px
        return Tracked(markers=self.markers, position_px=rest + moved, seen=seen, jumped=jumped)

    def _settled(self, expected: Points, places: Places) -> tuple[Points, Bool[np.ndarray, " n"]]:
        """How far the dots have moved from rest, and which are seen, from a guess of the former."""
        rest, spacing = self.markers.position_px, self.markers.spacing_px
        tree = KDTree(places)
        for _ in range(ROUNDS):
            before = expected
            spot, seen = _match(rest + expected, tree, REACH * spacing)
            moved = np.where(seen[:, None], places[spot] - rest, np.nan)
            like_neighbors = self._smooth(moved, expected)
            odd = np.linalg.norm(moved - like_neighbors, axis=1) > DISAGREEMENT * spacing
            seen &= ~odd
            expected = np.where(seen[:, None], moved, like_neighbors)
            if np.array_equal(expected, before):  # another round would find the same
                break
        return expected, seen

    def _torn(self, moved: Points, seen: Bool[np.ndarray, " n"]) -> Bool[np.ndarray, "n k"]:
        """Which pairs of a dot and a neighbour move apart as no skin stretches."""
        apart = np.linalg.norm(moved[:, None] - moved[self._near], axis=-1)
        both = seen[:, None] & seen[self._near]
        return both & (apart > STEEPEST * self._away_px)

    def _largest_whole(
        self, seen: Bool[np.ndarray, " n"], torn: Bool[np.ndarray, "n k"]
    ) -> Bool[np.ndarray, " n"]:
        """The largest part of the dots that hang together, clear of tears and of unseen dots."""
        clear = seen & ~torn.any(1)
        for _ in range(RIM):
            clear &= clear[self._near].all(1)
        first, which = np.nonzero(clear[:, None] & clear[self._near])
        links = coo_array(
            (np.ones(len(first)), (first, self._near[first, which])), (len(seen),) * 2
        )
        _, part = connected_components(links, directed=False)
        return clear & (part == np.bincount(part, clear).argmax())

    def _grown(
        self, part: Bool[np.ndarray, " n"], moved: Points, places: Places
    ) -> tuple[Points, Bool[np.ndarray, " n"]]:
        """Matched anew from a part outward, ring by ring, each by the dots within."""
        rest, reach = self.markers.position_px, REACH * self.markers.spacing_px
        tree = KDTree(places)
        done, expected = part.copy(), np.where(part[:, None], moved, np.nan)
        while len(ring := np.flatnonzero(~done & (done[self._near].sum(1) >= LEAST_BESIDE))):
            guess = self._smooth(expected, moved)[ring]
            ours = np.concatenate([rest[done] + expected[done], rest[ring] + guess])
            spot, near = _match(ours, tree, reach)
            found = places[spot[-len(ring) :]] - rest[ring]
            expected[ring] = np.where(near[-len(ring) :, None], found, guess)
            done[ring] = True
        return self._settled(np.where(done[:, None], expected, moved), places)

    def _rests(self, moved: Points, seen: Bool[np.ndarray, " n"]) -> bool:
        away = np.linalg.norm(moved[seen], axis=1) < AT_REST * self.markers.spacing_px
        return bool(away.sum() >= NEARLY_ALL * len(seen))

    def _smooth(self, moved: Points, fallback: Points) -> Points:
        """What the neighbours of each dot say: their median, or the fallback where all are lost."""
        values = np.sort(moved[self._near], axis=1)  # those that are lost come last
        count = np.isfinite(values[..., 0]).sum(1)
        known = np.flatnonzero(count)
        below, above = (count[known] - 1) // 2, count[known] // 2
        smooth = fallback.copy()
        smooth[known] = (values[known, below] + values[known, above]) / 2
        return smooth


def marker_tracker(blank: Unwarped) -> MarkerTracker | None:
    """Follows the dots of a gel; ``None`` where its blank frame shows none."""
    markers = find_markers(blank)
    return None if markers is None else MarkerTracker(markers, blank)


def _match(
    expected: Points, places: KDTree, reach_px: float
) -> tuple[np.ndarray, Bool[np.ndarray, " n"]]:
    """For each expected place the spot that is nearest to it and that it is nearest to."""
    away, spot = places.query(expected)
    _, back = KDTree(expected).query(places.data)
    return spot, (away < reach_px) & (back[spot] == np.arange(len(expected)))
