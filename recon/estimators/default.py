# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Our estimator: a few small networks on settled, smoothed colours and what lies around them.

A frame's difference first loses its drift (the median of where colours change least, bounded) and
its finest grain (a Gaussian). Each pixel then gives its colour difference, the blank gel's colour
there, x and y, and how colours change around it (``surroundings``). These enter perceptrons with
rectifiers, whose mean is the normal's direction: the components ``G / sqrt(1 + |G|^2)``, which stay
bounded where slopes do not. On a domed gel the slopes that balls are labelled with are not the
dent's; the difference is fitted first (``lean``). Balls alone would teach what balls look like;
presses of other things, rendered, are taught beside them (``rendered``). Applied with numpy alone;
only fitting needs torch.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise
from typing import ClassVar

import cv2
import numpy as np
from jaxtyping import Bool, Float32

from recon.arrays import Difference
from recon.estimators.lean import FLAT, Lean, lean_at
from recon.estimators.mlp import CHUNK_ROWS
from recon.estimators.networks import HIDDEN, Layer, answers
from recon.estimators.shading import LIGHT_POWERS, Light, blank_colors
from recon.estimators.surroundings import (
    ASPECTS,
    SMOOTHING,
    columns_around,
    full_size,
    quartered,
    surroundings,
)
from recon.lights import channel_indices
from recon.still import FARTHEST, REACH

MEMBERS = 2
"""Networks whose mean is the estimate."""
MEMBERS_OF_FEW = 4
"""The same where few presses teach: each network learns other parts of these by heart."""
DRIFT_STEP_PX = 8
LARGEST_DRIFT = 0.04
"""Ten grey levels, of full scale: a larger median is a contact's and no drift of the light."""
CALM = 0.25
"""Share of the frame that tells the drift: where colours change least from place to place."""
CALM_SMOOTHING = 1 / 30
"""Standard deviation of the Gaussian before that is judged, of the frame's shorter side."""
LARGE_PX = 480
"""Shorter side from which on a frame's colours are smoothed by 1.4 pixels and more."""
STEEPEST_SLOPE = 2.1
"""No press teaches steeper slopes: balls pressed to nine tenths of their radius have 2.06."""
SLOPE_KNOTS = np.array([0, 0.05, 0.1, 0.2, 0.4, 0.7, 1, 1.5, 2.5], np.float32)
"""Slopes at which the error was measured."""

Prepared = Float32[np.ndarray, "ph pw p"]
"""Of as many pixels as slopes are asked for. Settled R, G, B, then what lies around."""
ARRAYS = ("light", "mean", "spread", "gel", "error90")


