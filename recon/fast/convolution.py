# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""The layers of ``recon.unet`` as vector instructions.

With a ring of zeros around it a frame is one line in which neighbours have fixed distances. So a
kernel of 3 x 3 is a dense layer whose inputs lie so far on from a pixel, and no pixel is copied
nine times.
"""

from functools import lru_cache
from typing import Any

import numpy as np
from jaxtyping import Float32
from llvmlite import ir
from numba.core import cgutils, types
from numba.extending import intrinsic

from recon import unet
from recon.fast.floating import NEURONS, Rectified, packed
from recon.fast.vectors import ADDRESS, LANES, VECTOR_BYTES, VECTORS, Vectors, room, summed
from recon.kernels import compiled

STEP = LANES * VECTORS
"""Pixels that are summed together."""


class CompiledLayers(unet.Layers):
    """A network's layers, their weights laid out once; for frames of any size."""

    def __init__(self, weights: unet.Weights) -> None:
        """Lay out the kernels of 3 x 3."""
        super().__init__(weights)
        self._packed = {
            layer: packed(kernel.reshape(len(kernel), -1).T, self[f"{layer}.bias"])
            for layer, kernel in ((name.removesuffix(".weight"), self[name]) for name in self)
            if kernel.ndim == 4 and kernel.shape[-1] == 3
        }

    def rectified(
        self, layer: str, *parts: Float32[np.ndarray, "_ h w"]
    ) -> Float32[np.ndarray, "channels_out h w"]:
        """As ``unet.Layers`` has it."""
        wide_out, wide_in, _, _ = self[f"{layer}.weight"].shape
        _, h, w = parts[0].shape
        line, count = (h + 2) * (w + 2), h * (w + 2)
        ringed = np.zeros((wide_in, plane_px(h, w)), np.float32)
        frame = ringed[:, :line].reshape(wide_in, h + 2, w + 2)[:, 1:-1, 1:-1]
        channel = 0
        for part in parts:
            frame[channel : (channel := channel + len(part))] = part
        steps, groups = -(-count // STEP), -(-wide_out // NEURONS)
        found = np.empty((groups * NEURONS, steps * STEP), np.float32)
        _convolved(ringed, taps(*ringed.shape, w + 2), self._packed[layer], found, steps)
        return found[:wide_out, :count].reshape(wide_out, h, w + 2)[..., :-2]


def plane_px(h: int, w: int) -> int:
    """Of a frame with its ring, and what the last step reads beyond."""
    return (h + 2) * (w + 2) + STEP + 1


@lru_cache(maxsize=64)
def taps(channels: int, plane: int, width: int) -> np.ndarray:
    """How many bytes on from the first tap of a pixel each tap of each channel lies."""
    row, column = np.divmod(np.arange(9), 3)
    return (4 * (plane * np.arange(channels)[:, None] + row * width + column).ravel()).astype(
        np.int64
    )


_ARITHMETIC = Rectified()


@intrinsic  # type: ignore[untyped-decorator]
def _layer(
    _: Any,
    values: Any,
    taps: Any,
    weights: Any,
    out: Any,
    inputs: Any,
    groups: Any,
    plane: Any,
    steps: Any,
) -> Any:
    """Addresses, counts, and the bytes from one plane of ``out`` to the next."""

    def code(context: Any, builder: Any, _: Any, arguments: Any) -> Any:
        values, taps, weights, out, inputs, groups, plane, steps = arguments
        v, places = Vectors(builder), room(builder, _ARITHMETIC)
        group_bytes = v.scaled(v.at(inputs, _ARITHMETIC.head), 4 * NEURONS)
        with (
            cgutils.for_range(builder, steps) as step,
            cgutils.for_range(builder, groups) as group,
        ):
            shift = v.scaled(step.index, VECTOR_BYTES * VECTORS)
            first, start = v.at(values, shift), v.at(weights, builder.mul(group.index, group_bytes))

            def pixels(index: Any) -> Any:
                return v.at(first, v.load(v.at(taps, v.scaled(index, 8)), ADDRESS))

            sums = summed(v, _ARITHMETIC, places, start, inputs, pixels)
            for neuron, k, result in _ARITHMETIC.finish(v, None, sums, None):
                row = builder.add(v.scaled(group.index, NEURONS), ir.Constant(ADDRESS, neuron))
                v.store(result, v.at(out, builder.mul(row, plane), shift, VECTOR_BYTES * k))
        return context.get_dummy_value()

    return types.void(*[types.intp] * 8), code


def _take_convolved(ringed: Any, taps: Any, weights: Any, out: Any, steps: int) -> None:
    _layer(
        ringed.ctypes.data,
        taps.ctypes.data,
        weights.ctypes.data,
        out.ctypes.data,
        len(taps),
        len(out) // NEURONS,
        4 * out.shape[1],
        steps,
    )


_convolved = compiled(_take_convolved)
