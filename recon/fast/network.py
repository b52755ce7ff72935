# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""The paper's network on whole frames: 64 pixels at a time pass all four layers, in the cache."""

from typing import Any

import numpy as np
from jaxtyping import Float32

from recon.estimators.mlp import HIDDEN, Layer, Mlp
from recon.fast import fixed_point, floating
from recon.fast.fixed_point import first_layer, hidden_layer
from recon.fast.floating import tanh_layer
from recon.fast.pages import in_large_pages
from recon.fast.vectors import BLOCK, moved
from recon.kernels import compiled
from recon.lights import channel_indices
from recon.pixels import positions

INPUTS = 5
"""R, G, B, X, Y: a colour that the network does not look at has no weight."""
WIDTH = HIDDEN[0]
LINE_BYTES = 4 * BLOCK
"""Of a block's row."""
LARGEST_ERROR = 6.5e-4
"""In slope, of 16 bits where they are tried; leaves room below 1e-3 for the frames to come, whose
worst pixel is up to 1.5 times as far off."""
SPLITS = (1.2, 1.35, 1.5, 1.7, 2.0)
"""Of the bits between activations and weights, of which the one that errs least is taken."""
TRIED_PX, SHOWN_PX = 2**18, 2**13
LARGEST_SPREAD = 0.3
"""Of full scale, of the colours that they are tried with."""


class FrameMlp:
    """Applies one network to frames of one size: in 16 bits where they suffice, else in floats."""

    def __init__(
        self, network: Mlp, size_px: tuple[int, int], *, in_words: bool | None = None
    ) -> None:
        """Lay out the weights.

        Args:
            network: what is applied.
            size_px: width and height of the frames.
            in_words: whether 16 bits are used; by default, where the processor has the
                instructions and random colours give the slopes of floats.
        """
        place = positions(size_px).reshape(-1, 2).T
        self._places = in_large_pages(np.ascontiguousarray(place))
        layers = _layers(network)
        floats = _float_weights(layers)
        words, error = _words(layers, floats) if in_words is not False else (floats, np.inf)
        self.in_words = error < LARGEST_ERROR if in_words is None else in_words
        self._apply, self._weights = (_in_words, words) if self.in_words else (_in_floats, floats)

    def __call__(
        self,
        difference: Float32[np.ndarray, "3 h w"],
        out: Float32[np.ndarray, "2 h w"],
        rows: slice = slice(None),
    ) -> None:
        """Write the gradients of some rows of a difference image; both are planes."""
        width = difference.shape[2]
        begin, end, _ = (width * row for row in rows.indices(difference.shape[1]))
        colors, places, slopes = difference.reshape(3, -1), self._places, out.reshape(2, -1)
        if (count := end - begin) >= BLOCK:
            self._apply(colors, places, slopes, begin, end, *self._weights)
            return
        filled = [np.zeros((len(planes), BLOCK), np.float32) for planes in (colors, places, slopes)]
        for planes, few in zip(filled[:2], (colors, places), strict=True):
            planes[:, :count] = few[:, begin:end]
        self._apply(*filled, 0, BLOCK, *self._weights)
        slopes[:, begin:end] = filled[2][:, :count]


def _layers(network: Mlp) -> list[Layer]:
    """The network's layers, the first of them for differences of all three colours."""
    lit = channel_indices(network.channels)
    weight, bias = network.layers[0]
    first = np.zeros((INPUTS, WIDTH), np.float32)
    first[lit] = weight[: len(lit)] / network.color_scale[:, None]
    first[3:] = weight[len(lit) :]
    return [(first, bias), *network.layers[1:]]


def _float_weights(layers: list[Layer]) -> tuple[np.ndarray, ...]:
    hidden = [floating.packed(*layer) for layer in layers[:-1]]
    return (*hidden, floating.packed(*layers[-1], floating.LAST))


