# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Loops that a frame passes at camera rate, compiled for this processor when first used.

What a compiler makes of Python's loops leaves most of a processor idle, so the one that takes most
of the time, a layer of the network, is written as vector instructions here. Machine code is kept in
the user's cache.
"""

import hashlib
import inspect
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from sensor.errors import WedgeError

try:
    import llvmlite.binding as llvm
    import numba
    from llvmlite import ir
    from numba.core import cgutils, types
    from numba.extending import intrinsic
except ModuleNotFoundError as error:
    raise WedgeError(
        "depth at camera rate needs numba: install the extra, `pip install gelsight-wedge[live]`."
    ) from error

BLOCK = 64
"""Pixels that pass a layer together."""
NEURONS = 4
"""That share what is loaded of the pixels."""
LANES = 16 if llvm.get_host_cpu_features().get("avx512f") else 8
VECTORS = 4 if LANES == 16 else 2
TANH = (
    (0.999994423, 0.122688503, 0.00224750941, 3.79305189e-06),
    (1.0, 0.456002936, 0.0209339572, 0.000139171628),
)
"""tanh(x)/x as a quotient in x^2, constants first: least largest error on 0..LARGEST, 1.3e-6, found
by linear programming. Held at LARGEST beyond."""
LARGEST = 7.25

_FLOAT, _INT = ir.FloatType(), ir.IntType(64)
_VECTOR = ir.VectorType(_FLOAT, LANES)


def code_folder() -> Path:
    """Where machine code is kept, by what it was made from."""
    base = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
    cache = os.environ.get("WEDGE_CACHE") or base / "gelsight-wedge"
    sources = sorted(Path(__file__).parent.glob("*.py"))
    made_from = hashlib.sha256(b"".join(path.read_bytes() for path in sources))
    return Path(cache) / "compiled" / made_from.hexdigest()[:12]


CODE_FOLDER = code_folder()
FAST = {"contract", "reassoc", "nsz", "nnan"}


def compiled(function: Callable[..., Any]) -> Callable[..., Any]:
    """The function as machine code, kept for the next start where the cache can be written."""
    kept, keeps = numba.config.CACHE_DIR, True
    try:
        CODE_FOLDER.mkdir(parents=True, exist_ok=True)
    except OSError:
        keeps = False
    keeps = keeps and os.access(CODE_FOLDER, os.W_OK)
    numba.config.CACHE_DIR = kept or str(CODE_FOLDER)
    try:
        jit = numba.njit(cache=keeps, nogil=True, fastmath=FAST, error_model="numpy")
        code: Callable[..., Any] = jit(inspect.unwrap(function))
    finally:
        numba.config.CACHE_DIR = kept
    return code


class _Vectors:
    """Instructions on whole vectors of pixels."""

    def __init__(self, builder: Any) -> None:
        self.builder = builder
        signature = ir.FunctionType(_VECTOR, [_VECTOR] * 3)
        name = f"llvm.fma.v{LANES}f32"
        self._fma = cgutils.get_or_insert_function(builder.module, signature, name)

    def constant(self, value: float) -> Any:
        return ir.Constant(_VECTOR, [ir.Constant(_FLOAT, value)] * LANES)

    def at(self, address: Any, *offsets: Any) -> Any:
        """An address so many bytes on."""
        for offset in offsets:
            other = ir.Constant(_INT, offset) if isinstance(offset, int) else offset
            address = self.builder.add(address, other)
        return address

    def scaled(self, index: Any, by: int) -> Any:
        return self.builder.mul(index, ir.Constant(_INT, by))

    def load(self, address: Any) -> Any:
        pointer = self.builder.inttoptr(address, _VECTOR.as_pointer())
        return self.builder.load(pointer, align=4)

    def store(self, vector: Any, address: Any) -> None:
        pointer = self.builder.inttoptr(address, _VECTOR.as_pointer())
        self.builder.store(vector, pointer, align=4)

    def splat(self, address: Any) -> Any:
        """One number in all lanes."""
        scalar = self.builder.load(self.builder.inttoptr(address, _FLOAT.as_pointer()), align=4)
        return self.spread(scalar)

    def spread(self, scalar: Any) -> Any:
        empty = ir.Constant(_VECTOR, ir.Undefined)
        zero = ir.IntType(32)(0)
        first = self.builder.insert_element(empty, scalar, zero)
        lanes = ir.Constant(ir.VectorType(ir.IntType(32), LANES), [0] * LANES)
        return self.builder.shuffle_vector(first, empty, lanes)

    def fma(self, a: Any, b: Any, c: Any) -> Any:
        return self.builder.call(self._fma, [a, b, c])

    def tanh(self, x: Any) -> Any:
        builder = self.builder
        for order, bound in (("<", self.constant(LARGEST)), (">", self.constant(-LARGEST))):
            x = builder.select(builder.fcmp_ordered(order, x, bound), x, bound)
        squared = builder.fmul(x, x)
        quotient = []
        for series in TANH:
            value = self.constant(series[-1])
            for term in reversed(series[:-1]):
                value = self.fma(value, squared, self.constant(term))
            quotient.append(value)
        return builder.fdiv(builder.fmul(x, quotient[0]), quotient[1])


def _layer(activated: bool) -> Any:
    """A dense layer of a block of pixels: addresses of its inputs, weights and outputs.

    Inputs are [inputs][BLOCK], outputs [groups * NEURONS][BLOCK]; weights are as ``packed`` lays
    them.
    """

    @intrinsic  # type: ignore[untyped-decorator]
    def layer(_: Any, values: Any, weights: Any, out: Any, inputs: Any, groups: Any) -> Any:
        def code(context: Any, builder: Any, _: Any, arguments: Any) -> Any:
            values, weights, out, inputs, groups = arguments
            v = _Vectors(builder)
            sums = [
                [cgutils.alloca_once(builder, _VECTOR) for _ in range(VECTORS)]
                for _ in range(NEURONS)
            ]
            group_bytes = v.scaled(v.at(inputs, 1), 4 * NEURONS)
            parts = ir.Constant(_INT, BLOCK // (LANES * VECTORS))
            with (
                cgutils.for_range(builder, groups) as group,
                cgutils.for_range(builder, parts) as part,
            ):
                bias = v.at(weights, builder.mul(group.index, group_bytes))
                shift = v.scaled(part.index, 4 * LANES * VECTORS)
                for neuron, row in enumerate(sums):
                    for place in row:
                        builder.store(v.splat(v.at(bias, 4 * neuron)), place)
                with cgutils.for_range(builder, inputs) as i:
                    weight = v.at(bias, v.scaled(v.at(i.index, 1), 4 * NEURONS))
                    value = v.at(values, v.scaled(i.index, 4 * BLOCK), shift)
                    pixels = [v.load(v.at(value, 4 * LANES * k)) for k in range(VECTORS)]
                    for neuron, row in enumerate(sums):
                        factor = v.splat(v.at(weight, 4 * neuron))
                        for pixel, place in zip(pixels, row, strict=True):
                            builder.store(v.fma(factor, pixel, builder.load(place)), place)
                rows = v.at(out, v.scaled(group.index, 4 * BLOCK * NEURONS), shift)
                for neuron, row in enumerate(sums):
                    for k, place in enumerate(row):
                        result = builder.load(place)
                        target = v.at(rows, 4 * (neuron * BLOCK + k * LANES))
                        v.store(v.tanh(result) if activated else result, target)
            return context.get_dummy_value()

        return types.void(*[types.intp] * 5), code

    return layer


hidden, last = _layer(activated=True), _layer(activated=False)


def packed(weight: np.ndarray, bias: np.ndarray) -> np.ndarray:
    """Weights [in, out] and biases [out] as a layer reads them: by groups of ``NEURONS``."""
    inputs, outputs = weight.shape
    groups = -(-outputs // NEURONS)
    rows = np.zeros((inputs + 1, groups * NEURONS), np.float32)
    rows[0, :outputs], rows[1:, :outputs] = bias, weight
    return np.ascontiguousarray(rows.reshape(inputs + 1, groups, NEURONS).swapaxes(0, 1))