@dataclass(frozen=True, kw_only=True)
class Default:
    """What was learnt: the blank gel's light, the inputs' scale, the networks, their errors."""

    name: ClassVar[str] = "default"
    looks_around: ClassVar[bool] = True
    channels: str
    light: Light
    mean: Float32[np.ndarray, " f"]
    spread: Float32[np.ndarray, " f"]
    """Of each input among the pixels it was fitted on."""
    layers: tuple[Layer, ...]
    gel: Lean
    """How far the untouched gel leans against the slopes that balls are labelled with."""
    error90: Float32[np.ndarray, "k 2"] | None
    """Half the width of the interval that held 90 % of unseen truths, at ``SLOPE_KNOTS``; ``None``
    where that was not measured."""
    reach: float = REACH
    """How far gel follows what moved, in shares of the frame's shorter side; farther it is flat."""
    unlike: float | None = None
    """What the rendered standard's light leaves unexplained of the balls' squared change of colour;
    ``None`` with few lights, and in units made before."""

    def prepared(self, difference: Difference) -> Prepared:
        """The difference without the frame's drift and grain, and what lies around."""
        return prepared_colors(difference)

    def asked(self, difference: Difference) -> Prepared:
        """The same at half of a large frame's resolution: smoothed colours say as much there."""
        return prepared_colors(difference, asked_size_px(difference.shape[1::-1]))

    def slopes(
        self, color: Float32[np.ndarray, "n k"], position: Float32[np.ndarray, "n 2"]
    ) -> Float32[np.ndarray, "n 2"]:
        """Gradients (mm/mm) of pixels, from prepared colours and positions (-1 to 1)."""
        slopes, members = np.empty((len(color), 2), np.float32), len(self.layers[0][0])
        for start in range(0, len(color), CHUNK_ROWS):
            rows = slice(start, start + CHUNK_ROWS)
            inputs = self.inputs(color[rows], position[rows])
            normal = np.zeros((len(inputs), 2), np.float32)
            for member in range(members):
                normal += answers(self.layers, member, inputs)
            slopes[rows] = slopes_of(normal / members)
        return slopes

    def lean(self, position: Float32[np.ndarray, "*n 2"]) -> Float32[np.ndarray, "*n 2"]:
        """The dent's slopes less those of what is pressed in, mm/mm; zero on a flat gel."""
        return lean_at(self.gel, position)

    def half_width(self, slopes: Float32[np.ndarray, "*n 2"]) -> Float32[np.ndarray, "*n 2"] | None:
        """Half the width of each slope's 90 % interval, mm/mm; ``None`` if not measured.

        In nine of ten pixels of a press not learnt from, the truth lies inside.
        """
        if self.error90 is None:
            return None
        steepness = np.linalg.norm(slopes, axis=-1)
        columns = [np.interp(steepness, SLOPE_KNOTS, column) for column in self.error90.T]
        return np.stack(columns, -1).astype(np.float32)

    def inputs(
        self, color: Float32[np.ndarray, "n k"], position: Float32[np.ndarray, "n 2"]
    ) -> Float32[np.ndarray, "n f"]:
        """What the first layer sees, each of mean 0 and spread 1 among the balls' pixels."""
        lit = channel_indices(self.channels)
        around = color[:, columns_around(lit)]
        return (raw_inputs(color[:, lit], around, self.light, position) - self.mean) / self.spread

    def tensors(self) -> dict[str, np.ndarray]:
        """Everything it learnt."""
        named = {key: getattr(self, key) for key in ARRAYS if getattr(self, key) is not None}
        named["reach"] = np.array([self.reach], np.float32)
        if self.unlike is not None:
            named["unlike"] = np.array([self.unlike], np.float32)
        for index, (weight, bias) in enumerate(self.layers):
            named |= {f"weight{index}": weight, f"bias{index}": bias}
        return named

    @classmethod
    def from_tensors(cls, tensors: Mapping[str, np.ndarray], channels: str) -> "Default":
        """The estimator whose ``tensors()`` these are, its measured errors among them.

        Raises:
            KeyError: an array is missing.
            ValueError: an array has another shape.
        """
        count = len(channels)
        features = (2 + ASPECTS) * count + 2
        shapes: dict[str, tuple[int, ...]] = {
            "light": (len(LIGHT_POWERS), count),
            "mean": (features,),
            "spread": (features,),
            "gel": FLAT.shape,
            "error90": (len(SLOPE_KNOTS), 2),
        }
        of_few = tensors["weight0"].shape[:1] == (MEMBERS_OF_FEW,)
        members = MEMBERS_OF_FEW if of_few else MEMBERS
        for index, shape in enumerate(pairwise((features, *HIDDEN, 2))):
            shapes |= {f"weight{index}": (members, *shape), f"bias{index}": (members, shape[1])}
        for key, wanted in shapes.items():
            if tensors[key].shape != wanted:
                raise ValueError(f"{key} is {tensors[key].shape}, not {wanted}")
        layers = ((tensors[f"weight{i}"], tensors[f"bias{i}"]) for i in range(len(HIDDEN) + 1))
        reach = tensors.get("reach", np.array([REACH], np.float32))  # units made before have none
        if reach.shape != (1,) or not 0 <= reach[0] <= FARTHEST:
            raise ValueError(f"reach is {reach}, not one share from 0 to {FARTHEST}")
        unlike = tensors.get("unlike")
        if unlike is not None and (unlike.shape != (1,) or unlike[0] < 0):
            raise ValueError(f"unlike is {unlike}, not one share from 0 up")
        return cls(
            channels=channels,
            **{key: tensors[key] for key in ARRAYS},
            layers=tuple(layers),
            reach=float(reach[0]),
            unlike=None if unlike is None else float(unlike[0]),
        )


