# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Dense layers with tanh in 16-bit fixed point: twice the products an instruction of floats.

Two inputs of a pixel lie in one lane. Their products with two weights are summed to 32 bits in one
instruction, and the scale of each neuron is as fine as lets its sum never overflow. A sum shifted
right is tanh's argument in 16 bits, which holds at its ends; the upper six bits choose a parabola
from a table in registers, the others are the place on it.

Colours come as floats into the first layer, and slopes leave the last one as floats.
"""

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from llvmlite import ir
from numba.core import cgutils, types
from numba.extending import intrinsic
from numpy.polynomial import chebyshev, polynomial

from recon.fast.floating import LAST, NEURONS, fma
from recon.fast.vectors import (
    ADDRESS,
    BLOCK,
    FEATURES,
    FLOATS,
    INT,
    INTS,
    LANES,
    VECTOR_BYTES,
    Vectors,
    dense,
    grouped,
    room,
    summed,
)

AVAILABLE = LANES == 16 and "+avx512bw" in FEATURES
RANGE = 5.0
"""Of tanh's arguments, either side of zero: beyond, it is 1 within 10^-4."""
PIECES = 64
PER_UNIT = 2**16 / (2 * RANGE)
"""Steps of tanh's argument, of 16 bits."""
LARGEST_SUM = 0.99 * 2**31
"""Leaves room for rounded weights."""
FIRM = 1e-6
"""Of the mean square of an activation of 1: how little weights change whose inputs are alike."""
GROUP_ROWS = NEURONS // 2
GROUP_BYTES = 4 * BLOCK * GROUP_ROWS
"""Of the activations of a group of neurons, two in each row."""
FINEST, COARSEST = 32700, 1024
"""Steps that an activation of 1 may have."""

_WORD = ir.IntType(16)
_WORDS = ir.VectorType(_WORD, 2 * LANES)
_TERM_BYTES = 2 * PIECES
_IN_TURN = [8 * lane + 4 * odd + k for lane in range(4) for k in range(4) for odd in range(2)]
"""From four of one neuron and four of the next to pairs, in each quarter of a vector."""


class _Hidden:
    """Sums of products of 16 bits, shifted right by as much as each neuron says: tanh's arguments.

    They are left for tanh to be taken of.
    """

    kind: Any = INTS
    neurons = NEURONS
    outputs = GROUP_ROWS
    before = 3 * _TERM_BYTES
    head = 2

    def begin(self, v: Vectors, weights: Any) -> list[list[Any]]:
        """The parabolas: three terms, each of two vectors."""
        half = _TERM_BYTES // 2
        return [
            [v.load(v.at(weights, _TERM_BYTES * term + half * k), _WORDS) for k in range(2)]
            for term in range(3)
        ]

    def add(self, v: Vectors, total: Any, pixels: Any, weight: Any) -> Any:
        """Two products; processors that add them in the same instruction are made to."""
        pairs = [v.builder.bitcast(vector, _WORDS) for vector in (pixels, weight)]
        return v.builder.add(total, v.call("llvm.x86.avx512.pmaddw.d.512", INTS, *pairs))

    def finish(
        self, v: Vectors, table: list[list[Any]], sums: list[list[Any]], second: Any
    ) -> Iterator[tuple[int, int, Any]]:
        """Arguments of pairs of neurons, four pixels of one and four of the other in turn."""
        for neuron in range(0, self.neurons, 2):
            for k in range(len(sums[0])):
                pair = [
                    self.argument(v, sums[n][k], v.at(second, 4 * n)) for n in (neuron, neuron + 1)
                ]
                yield neuron // 2, k, v.call("llvm.x86.avx512.packssdw.512", _WORDS, *pair)

    def argument(self, v: Vectors, total: Any, second: Any) -> Any:
        """Of tanh, in steps."""
        # A shift of all lanes by one number would wait for where the products are summed.
        return v.call("llvm.x86.avx512.psrav.d.512", INTS, total, v.splat(second, INTS))


