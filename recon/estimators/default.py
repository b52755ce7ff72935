# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Our estimator: a few small networks on settled, smoothed colours and the light of the blank gel.

A frame's difference first loses its drift (the median of the frame, bounded) and its finest grain
(a Gaussian). Each pixel then gives its colour difference and the blank gel's colour there; with x
and y these enter perceptrons with rectifiers, whose mean is the normal's direction: the components
``G / sqrt(1 + |G|^2)``, which stay bounded where slopes do not. On a domed gel the slopes that
balls are labelled with are not the dent's; the difference is fitted first (``lean``). What lies
around a pixel is an input too, but only where it resembles what the presses showed (``context``):
elsewhere it is withheld, and the networks answer as they have learnt to without it. Applied with
numpy alone; only fitting needs torch.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise
from typing import ClassVar

import cv2
import numpy as np
from jaxtyping import Float32

from recon.arrays import Difference
from recon.estimators.context import (
    BINS,
    FAINT,
    SMOOTHING,
    Context,
    quartered,
    sampled,
    surroundings,
)
from recon.estimators.lean import FLAT, Lean, lean_at
from recon.estimators.mlp import CHUNK_ROWS, channel_indices
from recon.estimators.networks import HIDDEN, Layer, answers
from recon.estimators.shading import (
    LIGHT_POWERS,
    Light,
    blank_colors,
)
from recon.pixels import positions

MEMBERS = 3
"""Networks whose mean is taken."""
DRIFT_STEP_PX = 8
LARGEST_DRIFT = 0.04
"""Of full scale, ten grey levels: a larger median is a contact and not the light's."""
STEEPEST_SLOPE = 4.0
SLOPE_KNOTS = np.array([0, 0.05, 0.1, 0.2, 0.4, 0.7, 1, 1.5, 2.5], np.float32)
"""Slopes at which the error was measured."""

CONTEXT_ARRAYS = ("spread", "edges", "precision", "limit")

Prepared = Float32[np.ndarray, "h w 7"]
"""Settled R, G, B; what lies around in R, G, B, as far as it is familiar; how familiar, 0 to 1."""


