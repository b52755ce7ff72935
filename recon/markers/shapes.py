# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Which pixels each dot hides: cut out of the blank gel once, then moved along.

Moved shapes are the same in every frame in which the dots stand still, whatever the noise: so is
what is prepared for filling them.
"""

from dataclasses import dataclass
from functools import cached_property

import cv2
import numpy as np
from jaxtyping import Int32
from scipy.spatial import KDTree

from recon.arrays import ContactMask, Unwarped
from recon.markers.detection import (
    FARTHEST,
    WEAKER_ON_GRID,
    Markers,
    dark_spots,
    darkness,
    inside,
)
from recon.markers.lattice import Points

LEAST_DARKNESS = 0.05
"""A pixel this much darker than the gel around it (in the log of brightness) belongs to a dot."""
RIM_PX = 1
"""Around each dot: the lens and JPEG blur it over its outline."""
STILL_PX = 0.4
"""A dot that moved less hides what it hides at rest."""
STRETCH_PX = 1
"""A dot that moved is also stretched and shaded anew."""


@dataclass(frozen=True, kw_only=True)
class DotShapes:
    """The dots' pixels at rest."""

    owner: Int32[np.ndarray, "h w"]
    """Index of the dot that hides each pixel; -1 for none, -2 for one that the edge cuts."""

    def hidden(self, displacement_px: Points) -> ContactMask:
        """Pixels that the dots hide at rest or where they are now.

        Args:
            displacement_px: (n, 2) of every dot, in the order of the markers.
        """
        mask = self.owner != -1
        moved = np.hypot(*displacement_px.T) > STILL_PX
        if not moved.any():
            return mask
        height, width = mask.shape
        those = moved[self._owned[2]]
        rows, columns, dots = (values[those] for values in self._owned)
        shift = np.rint(displacement_px[dots]).astype(int)
        now = np.zeros_like(mask)
        rows, columns = rows + shift[:, 1], columns + shift[:, 0]
        kept = (rows >= 0) & (rows < height) & (columns >= 0) & (columns < width)
        now[rows[kept], columns[kept]] = True
        return mask | _grown(now, STRETCH_PX)

    @cached_property
    def _owned(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Rows, columns and dots of the pixels that whole dots hide."""
        rows, columns = np.nonzero(self.owner >= 0)
        return rows, columns, self.owner[rows, columns]


def dot_shapes(blank: Unwarped, markers: Markers) -> DotShapes:
    """The pixels of every dot of a blank gel, with those that the frame's edge cuts."""
    cut = _cut_dots(blank, markers)
    centers = np.concatenate([markers.position_px, cut])
    names = np.concatenate([np.arange(len(markers)), np.full(len(cut), -2)])
    height, width = blank.shape[:2]
    columns, rows = np.meshgrid(np.arange(width), np.arange(height))
    pixels = np.stack([columns, rows], -1).reshape(-1, 2)
    away, nearest = KDTree(centers).query(pixels, distance_upper_bound=2 * markers.spacing_px)
    near = (away < FARTHEST * markers.scale_px).reshape(height, width)
    dark = _grown(near & (darkness(blank, markers.scale_px) > LEAST_DARKNESS), RIM_PX)
    # The heart of a dot is hidden however little it differs.
    dark |= (away < markers.scale_px).reshape(height, width)
    nearest = np.append(names, -1)[nearest].reshape(height, width)
    return DotShapes(owner=np.where(dark, nearest, -1).astype(np.int32))


def _cut_dots(blank: Unwarped, markers: Markers) -> Points:
    """Dark spots on the frame's outermost pixels, about one spacing from a dot."""
    spots = dark_spots(blank, markers.scale_px)
    dark = spots.response > WEAKER_ON_GRID * np.median(markers.response)
    edge = spots.position_px[dark & ~inside(spots.position_px, blank.shape[:2])]
    if not len(edge):
        return edge
    away, _ = KDTree(markers.position_px).query(edge)
    return edge[away < 1.4 * markers.spacing_px]


def _grown(mask: ContactMask, by_px: int) -> ContactMask:
    kernel = np.ones((2 * by_px + 1, 2 * by_px + 1), np.uint8)
    return cv2.dilate(mask.astype(np.uint8), kernel).astype(bool)