def asked_size_px(size_px: tuple[int, int]) -> tuple[int, int]:
    """Width and height in which slopes of a frame are asked for: half of a large one's."""
    if min(size_px) < LARGE_PX:
        return size_px
    width, height = size_px
    return -(-width // 2), -(-height // 2)


def prepared_colors(difference: Difference, size_px: tuple[int, int] | None = None) -> Prepared:
    """The difference without the frame's drift and grain, and what lies around.

    At some (width, height); by default the frame's own.
    """
    clean = settled(difference)
    around = surroundings(quartered(clean))
    if size_px not in (None, clean.shape[1::-1]):
        clean = cv2.resize(clean, size_px, interpolation=cv2.INTER_AREA)
    return np.concatenate([clean, full_size(around, clean)], -1)


def settled(difference: Difference) -> Difference:
    """The difference less the frame's drift, smoothed against grain."""
    drift = drift_of(difference[::DRIFT_STEP_PX, ::DRIFT_STEP_PX])
    sigma_px = SMOOTHING * min(difference.shape[:2])
    return cv2.GaussianBlur(difference - drift, (0, 0), sigma_px)


def drift_of(some: Float32[np.ndarray, "h w 3"]) -> Float32[np.ndarray, "3"]:
    """How far the light has drifted, as the median of where colours change least.

    Of the whole frame, things as large as the pad would pass for drift.

    Args:
        some: every ``DRIFT_STEP_PX``-th row and column of a difference.
    """
    some = np.ascontiguousarray(some)
    every = np.ones(some.shape[:2], bool)
    unrest, seen = np.zeros(every.shape, np.float32), ~every
    if min(every.shape) > 1:
        sigma = CALM_SMOOTHING * min(every.shape)
        along_y, along_x = np.gradient(cv2.GaussianBlur(some, (0, 0), sigma), axis=(0, 1))
        unrest = (along_y**2 + along_x**2).sum(-1)
        # What is black or burnt out does not change at all; the Gaussian reaches into it.
        around = np.ones((2 * math.ceil(4 * sigma) + 1,) * 2, np.uint8)
        seen = cv2.erode((unrest > 0).astype(np.uint8), around).astype(bool)

    def middle(of: Bool[np.ndarray, "h w"]) -> Float32[np.ndarray, "3"]:
        """Of what changes least there."""
        calm = of & (unrest <= np.quantile(unrest[of], CALM))
        return np.asarray(np.median(some[calm], axis=0), np.float32)

    drift = middle(seen if seen.mean() >= 0.5 else every)
    if np.abs(drift).max() > LARGEST_DRIFT:
        # A contact; what does not change at all beside it is gel that nothing touches.
        drift = middle(every)
    return np.clip(drift, -LARGEST_DRIFT, LARGEST_DRIFT)


def raw_inputs(
    seen: Float32[np.ndarray, "n c"],
    around: Float32[np.ndarray, "n a"],
    light: Light,
    position: Float32[np.ndarray, "n 2"],
) -> Float32[np.ndarray, "n f"]:
    """Difference, blank gel's colour, x and y of each pixel, and what lies around it."""
    return np.concatenate([seen, blank_colors(light, position), position, around], 1)


def normal_of(slopes: Float32[np.ndarray, "n 2"]) -> Float32[np.ndarray, "n 2"]:
    """The components along x and y of the unit normal (Gx, Gy, 1) / |...|."""
    return slopes / np.sqrt(1 + (slopes**2).sum(1, keepdims=True))


def slopes_of(normal: Float32[np.ndarray, "n 2"]) -> Float32[np.ndarray, "n 2"]:
    """The inverse, bounded: no steeper than ``STEEPEST_SLOPE``."""
    squared = (normal**2).sum(1, keepdims=True)
    steepest = STEEPEST_SLOPE**2 / (1 + STEEPEST_SLOPE**2)
    within = np.sqrt(np.minimum(1, steepest / np.maximum(squared, 1e-12)))
    return normal * within / np.sqrt(1 - np.minimum(squared, steepest))