def _words(
    layers: list[Layer], floats: tuple[np.ndarray, ...]
) -> tuple[tuple[np.ndarray, ...], float]:
    """The network in 16 bits, and how far it is from floats on random colours and places.

    As one cannot tell beforehand how roundings add up, some splits are tried.
    """
    if not fixed_point.AVAILABLE:
        return floats, np.inf
    random = np.random.default_rng(0)
    spread = random.uniform(0, LARGEST_SPREAD, TRIED_PX)
    color = (spread * random.normal(size=(3, TRIED_PX))).astype(np.float32)
    place = random.uniform(-1, 1, (2, TRIED_PX)).astype(np.float32)
    wanted, found = np.empty((2, 2, TRIED_PX), np.float32)
    _in_floats(color, place, wanted, 0, TRIED_PX, *floats)
    shown = shown_to(layers, np.concatenate([color, place])[:, :SHOWN_PX].T)
    tried = []
    for split in SPLITS:
        words = fixed_point.packed(layers, shown, split)
        _in_words(color, place, found, 0, TRIED_PX, *words)
        tried.append((words, float(np.abs(found - wanted).max())))
    return min(tried, key=lambda one: one[1])


def shown_to(layers: list[Layer], inputs: np.ndarray) -> list[np.ndarray]:
    """What inputs [n, in] show to each layer after the first, [n, WIDTH]."""
    shown = []
    for weight, bias in layers[:-1]:
        inputs = np.tanh(inputs @ weight + bias)
        shown.append(inputs)
    return shown


def _take_floats(
    difference: Any, places: Any, out: Any, begin: int, end: int, w0: Any, w1: Any, w2: Any, w3: Any
) -> None:
    values, result = np.zeros((INPUTS, BLOCK), np.float32), np.empty((2, BLOCK), np.float32)
    a, b = np.empty((WIDTH, BLOCK), np.float32), np.empty((WIDTH, BLOCK), np.float32)
    groups, plane_bytes = WIDTH // floating.NEURONS, 4 * difference.shape[1]
    for start in range(begin, end, BLOCK):
        shift = 4 * min(start, end - BLOCK)  # of the last pixels, some pass twice
        moved(difference.ctypes.data + shift, plane_bytes, values.ctypes.data, LINE_BYTES, 3)
        moved(
            places.ctypes.data + shift,
            plane_bytes,
            values.ctypes.data + 3 * LINE_BYTES,
            LINE_BYTES,
            2,
        )
        tanh_layer(values.ctypes.data, w0.ctypes.data, a.ctypes.data, INPUTS, groups)
        tanh_layer(a.ctypes.data, w1.ctypes.data, b.ctypes.data, WIDTH, groups)
        tanh_layer(b.ctypes.data, w2.ctypes.data, a.ctypes.data, WIDTH, groups)
        floating.last_layer(a.ctypes.data, w3.ctypes.data, result.ctypes.data, WIDTH, 1)
        moved(result.ctypes.data, LINE_BYTES, out.ctypes.data + shift, plane_bytes, 2)


def _take_words(
    difference: Any, places: Any, out: Any, begin: int, end: int, w0: Any, w1: Any, w2: Any, w3: Any
) -> None:
    values, result = np.zeros((INPUTS, BLOCK), np.float32), np.empty((2, BLOCK), np.float32)
    before = np.zeros((2, fixed_point.GROUP_ROWS + WIDTH // 2, BLOCK), np.int32)
    a, b = before[0, fixed_point.GROUP_ROWS :], before[1, fixed_point.GROUP_ROWS :]
    groups, plane_bytes = WIDTH // floating.NEURONS, 4 * difference.shape[1]
    for start in range(begin, end, BLOCK):
        shift = 4 * min(start, end - BLOCK)  # of the last pixels, some pass twice
        moved(difference.ctypes.data + shift, plane_bytes, values.ctypes.data, LINE_BYTES, 3)
        moved(
            places.ctypes.data + shift,
            plane_bytes,
            values.ctypes.data + 3 * LINE_BYTES,
            LINE_BYTES,
            2,
        )
        first_layer(values.ctypes.data, w0.ctypes.data, a.ctypes.data, INPUTS, groups)
        hidden_layer(a.ctypes.data, w1.ctypes.data, b.ctypes.data, WIDTH // 2, groups)
        hidden_layer(b.ctypes.data, w2.ctypes.data, a.ctypes.data, WIDTH // 2, groups)
        fixed_point.last_layer(a.ctypes.data, w3.ctypes.data, result.ctypes.data, WIDTH // 2, 1)
        moved(result.ctypes.data, LINE_BYTES, out.ctypes.data + shift, plane_bytes, 2)


_in_floats, _in_words = compiled(_take_floats), compiled(_take_words)
