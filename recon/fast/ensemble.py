# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Our estimator's networks on whole frames: 64 pixels at a time pass all of them, in the cache.

In floats alone: a steep slope is the quotient of a normal's small component, and multiplies what 16
bits leave of an error by up to 70.
"""

import math
from typing import Any

import cv2
import numpy as np
from jaxtyping import Float32

from recon.estimators.context import SMOOTHING, sampled
from recon.estimators.default import (
    DRIFT_STEP_PX,
    LARGEST_DRIFT,
    STEEPEST_SLOPE,
    Default,
    raw_inputs,
)
from recon.estimators.mlp import channel_indices
from recon.estimators.networks import HIDDEN
from recon.fast import floating
from recon.fast.disturbance import SIDE_PX, QuarterMask, median
from recon.fast.floating import last_layer, rectified_layer
from recon.fast.kernels import compiled
from recon.fast.vectors import BLOCK
from recon.pixels import positions

PREPARED = 7
"""Settled R, G, B; what is familiar around in R, G, B, and how familiar it is."""
INPUTS = PREPARED + 5
"""Beside the prepared: blank R, G, B, X, Y. Colours that are not looked at have no weight."""
WIDTH = HIDDEN[0]
STEEPEST = np.float32(STEEPEST_SLOPE**2 / (1 + STEEPEST_SLOPE**2))
"""Square of the steepest normal's component."""


