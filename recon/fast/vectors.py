# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""A dense layer as vector instructions, in whatever arithmetic.

What a compiler makes of Python's loops leaves most of a processor idle; the layers of a network,
which take most of the time, are written in LLVM's own language here.
"""

from collections.abc import Callable, Iterable, Sequence
from typing import Any, Protocol, runtime_checkable

import numba
import numpy as np
from llvmlite import ir
from numba.core import cgutils, types
from numba.core.codegen import get_host_cpu_features
from numba.extending import intrinsic

BLOCK = 64
"""Pixels that pass a layer together."""
FEATURES = frozenset((numba.config.CPU_FEATURES or get_host_cpu_features()).split(","))
"""Of the processor that is compiled for, as LLVM lists them: "+avx512f" where it has it."""
LANES = 16 if "+avx512f" in FEATURES else 8
VECTORS = 4 if LANES == 16 else 2
FLOAT, INT = ir.FloatType(), ir.IntType(32)
FLOATS, INTS = ir.VectorType(FLOAT, LANES), ir.VectorType(INT, LANES)
VECTOR_BYTES = 4 * LANES
ADDRESS = ir.IntType(64)


class Vectors:
    """Instructions on vectors of pixels."""

    def __init__(self, builder: Any) -> None:
        self.builder = builder

    def call(self, name: str, kind: Any, *arguments: Any) -> Any:
        """What LLVM knows by a name."""
        signature = ir.FunctionType(kind, [argument.type for argument in arguments])
        function = cgutils.get_or_insert_function(self.builder.module, signature, name)
        return self.builder.call(function, arguments)

    def constant(self, kind: Any, value: float | int) -> Any:
        """One number in all lanes."""
        return ir.Constant(kind, [value] * kind.count)

    def at(self, address: Any, *offsets: Any) -> Any:
        """An address so many bytes on."""
        for offset in offsets:
            other = ir.Constant(ADDRESS, offset) if isinstance(offset, int) else offset
            address = self.builder.add(address, other)
        return address

    def scaled(self, index: Any, by: int) -> Any:
        """An index in bytes."""
        return self.builder.mul(index, ir.Constant(ADDRESS, by))

    def load(self, address: Any, kind: Any) -> Any:
        """What lies at an address."""
        return self.builder.load(self.builder.inttoptr(address, kind.as_pointer()), align=4)

    def store(self, vector: Any, address: Any) -> None:
        """Put a vector at an address."""
        pointer = self.builder.inttoptr(address, vector.type.as_pointer())
        self.builder.store(vector, pointer, align=4)

    def splat(self, address: Any, kind: Any) -> Any:
        """The number at an address in all lanes."""
        empty = ir.Constant(kind, ir.Undefined)
        first = self.builder.insert_element(empty, self.load(address, kind.element), INT(0))
        return self.shuffled(first, [0] * kind.count)

    def shuffled(self, vector: Any, order: Sequence[int]) -> Any:
        """Its lanes in another order."""
        places = ir.Constant(ir.VectorType(INT, len(order)), list(order))
        return self.builder.shuffle_vector(vector, ir.Constant(vector.type, ir.Undefined), places)


@runtime_checkable
class Arithmetic(Protocol):
    """How a layer counts, and how its numbers lie.

    Weights: ``before`` bytes of its own, then for every group of neurons ``head`` rows, the first
    of them what the sums start from, and a row for each input.
    """

    @property
    def kind(self) -> Any:
        """Of the vectors that are summed."""

    @property
    def neurons(self) -> int:
        """That share what is loaded of the pixels."""

    @property
    def outputs(self) -> int:
        """Rows of BLOCK numbers that come of a group of neurons."""

    @property
    def before(self) -> int:
        """Bytes."""

    @property
    def head(self) -> int:
        """Rows."""

    def begin(self, v: Vectors, weights: Any) -> Any:
        """What stays in registers all the time."""

    def add(self, v: Vectors, total: Any, pixels: Any, weight: Any) -> Any:
        """A sum with what one input adds."""

    def finish(
        self, v: Vectors, kept: Any, sums: list[list[Any]], second: Any
    ) -> Iterable[tuple[int, int, Any]]:
        """Row, vector and result for the sums of a group, whose second row lies there."""


def dense(arithmetic: Arithmetic) -> Any:
    """A layer for a block of pixels: addresses of inputs [inputs][BLOCK], weights and outputs."""
    neurons, head = arithmetic.neurons, arithmetic.head

    @intrinsic  # type: ignore[untyped-decorator]
    def layer(_: Any, values: Any, weights: Any, out: Any, inputs: Any, groups: Any) -> Any:
        def code(context: Any, builder: Any, _: Any, arguments: Any) -> Any:
            values, weights, out, inputs, groups = arguments
            v = Vectors(builder)
            places = room(builder, arithmetic)
            kept = arithmetic.begin(v, weights)
            group_bytes = v.scaled(v.at(inputs, head), 4 * neurons)
            parts = ir.Constant(ADDRESS, BLOCK // (LANES * VECTORS))
            with (
                cgutils.for_range(builder, groups) as group,
                cgutils.for_range(builder, parts) as part,
            ):
                start = v.at(weights, arithmetic.before, builder.mul(group.index, group_bytes))
                shift = v.scaled(part.index, VECTOR_BYTES * VECTORS)
                first = v.at(values, shift)

                def pixels(index: Any, first: Any = first) -> Any:
                    return v.at(first, v.scaled(index, 4 * BLOCK))

                sums = summed(v, arithmetic, places, start, inputs, pixels)
                second = v.at(start, 4 * neurons)
                rows = v.at(out, v.scaled(group.index, 4 * BLOCK * arithmetic.outputs), shift)
                for output, k, result in arithmetic.finish(v, kept, sums, second):
                    v.store(result, v.at(rows, 4 * BLOCK * output + VECTOR_BYTES * k))
            return context.get_dummy_value()

        return types.void(*[types.intp] * 5), code

    return layer


@intrinsic  # type: ignore[untyped-decorator]
def moved(_: Any, source: Any, step: Any, target: Any, to_step: Any, rows: Any) -> Any:
    """Copy BLOCK floats of each of some rows, which are so many bytes apart: loops take longer."""

    def code(context: Any, builder: Any, _: Any, arguments: Any) -> Any:
        v, (source, step, target, to_step, rows) = Vectors(builder), arguments
        with cgutils.for_range(builder, rows) as row:
            start, to = (
                v.at(address, builder.mul(row.index, by))
                for address, by in ((source, step), (target, to_step))
            )
            for shift in range(0, 4 * BLOCK, VECTOR_BYTES):
                v.store(v.load(v.at(start, shift), FLOATS), v.at(to, shift))
        return context.get_dummy_value()

    return types.void(*[types.intp] * 5), code


def room(builder: Any, arithmetic: Arithmetic) -> list[list[Any]]:
    """For the sums of a group of neurons over a few vectors of pixels."""
    return [
        [cgutils.alloca_once(builder, arithmetic.kind) for _ in range(VECTORS)]
        for _ in range(arithmetic.neurons)
    ]


def summed(
    v: Vectors,
    arithmetic: Arithmetic,
    places: list[list[Any]],
    start: Any,
    inputs: Any,
    pixels: Callable[[Any], Any],
    beside: Callable[[Any], None] = lambda _: None,
    together: int = 1,
) -> list[list[Any]]:
    """The sums of a group of neurons, whose weights start there.

    Args:
        v: instructions.
        arithmetic: how to count.
        places: where the sums are kept meanwhile.
        start: address of the group's weights.
        inputs: how many.
        pixels: address of an input's pixels, by its index.
        beside: what else is done in each step, by its index.
        together: inputs that are summed in a step; divides their number.
    """
    for neuron, row in enumerate(places):
        for place in row:
            v.builder.store(v.splat(v.at(start, 4 * neuron), arithmetic.kind), place)
    steps = v.builder.udiv(inputs, ir.Constant(ADDRESS, together))
    with cgutils.for_range(v.builder, steps) as step:
        for k in range(together):
            index = v.at(v.scaled(step.index, together), k)
            _summed_one(v, arithmetic, places, start, index, pixels(index))
        beside(step.index)
    return [[v.builder.load(place) for place in row] for row in places]


def _summed_one(
    v: Vectors,
    arithmetic: Arithmetic,
    places: list[list[Any]],
    start: Any,
    index: Any,
    pixels: Any,
) -> None:
    """Add what one input adds to the sums."""
    weight = v.at(start, v.scaled(v.at(index, arithmetic.head), 4 * arithmetic.neurons))
    vectors = [v.load(v.at(pixels, VECTOR_BYTES * k), arithmetic.kind) for k in range(VECTORS)]
    for neuron, row in enumerate(places):
        factor = v.splat(v.at(weight, 4 * neuron), arithmetic.kind)
        for vector, place in zip(vectors, row, strict=True):
            total = arithmetic.add(v, v.builder.load(place), vector, factor)
            v.builder.store(total, place)


def grouped(rows: np.ndarray, neurons: int) -> np.ndarray:
    """Rows of numbers for each output as a layer reads them: by groups of neurons, flat."""
    count, outputs = rows.shape
    groups = -(-outputs // neurons)
    filled = np.zeros((count, groups * neurons), rows.dtype)
    filled[:, :outputs] = rows
    return np.ascontiguousarray(filled.reshape(count, groups, neurons).swapaxes(0, 1)).ravel()
