# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Dots of a marker gel in frames of one size: what they hide is filled from around them.

Most dots are where they rest, so colours there are a fixed matrix times those around them, made
once. Only dots that have moved are solved for; and of the slopes, only dots near a contact.
"""

from collections.abc import Iterable

import cv2
import numpy as np
from jaxtyping import Bool, Float32, Int64

from recon.arrays import ContactMask, Unwarped
from recon.markers.elastic import RING_PX, Dot, ElasticFill
from recon.markers.tracking import MarkerTracker, Tracked
from recon.quarters import SIDE_PX, QuarterMask
from sensor.toml import Pair

WIDEST_GROUP = 1.1
"""Dots whose matrices differ in size by less than this factor are filled in one product."""
BESIDE_PX = RING_PX["surface"] + 2
"""Around dots, slopes are listened to; they may be interpolated from half the resolution."""

Planes = Float32[np.ndarray, "c h w"]
Block = tuple[Int64[np.ndarray, "k n"], Int64[np.ndarray, "k m"], Float32[np.ndarray, "k n m"]]
"""Of k dots: places to fill, places listened to, both padded with the dot's own; the matrices."""


class FrameDots:
    """Finds the dots of one gel, each frame from rest, and fills in place what they hide."""

    def __init__(self, tracker: MarkerTracker, blank: Unwarped, mm_per_px: Pair) -> None:
        """Prepare for frames of the gel.

        Args:
            tracker: of the dots on the blank frame.
            blank: the unwarped blank frame.
            mm_per_px: pixel pitch along x and y.
        """
        self._tracker, self._blank = tracker, np.ascontiguousarray(np.moveaxis(blank, -1, 0))
        rest, aspect = tracker.hidden(), mm_per_px[1] / mm_per_px[0]
        self._colors = ElasticFill(rest, "harmonic", aspect)
        self._slopes = FrameSlopes(ElasticFill(rest, "surface", aspect))
        self._at_rest = frozenset(self._colors.dots)
        self._blocks = _blocks(self._colors.dots)

    def followed(self, difference: Planes) -> tuple[Tracked, ContactMask]:
        """The dots of a frame and what they hide, where its difference to the blank is filled."""
        dots = self._tracker.track(np.moveaxis(difference + self._blank, 0, -1))
        hidden = self._tracker.hidden(dots)
        colors = self._colors.moved(hidden)
        pixels = difference.reshape(len(difference), -1)
        for places, sources, weights in self._blocks:
            filled = weights @ np.moveaxis(np.take(pixels, sources, axis=1), 0, -1)
            for plane, values in zip(pixels, np.moveaxis(filled, -1, 0), strict=True):
                plane[places] = values
        # What is hidden at rest is hidden in every frame, so this leaves nothing of the above.
        colors.in_place(difference, [dot for dot in colors.dots if dot not in self._at_rest])
        return dots, hidden

    def slopes(self, hidden: ContactMask) -> "FrameSlopes":
        """What fills slopes where dots hide colours."""
        return self._slopes.moved(hidden)


class FrameSlopes:
    """Fills the two slopes of one surface where they are asked for."""

    def __init__(self, fill: ElasticFill) -> None:
        """Of the dots of one frame."""
        self._fill = fill
        self._boxes = np.array([dot.box for dot in fill.dots], int).reshape(-1, 4)
        hidden, side = fill.hidden.view(np.uint8), np.ones((SIDE_PX + 2, SIDE_PX + 2), np.uint8)
        covered = cv2.erode(hidden, side, anchor=(1, 1))[::SIDE_PX, ::SIDE_PX]
        self._open = covered == 0

    def moved(self, hidden: ContactMask) -> "FrameSlopes":
        """Of other hidden pixels; what has not changed is not prepared anew."""
        fill = self._fill.moved(hidden)
        return self if fill is self._fill else FrameSlopes(fill)

    def around(self, near: QuarterMask) -> QuarterMask:
        """What is near, and where slopes must be known to fill it, but for what dots hide."""
        asked = near.copy()
        for top, left, bottom, right in self._boxes[self._meet(near)]:
            rows = slice(max(top - BESIDE_PX, 0) // SIDE_PX, -(-(bottom + BESIDE_PX) // SIDE_PX))
            across = max(left - BESIDE_PX, 0) // SIDE_PX, -(-(right + BESIDE_PX) // SIDE_PX)
            asked[rows, slice(*across)] = True
        if self._fill.far is not None:
            y_px, x_px = np.unravel_index(self._fill.far[1], self._fill.hidden.shape)
            asked[y_px // SIDE_PX, x_px // SIDE_PX] = True
        return asked & self._open

    def __call__(self, gradient: Planes, near: QuarterMask | None) -> None:
        """Fill what is near; ``None`` is everywhere. Elsewhere, hidden pixels stay as they are."""
        dots = self._fill.dots
        if near is not None:
            dots = tuple(dot for dot, meets in zip(dots, self._meet(near), strict=True) if meets)
        self._fill.in_place(gradient, dots)

    def _meet(self, near: QuarterMask) -> Bool[np.ndarray, " n"]:
        """Which dots' boxes meet a mask."""
        sums = cv2.integral(near.view(np.uint8))
        top, left = self._boxes[:, :2].T // SIDE_PX
        bottom, right = -(-self._boxes[:, 2:].T // SIDE_PX)
        inside = sums[bottom, right] - sums[top, right] + sums[top, left] - sums[bottom, left]
        return np.asarray(inside > 0)


def _blocks(dots: Iterable[Dot]) -> list[Block]:
    """The matrices of dots, in groups of like size."""

    def size(dot: Dot) -> int:
        return len(dot.places) * len(dot.sources)

    groups: list[list[Dot]] = []
    for dot in sorted(dots, key=size):
        if groups and size(dot) <= WIDEST_GROUP * size(groups[-1][0]):
            groups[-1].append(dot)
        else:
            groups.append([dot])
    return [_block(group) for group in groups]


def _block(group: list[Dot]) -> Block:
    """Dots of like size, padded to the largest: what is filled twice is filled alike."""
    rows = max(len(dot.places) for dot in group)
    columns = max(len(dot.sources) for dot in group)
    matrices = np.zeros((len(group), rows, columns), np.float32)
    for matrix, dot in zip(matrices, group, strict=True):
        matrix[: len(dot.places), : len(dot.sources)] = dot.shape.weights
        matrix[len(dot.places) :] = matrix[len(dot.places) - 1]
    places = np.stack([_padded(dot.places, rows) for dot in group])
    return places, np.stack([_padded(dot.sources, columns) for dot in group]), matrices


def _padded(values: Int64[np.ndarray, " n"], count: int) -> Int64[np.ndarray, " count"]:
    """As many, the last one again and again."""
    return np.pad(values, (0, count - len(values)), mode="edge")
