# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""The paper's network on whole frames: 64 pixels at a time pass all four layers, in the cache."""

from typing import Any

import numpy as np
from jaxtyping import Float32

from recon.estimators.mlp import HIDDEN, Mlp, channel_indices
from recon.fast.kernels import BLOCK, NEURONS, compiled, hidden, last, packed
from recon.pixels import positions

INPUTS = 5
"""R, G, B, X, Y: a colour that the network does not look at has no weight."""
WIDTH = HIDDEN[0]


class FrameMlp:
    """Applies one network to frames of one size."""

    def __init__(self, network: Mlp, size_px: tuple[int, int]) -> None:
        """Lay out the weights, for frames of (width, height)."""
        lit = channel_indices(network.channels)
        weight, bias = network.layers[0]
        first = np.zeros((INPUTS, WIDTH), np.float32)
        first[lit] = weight[: len(lit)] / network.color_scale[:, None]
        first[3:] = weight[len(lit) :]
        layers = [(first, bias), *network.layers[1:]]
        self._weights = tuple(packed(weight, bias) for weight, bias in layers)
        place = positions(size_px).reshape(-1, 2).T
        self._places = np.ascontiguousarray(place)

    def __call__(
        self,
        difference: Float32[np.ndarray, "3 h w"],
        out: Float32[np.ndarray, "2 h w"],
        rows: slice = slice(None),
    ) -> None:
        """Write the gradients of some rows of a difference image; both are planes."""
        width = difference.shape[2]
        begin, end, _ = rows.indices(difference.shape[1])
        _frame(
            difference.reshape(3, -1),
            self._places,
            out.reshape(2, -1),
            begin * width,
            end * width,
            *self._weights,
        )


def _pixels(
    difference: Any, places: Any, out: Any, begin: int, end: int, w0: Any, w1: Any, w2: Any, w3: Any
) -> None:
    values, result = np.zeros((INPUTS, BLOCK), np.float32), np.empty((NEURONS, BLOCK), np.float32)
    a, b = np.empty((WIDTH, BLOCK), np.float32), np.empty((WIDTH, BLOCK), np.float32)
    groups = WIDTH // NEURONS
    for start in range(begin, end, BLOCK):
        count = min(BLOCK, end - start)
        for p in range(count):
            for k in range(3):
                values[k, p] = difference[k, start + p]
            for k in range(2):
                values[3 + k, p] = places[k, start + p]
        hidden(values.ctypes.data, w0.ctypes.data, a.ctypes.data, INPUTS, groups)
        hidden(a.ctypes.data, w1.ctypes.data, b.ctypes.data, WIDTH, groups)
        hidden(b.ctypes.data, w2.ctypes.data, a.ctypes.data, WIDTH, groups)
        last(a.ctypes.data, w3.ctypes.data, result.ctypes.data, WIDTH, 1)
        for p in range(count):
            for axis in range(2):
                out[axis, start + p] = result[axis, p]


_frame = compiled(_pixels)
