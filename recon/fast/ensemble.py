# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Our estimator's networks on whole frames: 64 pixels at a time pass all of them, in the cache.

In floats alone: a steep slope is the quotient of a normal's small component, and multiplies what 16
bits leave of an error by up to 70.
"""

import math
from functools import lru_cache
from typing import Any, NamedTuple

import cv2
import numpy as np
from jaxtyping import Float32

from recon.estimators.default import (
    DRIFT_STEP_PX,
    STEEPEST_SLOPE,
    Default,
    asked_size_px,
    drift_of,
)
from recon.estimators.networks import HIDDEN
from recon.estimators.shading import blank_colors
from recon.estimators.surroundings import (
    ASPECTS,
    LEVELS,
    SMOOTHING,
    columns_around,
    surroundings,
)
from recon.fast import floating
from recon.fast.floating import last_layer, rectified_layer
from recon.fast.vectors import BLOCK
from recon.kernels import compiled
from recon.lights import channel_indices
from recon.pixels import positions
from recon.quarters import SIDE_PX, QuarterMask

COLORS, AROUND = 3, 3 * ASPECTS
OWN_OFF = 3 * LEVELS
"""Of what lies around, these are taken less the pixel's own colour."""
INPUTS = COLORS + AROUND + 5
"""At last blank R, G, B, X, Y. Colours that are not looked at have no weight."""
FIRST, SECOND, THIRD = HIDDEN
GROUPS = tuple(count // floating.NEURONS for count in HIDDEN)
ONE = np.float32(1)
STEEPEST = np.float32(STEEPEST_SLOPE**2 / (1 + STEEPEST_SLOPE**2))
"""Square of the steepest normal's component."""


class Seen(NamedTuple):
    """What the estimator prepares of a difference, before it is brought to one size."""

    settled: Float32[np.ndarray, "3 h w"]
    """At the size at which slopes are asked for."""
    around: Float32[np.ndarray, "qh qw a"]
    """What lies around, at a quarter of the frame's resolution."""


class FrameEnsemble:
    """Applies one estimator to frames of one size."""

    def __init__(
        self,
        estimator: Default,
        size_px: tuple[int, int],
        asked_px: tuple[int, int] | None = None,
    ) -> None:
        """Lay out weights and what every frame shares.

        Args:
            estimator: ours.
            size_px: (width, height) of the frames.
            asked_px: of the slopes; by default what the estimator asks for.
        """
        width, height = size_px
        self.asked_px = asked_size_px(size_px) if asked_px is None else asked_px
        lit = channel_indices(estimator.channels)
        blank, beside = range(COLORS + AROUND, INPUTS - 2), (INPUTS - 2, INPUTS - 1)
        seen = [*lit, *(blank[channel] for channel in lit), *beside, *columns_around(lit)]
        place = positions(self.asked_px).reshape(-1, 2)
        same = np.concatenate([blank_colors(estimator.light, place), place], 1)
        self._same = np.zeros((INPUTS - COLORS - AROUND, len(place)), np.float32)
        own = seen[len(lit) : 2 * len(lit) + 2]
        self._same[[row - COLORS - AROUND for row in own]] = same.T
        self._weights = _weights(estimator, seen)
        self._settled = np.zeros((COLORS, height, width), np.float32)
        large = self.asked_px != size_px
        self._asked = np.zeros((COLORS, *self.asked_px[::-1]), np.float32) if large else None
        self._near_px = SIDE_PX // 2 if large else SIDE_PX
        quarter = -(-height // SIDE_PX), -(-width // SIDE_PX)
        self._small = np.zeros((COLORS, *quarter), np.float32)
        self._all = np.ones(quarter, bool)
        self._lit, self._sigma_px = lit, SMOOTHING * min(size_px)

    def prepared(self, difference: Float32[np.ndarray, "3 h w"]) -> tuple[Seen, Seen]:
        """What the estimator prepares, of the frame and of a quarter of its rows and columns.

        The next call overwrites it.
        """
        some = difference[:, ::DRIFT_STEP_PX, ::DRIFT_STEP_PX]
        drift = drift_of(np.moveaxis(some, 0, -1))
        for channel in self._lit:
            plane = self._settled[channel]
            cv2.GaussianBlur(difference[channel], (0, 0), self._sigma_px, dst=plane)
            plane -= drift[channel]
            for fewer in (self._small, self._asked):
                if fewer is not None:
                    size_px = fewer.shape[:0:-1]
                    cv2.resize(plane, size_px, dst=fewer[channel], interpolation=cv2.INTER_AREA)
        around = surroundings(np.ascontiguousarray(np.moveaxis(self._small, 0, -1)))
        asked = self._settled if self._asked is None else self._asked
        return Seen(asked, around), Seen(self._small, around)

    def __call__(
        self,
        seen: Seen,
        out: Float32[np.ndarray, "2 h w"],
        rows: slice = slice(None),
        near: QuarterMask | None = None,
    ) -> None:
        """Write the gradients, as planes, of some rows of what was prepared.

        They are zero outside ``near``, which has a pixel for every four by four of the frame.
        """
        _, height, width = seen.settled.shape
        begin, end, _ = rows.indices(height)
        _frame(
            seen.settled.reshape(COLORS, -1),
            seen.around,
            *_between(height, seen.around.shape[0]),
            *_between(width, seen.around.shape[1]),
            self._same,
            out.reshape(2, -1),
            self._all if near is None else near,
            self._near_px,
            width,
            begin * width,
            end * width,
            *self._weights,
        )


@lru_cache(maxsize=8)
def _between(count: int, few: int) -> tuple[np.ndarray, np.ndarray]:
    """Of each of many places along an axis: the last of few before it, and how far beyond it is.

    As OpenCV resizes with bilinear interpolation.
    """
    place = np.clip((np.arange(count) + 0.5) * few / count - 0.5, 0, few - 1)
    first = np.minimum(place.astype(np.intp), max(few - 2, 0))
    return first, (place - first).astype(np.float32)


def _weights(estimator: Default, seen: list[int]) -> tuple[np.ndarray, ...]:
    """For each layer, a row for each member; the inputs' mean and spread are worked in."""
    weight, bias = (part.astype(np.float64) for part in estimator.layers[0])
    first = np.zeros((len(weight), INPUTS, FIRST))
    spread = estimator.spread.astype(np.float64)
    first[:, seen] = weight / spread[:, None]
    shifted = bias - (estimator.mean / spread) @ weight
    layers = [(first, shifted), *estimator.layers[1:]]
    neurons = [floating.NEURONS] * len(HIDDEN) + [floating.LAST]
    return tuple(
        np.stack([floating.packed(*member, count) for member in zip(*layer, strict=True)])
        for layer, count in zip(layers, neurons, strict=True)
    )


def _pixels(
    settled: Any,
    around: Any,
    above: Any,
    down: Any,
    left: Any,
    right: Any,
    same: Any,
    out: Any,
    near: Any,
    near_px: int,
    width: int,
    begin: int,
    end: int,
    w0: Any,
    w1: Any,
    w2: Any,
    w3: Any,
) -> None:
    values, result = np.zeros((INPUTS, BLOCK), np.float32), np.empty((2, BLOCK), np.float32)
    a, b = np.empty((FIRST, BLOCK), np.float32), np.empty((SECOND, BLOCK), np.float32)
    last, members = np.empty((THIRD, BLOCK), np.float32), len(w0)
    normal, places = np.empty((2, BLOCK), np.float32), np.empty(BLOCK, np.intp)
    few_rows, few, _ = around.shape
    line, row = np.empty((few, AROUND), np.float32), -1  # what lies around a row of pixels
    place = begin
    while place < end:
        count = 0
        while place < end and count < BLOCK:  # the next pixels near a contact
            if near[place // width // near_px, place % width // near_px]:
                places[count] = place
                count += 1
            else:
                out[0, place] = out[1, place] = 0
            place += 1
        for p in range(count):
            y, x = places[p] // width, places[p] % width
            if y != row:
                row, share = y, down[y]
                north, south = around[above[y]], around[min(above[y] + 1, few_rows - 1)]
                for c in range(few):
                    for k in range(AROUND):
                        line[c, k] = (ONE - share) * north[c, k] + share * south[c, k]
            west, share = left[x], right[x]
            east = min(west + 1, few - 1)
            for k in range(COLORS):
                values[k, p] = settled[k, places[p]]
            for k in range(AROUND):
                values[COLORS + k, p] = (ONE - share) * line[west, k] + share * line[east, k]
            for k in range(OWN_OFF):
                values[COLORS + k, p] -= values[k % COLORS, p]
            for k in range(INPUTS - COLORS - AROUND):
                values[COLORS + AROUND + k, p] = same[k, places[p]]
        normal[:] = 0
        for m in range(members if count else 0):
            rectified_layer(values.ctypes.data, w0[m].ctypes.data, a.ctypes.data, INPUTS, GROUPS[0])
            rectified_layer(a.ctypes.data, w1[m].ctypes.data, b.ctypes.data, FIRST, GROUPS[1])
            rectified_layer(b.ctypes.data, w2[m].ctypes.data, last.ctypes.data, SECOND, GROUPS[2])
            last_layer(last.ctypes.data, w3[m].ctypes.data, result.ctypes.data, THIRD, 1)
            normal += result
        for p in range(count):
            x, y = normal[0, p] / np.float32(members), normal[1, p] / np.float32(members)
            squared = x * x + y * y
            steep = min(squared, STEEPEST)
            scale = math.sqrt(steep / (max(squared, np.float32(1e-12)) * (1 - steep)))
            out[0, places[p]], out[1, places[p]] = x * scale, y * scale


_frame = compiled(_pixels)