@dataclass(frozen=True, kw_only=True)
class Default:
    """What was learnt: the blank gel's light, the inputs' scale, the networks, their errors."""

    name: ClassVar[str] = "default"
    flattens: ClassVar[bool] = True
    channels: str
    light: Light
    mean: Float32[np.ndarray, " f"]
    spread: Float32[np.ndarray, " f"]
    """Of each input among the pixels it was fitted on."""
    layers: tuple[Layer, ...]
    gel: Lean
    """How far the untouched gel leans against the slopes that balls are labelled with."""
    context: Context
    error90: Float32[np.ndarray, "2 k 2"]
    """Half the width of the interval that held 90 % of unseen truths, at ``SLOPE_KNOTS``: where
    the surroundings were withheld, and where they were given."""

    def prepared(self, difference: Difference) -> Prepared:
        """The difference without the frame's drift and grain, and what is familiar around it."""
        clean = settled(difference)
        height, width = clean.shape[:2]
        around = self.around(quartered(clean), clean[np.ix_(sampled(height), sampled(width))])
        return np.concatenate([clean, cv2.resize(around, (width, height))], -1)

    def around(
        self, quarter: Float32[np.ndarray, "qh qw 3"], some: Float32[np.ndarray, "sh sw 3"]
    ) -> Float32[np.ndarray, "qh qw 4"]:
        """The surroundings that are familiar, and how familiar they are, at a quarter's resolution.

        Args:
            quarter: settled colours, ``context.quartered``.
            some: settled colours of the pixels that ``context.sampled`` names.
        """
        height, width = quarter.shape[:2]
        around = surroundings(quarter)
        lit = channel_indices(self.channels)
        seen, beside = (planes.reshape(-1, 3)[:, lit] for planes in (some, around[::2, ::2]))
        place = positions((width, height))[::2, ::2].reshape(-1, 2)
        strength = strength_of(seen, self.spread)
        asked = np.flatnonzero(strength >= FAINT)
        novel = np.zeros(len(strength), bool)
        own = self._scaled(seen[asked], place[asked])
        novel[asked] = self.context.novel(own, beside[asked], strength[asked])
        familiar = self.context.familiar(novel, strength, some.shape[:2])
        familiar = cv2.resize(familiar, (width, height))[..., None]
        return np.concatenate([around * familiar, familiar], -1)

    def slopes(
        self, color: Float32[np.ndarray, "n k"], position: Float32[np.ndarray, "n 2"]
    ) -> Float32[np.ndarray, "n 2"]:
        """Gradients (mm/mm) of pixels, from prepared colours and positions (-1 to 1).

        Of settled colours alone, nothing around them is taken as familiar.
        """
        slopes = np.empty((len(color), 2), np.float32)
        for start in range(0, len(color), CHUNK_ROWS):
            rows = slice(start, start + CHUNK_ROWS)
            inputs = self.inputs(color[rows], position[rows])
            normal = np.zeros((len(inputs), 2), np.float32)
            for member in range(len(self.layers[0][0])):
                normal += answers(self.layers, member, inputs)
            slopes[rows] = slopes_of(normal / len(self.layers[0][0]))
        return slopes

    def lean(self, position: Float32[np.ndarray, "*n 2"]) -> Float32[np.ndarray, "*n 2"]:
        """The dent's slopes less those of what is pressed in, mm/mm; zero on a flat gel."""
        return lean_at(self.gel, position)

    def half_width(
        self,
        slopes: Float32[np.ndarray, "*n 2"],
        familiar: Float32[np.ndarray, "*n"] | float = 1.0,
    ) -> Float32[np.ndarray, "*n 2"]:
        """Half the width of each slope's 90 % interval, mm/mm.

        In nine of ten pixels of a press not learnt from, the truth lies inside.

        Args:
            slopes: as found.
            familiar: how familiar what lies around is, the last of the prepared columns.
        """
        steepness = np.linalg.norm(slopes, axis=-1)
        without, given = (
            np.stack([np.interp(steepness, SLOPE_KNOTS, column) for column in table.T], -1)
            for table in self.error90
        )
        return (without + (given - without) * np.asarray(familiar)[..., None]).astype(np.float32)

    def inputs(
        self, color: Float32[np.ndarray, "n k"], position: Float32[np.ndarray, "n 2"]
    ) -> Float32[np.ndarray, "n f"]:
        """What the first layer sees, each of mean 0 and spread 1 among the fitted pixels."""
        lit = channel_indices(self.channels)
        own = self._scaled(color[:, lit], position)
        if color.shape[1] == 3:
            return with_around(own, None, len(lit))
        around = color[:, [3 + channel for channel in lit]] / self.context.spread
        return np.concatenate([own, around, 2 * color[:, 6:] - 1], 1)

    def _scaled(
        self, seen: Float32[np.ndarray, "n c"], position: Float32[np.ndarray, "n 2"]
    ) -> Float32[np.ndarray, "n f"]:
        """A pixel's own inputs."""
        return (raw_inputs(seen, self.light, position) - self.mean) / self.spread

    def tensors(self) -> dict[str, np.ndarray]:
        """Everything it learnt."""
        named = {
            "light": self.light,
            "mean": self.mean,
            "spread": self.spread,
            "gel": self.gel,
            "error90": self.error90,
        }
        context = self.context
        named |= {f"around_{key}": getattr(context, key) for key in CONTEXT_ARRAYS}
        for prefix, layers in (("", self.layers), ("around_", context.layers)):
            for index, (weight, bias) in enumerate(layers):
                named |= {f"{prefix}weight{index}": weight, f"{prefix}bias{index}": bias}
        return named

    @classmethod
    def from_tensors(cls, tensors: Mapping[str, np.ndarray], channels: str) -> "Default":
        """The estimator whose ``tensors()`` these are.

        Raises:
            KeyError: an array is missing.
            ValueError: an array has another shape.
        """
        count = len(channels)
        features = 2 * count + 2
        shapes = {
            "light": (len(LIGHT_POWERS), count),
            "mean": (features,),
            "spread": (features,),
            "gel": FLAT.shape,
            "error90": (2, len(SLOPE_KNOTS), 2),
            "around_spread": (count,),
            "around_edges": (BINS - 1,),
            "around_precision": (BINS, count, count),
            "around_limit": (1,),
        }
        for prefix, members, ends in (
            ("", MEMBERS, (features + count + 1, 2)),
            ("around_", 1, (features, count)),
        ):
            for index, shape in enumerate(pairwise((ends[0], *HIDDEN, ends[1]))):
                shapes |= {
                    f"{prefix}weight{index}": (members, *shape),
                    f"{prefix}bias{index}": (members, shape[1]),
                }
        for key, wanted in shapes.items():
            if tensors[key].shape != wanted:
                raise ValueError(f"{key} is {tensors[key].shape}, not {wanted}")
        layers, around = (
            tuple(
                (tensors[f"{prefix}weight{i}"], tensors[f"{prefix}bias{i}"])
                for i in range(len(HIDDEN) + 1)
            )
            for prefix in ("", "around_")
        )
        learnt = {key: tensors[f"around_{key}"] for key in CONTEXT_ARRAYS}
        return cls(
            channels=channels,
            **{key: tensors[key] for key in ("light", "mean", "spread", "gel", "error90")},
            layers=layers,
            context=Context(layers=around, **learnt),
        )