class FrameEnsemble:
    """Applies one estimator to frames of one size."""

    def __init__(self, estimator: Default, size_px: tuple[int, int]) -> None:
        """Lay out weights and what every frame shares, for frames of (width, height)."""
        width, height = size_px
        lit = channel_indices(estimator.channels)
        blank, beside = range(PREPARED, PREPARED + 3), (INPUTS - 2, INPUTS - 1)
        around = [3 + channel for channel in lit]
        seen = [*lit, *(blank[channel] for channel in lit), *beside, *around, PREPARED - 1]
        place = positions(size_px).reshape(-1, 2)
        same = raw_inputs(np.zeros((len(place), len(lit)), np.float32), estimator.light, place)
        self._same = np.zeros((INPUTS - PREPARED, len(place)), np.float32)
        own = seen[len(lit) : 2 * len(lit) + 2]
        self._same[[row - PREPARED for row in own]] = same[:, len(lit) :].T
        self._weights = _weights(estimator, seen)
        self._estimator, self._size_px = estimator, size_px
        self._prepared = np.zeros((PREPARED, height, width), np.float32)
        quarter = -(-height // SIDE_PX), -(-width // SIDE_PX)
        self.small = np.zeros((PREPARED, *quarter), np.float32)
        """What was prepared last, at a quarter of the resolution."""
        self._rows, self._columns = np.ix_(sampled(height), sampled(width))
        self._all = np.ones(quarter, bool)
        self._lit, self._sigma_px = lit, SMOOTHING * min(size_px)

    def prepared(self, difference: Float32[np.ndarray, "3 h w"]) -> Float32[np.ndarray, "7 h w"]:
        """What the estimator prepares of a difference, as planes; the next call overwrites it."""
        for channel in self._lit:
            some = difference[channel, ::DRIFT_STEP_PX, ::DRIFT_STEP_PX].ravel()
            drift = min(max(float(median(some)), -LARGEST_DRIFT), LARGEST_DRIFT)
            plane = self._prepared[channel]
            cv2.GaussianBlur(difference[channel], (0, 0), self._sigma_px, dst=plane)
            plane -= np.float32(drift)
            small = self.small[channel]
            cv2.resize(plane, small.shape[::-1], dst=small, interpolation=cv2.INTER_AREA)
        some = self._prepared[:3, self._rows, self._columns]
        colors = np.ascontiguousarray(np.moveaxis(self.small[:3], 0, -1))
        around = self._estimator.around(colors, np.moveaxis(some, 0, -1))
        self.small[3:] = np.moveaxis(around, -1, 0)
        for channel in (*self._lit, 3):
            plane = self._prepared[3 + channel]
            cv2.resize(self.small[3 + channel], self._size_px, dst=plane)
        return self._prepared

    def __call__(
        self,
        prepared: Float32[np.ndarray, "7 h w"],
        out: Float32[np.ndarray, "2 h w"],
        rows: slice = slice(None),
        near: QuarterMask | None = None,
    ) -> None:
        """Write the gradients of some rows of a prepared image; both are planes.

        They are zero outside ``near``.
        """
        width = prepared.shape[2]
        begin, end, _ = rows.indices(prepared.shape[1])
        _frame(
            prepared.reshape(PREPARED, -1),
            self._same,
            out.reshape(2, -1),
            self._all if near is None else near,
            width,
            begin * width,
            end * width,
            *self._weights,
        )


def _weights(estimator: Default, seen: list[int]) -> tuple[np.ndarray, ...]:
    """For each layer, a row for each member; the inputs' mean and spread are worked in."""
    weight, bias = (part.astype(np.float64) for part in estimator.layers[0])
    first = np.zeros((len(weight), INPUTS, WIDTH))
    colors = len(estimator.channels)
    spread = np.concatenate([estimator.spread, estimator.context.spread, [0.5]])
    mean = np.concatenate([estimator.mean, np.zeros(colors), [0.5]])
    first[:, seen] = weight / spread[:, None]
    shifted = bias - (mean / spread) @ weight
    layers = [(first, shifted), *estimator.layers[1:]]
    neurons = [floating.NEURONS] * len(HIDDEN) + [floating.LAST]
    return tuple(
        np.stack([floating.packed(*member, count) for member in zip(*layer, strict=True)])
        for layer, count in zip(layers, neurons, strict=True)
    )


def _pixels(
    prepared: Any,
    same: Any,
    out: Any,
    near: Any,
    width: int,
    begin: int,
    end: int,
    w0: Any,
    w1: Any,
    w2: Any,
    w3: Any,
) -> None:
    values, result = np.zeros((INPUTS, BLOCK), np.float32), np.empty((2, BLOCK), np.float32)
    a, b = np.empty((WIDTH, BLOCK), np.float32), np.empty((WIDTH, BLOCK), np.float32)
    groups, members = WIDTH // floating.NEURONS, len(w0)
    normal, places = np.empty((2, BLOCK), np.float32), np.empty(BLOCK, np.intp)
    place = begin
    while place < end:
        count = 0
        while place < end and count < BLOCK:  # the next pixels near a contact
            if near[place // width // SIDE_PX, place % width // SIDE_PX]:
                places[count] = place
                count += 1
            else:
                out[0, place] = out[1, place] = 0
            place += 1
        for p in range(count):
            for k in range(PREPARED):
                values[k, p] = prepared[k, places[p]]
            for k in range(INPUTS - PREPARED):
                values[PREPARED + k, p] = same[k, places[p]]
        normal[:] = 0
        for m in range(members if count else 0):
            rectified_layer(values.ctypes.data, w0[m].ctypes.data, a.ctypes.data, INPUTS, groups)
            rectified_layer(a.ctypes.data, w1[m].ctypes.data, b.ctypes.data, WIDTH, groups)
            rectified_layer(b.ctypes.data, w2[m].ctypes.data, a.ctypes.data, WIDTH, groups)
            last_layer(a.ctypes.data, w3[m].ctypes.data, result.ctypes.data, WIDTH, 1)
            normal += result
        for p in range(count):
            x, y = normal[0, p] / np.float32(members), normal[1, p] / np.float32(members)
            squared = x * x + y * y
            steep = min(squared, STEEPEST)
            scale = math.sqrt(steep / (max(squared, np.float32(1e-12)) * (1 - steep)))
            out[0, places[p]], out[1, places[p]] = x * scale, y * scale


_frame = compiled(_pixels)