class _First(_Hidden):
    """Sums of floats, rounded to the nearest step."""

    kind: Any = FLOATS
    head = 1

    def add(self, v: Vectors, total: Any, pixels: Any, weight: Any) -> Any:
        """One product."""
        return fma(v, weight, pixels, total)

    def finish(
        self, v: Vectors, table: list[list[Any]], sums: list[list[Any]], second: Any
    ) -> Iterator[tuple[int, int, Any]]:
        """Pairs of activations."""
        for row, k, argument in super().finish(v, table, sums, second):
            yield row, k, _tanh(v, argument, table)

    def argument(self, v: Vectors, total: Any, _: Any) -> Any:
        """Of tanh, in steps."""
        every, nearest = ir.Constant(_WORD, -1), INT(4)
        name = "llvm.x86.avx512.mask.cvtps2dq.512"
        return v.call(name, INTS, total, v.constant(INTS, 0), every, nearest)


class _Last(_Hidden):
    """Sums of products of 16 bits, scaled to floats."""

    neurons = outputs = LAST
    before = 0

    def begin(self, v: Vectors, weights: Any) -> list[list[Any]]:
        """Nothing."""
        return []

    def finish(
        self, v: Vectors, table: list[list[Any]], sums: list[list[Any]], second: Any
    ) -> Iterator[tuple[int, int, Any]]:
        """Slopes."""
        for neuron, row in enumerate(sums):
            scale = v.splat(v.at(second, 4 * neuron), FLOATS)
            for k, total in enumerate(row):
                yield neuron, k, v.builder.fmul(v.builder.sitofp(total, FLOATS), scale)


first_layer, last_layer = dense(_First()), dense(_Last())
_ARITHMETIC = _Hidden()