def settled(difference: Difference) -> Difference:
    """The difference less the frame's drift, smoothed against grain."""
    some = difference[::DRIFT_STEP_PX, ::DRIFT_STEP_PX]
    drift = np.clip(np.median(some, axis=(0, 1)), -LARGEST_DRIFT, LARGEST_DRIFT)
    sigma_px = SMOOTHING * min(difference.shape[:2])
    return cv2.GaussianBlur(difference - drift.astype(np.float32), (0, 0), sigma_px)


def raw_inputs(
    seen: Float32[np.ndarray, "n c"], light: Light, position: Float32[np.ndarray, "n 2"]
) -> Float32[np.ndarray, "n f"]:
    """Difference, blank gel's colour, x and y of each pixel."""
    return np.concatenate([seen, blank_colors(light, position), position], 1)


def strength_of(
    seen: Float32[np.ndarray, "n c"], spread: Float32[np.ndarray, " f"]
) -> Float32[np.ndarray, " n"]:
    """How strongly colours changed, in spreads of the fitted pixels."""
    return np.asarray(np.linalg.norm(seen / spread[: seen.shape[1]], axis=1), np.float32)


def normal_of(slopes: Float32[np.ndarray, "n 2"]) -> Float32[np.ndarray, "n 2"]:
    """The components along x and y of the unit normal (Gx, Gy, 1) / |...|."""
    return slopes / np.sqrt(1 + (slopes**2).sum(1, keepdims=True))


def slopes_of(normal: Float32[np.ndarray, "n 2"]) -> Float32[np.ndarray, "n 2"]:
    """The inverse, bounded: no steeper than ``STEEPEST_SLOPE``."""
    squared = (normal**2).sum(1, keepdims=True)
    steepest = STEEPEST_SLOPE**2 / (1 + STEEPEST_SLOPE**2)
    within = np.sqrt(np.minimum(1, steepest / np.maximum(squared, 1e-12)))
    return normal * within / np.sqrt(1 - np.minimum(squared, steepest))


def with_around(
    own: Float32[np.ndarray, "n f"], around: Float32[np.ndarray, "n c"] | None, colors: int
) -> Float32[np.ndarray, "n g"]:
    """Inputs of the networks: a pixel's own, its surroundings, 1 where these are given, else -1."""
    flag = np.full((len(own), 1), -1 if around is None else 1, np.float32)
    given = np.zeros((len(own), colors), np.float32) if around is None else around
    return np.concatenate([own, given, flag], 1)
