# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Dense layers in 32-bit floating point, for every processor."""

from collections.abc import Iterator
from typing import Any

import numpy as np

from recon.fast.vectors import FLOATS, LANES, Vectors, dense, grouped

TANH = (
    (0.999994423, 0.122688503, 0.00224750941, 3.79305189e-06),
    (1.0, 0.456002936, 0.0209339572, 0.000139171628),
)
"""tanh(x)/x as a quotient in x^2, constants first: least largest error on 0..LARGEST, 1.3e-6, found
by linear programming. Held at LARGEST beyond."""
LARGEST = 7.25
NEURONS, LAST = 4, 2
"""Neurons that share what is loaded: of a hidden layer, of the last one."""


class _Linear:
    """Sums of floats."""

    kind: Any = FLOATS
    before = 0
    head = 1

    def __init__(self, neurons: int = NEURONS) -> None:
        self.neurons = self.outputs = neurons

    def begin(self, v: Vectors, weights: Any) -> None:
        """Nothing."""

    def add(self, v: Vectors, total: Any, pixels: Any, weight: Any) -> Any:
        """One product."""
        return fma(v, weight, pixels, total)

    def finish(
        self, v: Vectors, _: None, sums: list[list[Any]], __: Any
    ) -> Iterator[tuple[int, int, Any]]:
        """Activations."""
        for neuron, row in enumerate(sums):
            for k, total in enumerate(row):
                yield neuron, k, self.activated(v, total)

    def activated(self, _: Vectors, total: Any) -> Any:
        """The sum itself."""
        return total


class _Tanh(_Linear):
    """Sums of floats through tanh."""

    def activated(self, v: Vectors, x: Any) -> Any:
        """The quotient of two polynomials."""
        builder = v.builder
        for order, limit in (("<", LARGEST), (">", -LARGEST)):
            bound = v.constant(FLOATS, limit)
            x = builder.select(builder.fcmp_ordered(order, x, bound), x, bound)
        squared = builder.fmul(x, x)
        quotient = []
        for series in TANH:
            value = v.constant(FLOATS, series[-1])
            for term in reversed(series[:-1]):
                value = fma(v, value, squared, v.constant(FLOATS, term))
            quotient.append(value)
        return builder.fdiv(builder.fmul(x, quotient[0]), quotient[1])


class Rectified(_Linear):
    """Sums of floats, none below zero."""

    def activated(self, v: Vectors, total: Any) -> Any:
        """The larger of the sum and zero."""
        zero = v.constant(FLOATS, 0.0)
        return v.builder.select(v.builder.fcmp_ordered(">", total, zero), total, zero)


tanh_layer, rectified_layer = dense(_Tanh()), dense(Rectified())
last_layer = dense(_Linear(LAST))


def packed(weight: np.ndarray, bias: np.ndarray, neurons: int = NEURONS) -> np.ndarray:
    """Weights [in, out] and biases [out] as a layer reads them."""
    return grouped(np.vstack([bias, weight]).astype(np.float32), neurons)


def fma(v: Vectors, a: Any, b: Any, c: Any) -> Any:
    """``a * b + c``, rounded once."""
    return v.call(f"llvm.fma.v{LANES}f32", FLOATS, a, b, c)