@intrinsic  # type: ignore[untyped-decorator]
def hidden_layer(_: Any, values: Any, weights: Any, out: Any, inputs: Any, groups: Any) -> Any:
    """As ``dense``, for twice as many inputs as a group of neurons has vectors of activations.

    Tanh of each group is taken in place beside the sums of the next one: products keep one part of
    the processor busy, tanh another. What lies as far before ``out`` as a group is long is spoilt.
    """

    def code(context: Any, builder: Any, _: Any, arguments: Any) -> Any:
        values, weights, out, inputs, groups = arguments
        v, places = Vectors(builder), room(builder, _ARITHMETIC)
        table = _ARITHMETIC.begin(v, weights)
        group_bytes = v.scaled(v.at(inputs, _ARITHMETIC.head), 4 * NEURONS)

        def activate(rows: Any, vector: Any) -> None:
            place = v.at(rows, v.scaled(vector, VECTOR_BYTES))
            v.store(_tanh(v, v.load(place, _WORDS), table), place)

        with cgutils.for_range(builder, groups) as group:
            start = v.at(weights, _ARITHMETIC.before, builder.mul(group.index, group_bytes))
            rows = v.at(out, v.scaled(group.index, GROUP_BYTES))
            sums = summed(
                v,
                _ARITHMETIC,
                places,
                start,
                inputs,
                lambda index: v.at(values, v.scaled(index, 4 * BLOCK)),
                beside=lambda step: activate(v.at(rows, -GROUP_BYTES), step),
                together=2,
            )
            for row, k, words in _ARITHMETIC.finish(v, table, sums, v.at(start, 4 * NEURONS)):
                v.store(words, v.at(rows, 4 * BLOCK * row + VECTOR_BYTES * k))
        last = v.at(out, v.scaled(groups, GROUP_BYTES), -GROUP_BYTES)
        with cgutils.for_range(builder, ir.Constant(ADDRESS, GROUP_BYTES // VECTOR_BYTES)) as left:
            activate(last, left.index)
        return context.get_dummy_value()

    return types.void(*[types.intp] * 5), code


def packed(
    layers: Sequence[tuple[np.ndarray, np.ndarray]], shown: Sequence[np.ndarray], split: float
) -> tuple[np.ndarray, ...]:
    """Weights [in, out] and biases [out] of a network as its layers read them, as 32-bit words.

    Args:
        layers: of the network.
        shown: to each layer after the first, activations [n, in] by which its weights are rounded.
        split: an activation of 1 has so many times as many steps as let it and the largest weight
            round alike.
    """
    last = len(layers) - 1
    weight, bias = layers[0]
    rows = [np.vstack([bias, weight]).astype(np.float64) * PER_UNIT]
    found = [rows[0].astype(np.float32).view(np.int32)]
    for index, ((weight, bias), seen) in enumerate(zip(layers[1:], shown, strict=True), 1):
        exact, start = weight.astype(np.float64), bias.astype(np.float64)
        scale = LARGEST_SUM / np.maximum(np.abs(exact).sum(0) + np.abs(start), 1e-9)
        if index < last:
            shift = np.clip(np.floor(np.log2(scale / PER_UNIT)), 1, 31)
            scale = PER_UNIT * 2**shift
        largest = scale * np.maximum(np.abs(exact).max(0), 1e-9)
        steps = split * np.exp(np.log(largest).mean() / 2)
        steps = float(np.clip(max(steps, largest.max() / 32767), COARSEST, FINEST))
        found[-1] = np.concatenate([_table(steps), grouped(found[-1], NEURONS)])
        whole, left = rounded(exact * scale / steps, seen)
        pairs = whole.clip(-32767, 32767).astype(np.int16)
        pairs = np.ascontiguousarray(pairs.reshape(-1, 2, pairs.shape[1]).swapaxes(1, 2))
        if index < last:
            half, second = 2 ** (shift - 1), shift.astype(np.int32)
        else:
            half, second = 0, (1 / scale).astype(np.float32).view(np.int32)
        start = np.rint(start * scale + left * steps + half)
        start = start.clip(-(2**31), 2**31 - 1).astype(np.int32)
        found.append(np.vstack([start, second, pairs.view(np.int32)[..., 0]]))
    found[-1] = grouped(found[-1], LAST)
    return tuple(found)


def rounded(weights: np.ndarray, seen: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Whole weights [in, out], and the constant [out] with which they sum up what is seen best.

    What rounding one weight leaves, those after it and the constant take up by least squares
    (Frantar et al., GPTQ, ICLR 2023).

    Args:
        weights: in steps, [in, out].
        seen: inputs, [n, in].
    """
    inputs = np.column_stack([seen, np.ones(len(seen))]).astype(np.float64)
    products = inputs.T @ inputs / len(inputs) + FIRM * np.eye(inputs.shape[1])
    found = np.vstack([weights, np.zeros(weights.shape[1])])
    for index in range(len(weights)):
        rest = slice(index + 1, None)
        left = found[index] - np.rint(found[index])
        found[index] -= left
        found[rest] += np.outer(np.linalg.solve(products[rest, rest], products[rest, index]), left)
    return found[:-1], found[-1]


def _table(steps: float) -> np.ndarray:
    """Terms of tanh's parabolas, by the upper six bits of the argument; 1 is so many steps."""
    piece = np.arange(PIECES)
    start = np.where(piece < PIECES // 2, piece, piece - PIECES)
    node = (1 + chebyshev.chebpts1(3)) / 2
    values = np.tanh((start + node[:, None]) * 2 * RANGE / PIECES)
    terms = np.rint(polynomial.polyfit(node, values, 2) * steps)
    return np.ascontiguousarray(terms.astype(np.int16)).ravel().view(np.int32)


def _tanh(v: Vectors, argument: Any, table: list[list[Any]]) -> Any:
    """Pairs of activations, of arguments as ``_Hidden`` leaves them."""
    builder = v.builder
    piece = builder.lshr(argument, v.constant(_WORDS, 10))
    place = builder.lshr(builder.shl(argument, v.constant(_WORDS, 6)), v.constant(_WORDS, 1))
    constant, linear, square = (
        v.call("llvm.x86.avx512.vpermi2var.hi.512", _WORDS, low, piece, high) for low, high in table
    )
    product = "llvm.x86.avx512.pmul.hr.sw.512"
    slope = builder.add(linear, v.call(product, _WORDS, place, square))
    return v.shuffled(builder.add(constant, v.call(product, _WORDS, place, slope)), _IN_TURN)
