# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Dots followed from the gel at rest through a press, each under its own number.

The skin stretches smoothly, so a dot moves nearly as its neighbours do. A spot that fits that is
the dot; a dot without such a spot is not seen, and is carried along by its neighbours until it
shows again: behind an object's edge, or beyond the frame's.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Bool, Float64
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

NEIGHBOURS = 8
REACH = 0.45
"""Of the spacing: a spot nearer than this to a dot's expected place may be the dot."""
DISAGREEMENT = 0.3
"""Of the spacing: a dot moves like its neighbours, give or take this."""
ROUNDS = 4
LEAST_SEEN = 0.5
"""With fewer of the dots in sight, where they are is not known."""
LONGEST_STEP = 0.35
"""Of the spacing: a median step beyond it may have moved every dot onto its neighbour's place."""


@dataclass(frozen=True, kw_only=True)
class Tracked:
    """Where the dots of a gel are in one frame."""

    markers: Markers
    """The dots at rest."""
    position_px: Points
    seen: Bool[np.ndarray, " n"]
    """False where a dot was carried along by its neighbours."""
    jumped: bool
    """The dots moved so far since the last frame that each may be taken for its neighbour."""

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
        _, near = KDTree(markers.position_px).query(
            markers.position_px, k=min(NEIGHBOURS, len(markers) - 1) + 1
        )
        self._near = near[:, 1:]

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
        markers = self.markers
        rest, spacing = markers.position_px, markers.spacing_px
        start = np.zeros_like(rest) if before is None else before.displacement_px
        spots = dark_spots(image, markers.scale_px)
        whole = inside(spots.position_px, image.shape[:2])
        places, response = spots.position_px[whole], spots.response[whole]
        faint = response < WEAKER_ON_GRID * np.median(markers.response)
        places = places[~faint]
        if not len(places):
            nothing = np.zeros(len(rest), bool)
            return Tracked(markers=markers, position_px=rest + start, seen=nothing, jumped=False)
        expected = start
        for _ in range(ROUNDS):
            spot, seen = _match(rest + expected, places, REACH * spacing)
            moved = np.where(seen[:, None], places[spot] - rest, np.nan)
            like_neighbours = self._smooth(moved, expected)
            odd = np.linalg.norm(moved - like_neighbours, axis=1) > DISAGREEMENT * spacing
            seen &= ~odd
            expected = np.where(seen[:, None], moved, like_neighbours)
        step = np.linalg.norm((expected - start)[seen], axis=1)
        return Tracked(
            markers=markers,
            position_px=rest + expected,
            seen=seen,
            jumped=bool(len(step)) and float(np.median(step)) > LONGEST_STEP * spacing,
        )

    def hidden(self, tracked: Tracked) -> ContactMask:
        """The pixels whose difference to the blank a dot spoils: there at rest, or there now."""
        return self.shapes.hidden(tracked.displacement_px)

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


def misfit(recorded: Mapping[str, int | float] | None, found: MarkerTracker | None) -> str:
    """What is wrong where a unit's record and a blank frame disagree about dots; else empty.

    Args:
        recorded: the card's ``markers``.
        found: on the blank frame.
    """
    if recorded is not None and found is None:
        return f"none, but the unit has {recorded['count']:g}: is this its gel, in focus?"
    if recorded is None and found is not None:
        return f"{len(found.markers)} dots, but the unit was calibrated without: calibrate it anew"
    return ""


def _match(
    expected: Points, places: Float64[np.ndarray, "m 2"], reach_px: float
) -> tuple[np.ndarray, Bool[np.ndarray, " n"]]:
    """For each expected place the spot that is nearest to it and that it is nearest to."""
    away, spot = KDTree(places).query(expected)
    _, back = KDTree(expected).query(places)
    return spot, (away < reach_px) & (back[spot] == np.arange(len(expected)))
