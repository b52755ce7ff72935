# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""The paper's estimator: a perceptron 5-32-32-32-2 with tanh on (R, G, B, X, Y).

Wang et al., GelSight Wedge, 2021, section IV-A. With fewer lights it has fewer inputs. Applied
with numpy alone; only fitting (``mlp_fit``) needs torch.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise
from typing import ClassVar

import numpy as np
from jaxtyping import Float32

from recon.arrays import Difference
from recon.lights import channel_indices

HIDDEN = (32, 32, 32)
CHUNK_ROWS = 2048
"""Rows evaluated at a time: the activations of one chunk stay in the cache."""

Layer = tuple[np.ndarray, np.ndarray]


@dataclass(frozen=True, kw_only=True)
class Mlp:
    """Layers (weight [in, out], bias [out]); inputs are the channels, then X and Y."""

    name: ClassVar[str] = "mlp"
    reach: ClassVar[None] = None
    looks_around: ClassVar[bool] = False
    channels: str
    color_scale: Float32[np.ndarray, " c"]
    """Each channel is divided by its spread among the pixels it was fitted on."""
    layers: tuple[Layer, ...]

    def prepared(self, difference: Difference) -> Difference:
        """The difference as it is."""
        return difference

    def asked(self, difference: Difference) -> Difference:
        """The difference as it is."""
        return difference

    def slopes(
        self, color: Float32[np.ndarray, "n 3"], position: Float32[np.ndarray, "n 2"]
    ) -> Float32[np.ndarray, "n 2"]:
        """Gradients (mm/mm) of pixels, from colours (full scale) and positions (-1 to 1)."""
        slopes = np.empty((len(color), 2), np.float32)
        for start in range(0, len(color), CHUNK_ROWS):
            rows = slice(start, start + CHUNK_ROWS)
            values = self.inputs(color[rows], position[rows])
            for weight, bias in self.layers[:-1]:
                values = values @ weight
                values += bias
                np.tanh(values, out=values)
            weight, bias = self.layers[-1]
            slopes[rows] = values @ weight + bias
        return slopes

    def inputs(
        self, color: Float32[np.ndarray, "n 3"], position: Float32[np.ndarray, "n 2"]
    ) -> Float32[np.ndarray, "n f"]:
        """What the first layer sees: scaled channels, X and Y."""
        seen = color[:, channel_indices(self.channels)] / self.color_scale
        return np.concatenate([seen, position], 1)

    def lean(self, position: Float32[np.ndarray, "*n 2"]) -> Float32[np.ndarray, "*n 2"]:
        """None: the gel is taken as flat."""
        return np.zeros_like(position)

    def half_width(self, slopes: Float32[np.ndarray, "*n 2"]) -> None:
        """Not measured."""

    def tensors(self) -> dict[str, np.ndarray]:
        """Everything it learnt."""
        named = {"color_scale": self.color_scale}
        for index, (weight, bias) in enumerate(self.layers):
            named |= {f"weight{index}": weight, f"bias{index}": bias}
        return named

    @classmethod
    def from_tensors(cls, tensors: Mapping[str, np.ndarray], channels: str) -> "Mlp":
        """The estimator whose ``tensors()`` these are.

        Raises:
            KeyError: an array is missing.
            ValueError: an array has another shape.
        """
        sizes = (len(channels) + 2, *HIDDEN, 2)
        layers = []
        for index, shape in enumerate(pairwise(sizes)):
            weight, bias = tensors[f"weight{index}"], tensors[f"bias{index}"]
            if weight.shape != shape or bias.shape != shape[1:]:
                raise ValueError(f"layer {index} is {weight.shape} and {bias.shape}, not {shape}")
            layers.append((weight, bias))
        if tensors["color_scale"].shape != (len(channels),):
            raise ValueError("color_scale has not one number per channel")
        return cls(channels=channels, color_scale=tensors["color_scale"], layers=tuple(layers))
