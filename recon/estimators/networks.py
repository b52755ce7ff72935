# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Small networks of rectifiers, side by side, applied with numpy alone."""

import numpy as np
from jaxtyping import Float32

HIDDEN = (128, 64, 48)
"""Neurons of each layer. It is the first that pays for width (docs/tried/estimators.md)."""

Layer = tuple[np.ndarray, np.ndarray]
"""Weight (member, in, out) and bias (member, out)."""


def answers(
    layers: tuple[Layer, ...], member: int, inputs: Float32[np.ndarray, "n f"]
) -> Float32[np.ndarray, "n o"]:
    """What one of the networks answers to each row."""
    values = inputs
    for weight, bias in layers[:-1]:
        values = values @ weight[member]
        values += bias[member]
        np.maximum(values, 0, out=values)
    weight, bias = layers[-1]
    return values @ weight[member] + bias[member]


def members_of(layers: tuple[Layer, ...], chosen: slice) -> tuple[Layer, ...]:
    """Some of the networks."""
    return tuple((weight[chosen], bias[chosen]) for weight, bias in layers)
