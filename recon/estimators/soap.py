# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""SOAP: Adam along the axes in which a layer's gradients vary.

Inputs that rise and fall together make Adam, which scales each weight for itself, go in small
steps. The mean squares of a layer's gradient, taken over its outputs and over its inputs, have
axes along which they are independent (Gupta et al., Shampoo, 2018); there Adam scales what is to be
scaled (Vyas et al., SOAP: improving and stabilizing Shampoo using Adam, 2024, algorithm 3). The
axes are followed by one step of orthogonal iteration from time to time. Biases are left to Adam.
"""

from math import sqrt

import torch

from recon.estimators.descent import LEAST_ROOT, Learning, Rule, adam

SQUARES_MEMORY = 0.99
"""Adam's beta 2, along the axes."""
AXES_MEMORY = 0.95
"""Of the mean squares that the axes belong to."""
LOOK_EVERY = 4
"""Steps between gradients that enter those mean squares."""
TURN_EVERY = 20
"""Steps between turns of the axes."""


def soap_rule(learning: Learning) -> Rule:
    """The weights of each layer by SOAP, the biases by Adam."""
    pairs = list(zip(learning.layers, learning.slopes, strict=True))
    weights = [_Turned(weight, slope) for (weight, _), (slope, _) in pairs]
    biases = [
        (bias, slope, torch.zeros_like(bias), torch.zeros_like(bias))
        for (_, bias), (_, slope) in pairs
    ]

    def change(step: int, rate: float, memory: float) -> None:
        for weight in weights:
            weight.change(step, rate, memory)
        for bias in biases:
            adam(*bias, step, rate, memory)

    return change


class _Turned:
    """The weights (member, in, out) of one layer, and what is remembered of their gradient."""

    def __init__(self, weight: torch.Tensor, gradient: torch.Tensor) -> None:
        """Nothing is remembered yet.

        Args:
            weight: changed in place.
            gradient: of the same shape; read at every change.
        """
        members, inputs, outputs = weight.shape
        self.weight, self.gradient = weight, gradient
        self.over_outputs = weight.new_zeros(members, inputs, inputs)
        self.over_inputs = weight.new_zeros(members, outputs, outputs)
        self.inward = self.outward = weight.new_empty(0)
        """Axes among the inputs and among the outputs, one a column."""
        self.mean, self.squares = torch.zeros_like(weight), torch.zeros_like(weight)
        """Adam's, along the axes."""
        self._turned, self._half = torch.empty_like(weight), torch.empty_like(weight)

    def change(self, step: int, rate: float, memory: float) -> None:
        """One step, counted from 1; ``memory`` is Adam's beta 1."""
        if step == 1 or step % LOOK_EVERY == 0:
            self._look(1.0 if step == 1 else 1 - AXES_MEMORY)
        if step == 1:
            self.inward = torch.linalg.eigh(self.over_outputs)[1]
            self.outward = torch.linalg.eigh(self.over_inputs)[1]
        elif step % TURN_EVERY == 0:
            self._turn()
        turned, half = self._turned, self._half
        torch.bmm(self.inward.mT, self.gradient, out=half)
        torch.bmm(half, self.outward, out=turned)
        self.mean.lerp_(turned, 1 - memory)
        self.squares.mul_(SQUARES_MEMORY).addcmul_(turned, turned, value=1 - SQUARES_MEMORY)
        root = torch.sqrt(self.squares, out=half)
        root.div_(sqrt(1 - SQUARES_MEMORY**step)).add_(LEAST_ROOT)
        torch.div(self.mean, root, out=turned)
        torch.bmm(self.inward, turned, out=half)
        pace = -rate / (1 - memory**step)
        torch.baddbmm(self.weight, half, self.outward.mT, alpha=pace, out=self.weight)

    def _look(self, share: float) -> None:
        """Let the gradient enter the mean squares by a share."""
        gradient = self.gradient
        for squares, left, right in (
            (self.over_outputs, gradient, gradient.mT),
            (self.over_inputs, gradient.mT, gradient),
        ):
            torch.baddbmm(squares, left, right, beta=1 - share, alpha=share, out=squares)

    def _turn(self) -> None:
        """Follow the axes, and turn the remembered mean with them."""
        inward = torch.linalg.qr(self.over_outputs @ self.inward)[0]
        outward = torch.linalg.qr(self.over_inputs @ self.outward)[0]
        self.mean = (inward.mT @ self.inward) @ self.mean @ (self.outward.mT @ outward)
        self.inward, self.outward = inward, outward
