# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Our estimator: a few small networks on settled, smoothed colours and the light of the blank gel.

A frame's difference first loses its drift (the median of the frame, bounded) and its finest grain
(a Gaussian). Each pixel then gives its colour difference and the blank gel's colour there; with x
and y these enter perceptrons with rectifiers, whose mean is the normal's direction: the components
``G / sqrt(1 + |G|^2)``, which stay bounded where slopes do not. On a domed gel the slopes that
balls are labelled with are not the dent's; the difference is fitted first (``lean``). No neighbour
is looked at beyond the Gaussian, so that a ball's shape cannot be learnt. Applied with numpy alone;
only fitting needs torch.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import ClassVar

import cv2
import numpy as np
from jaxtyping import Float32, Int

from recon.arrays import Difference
from recon.estimators.lean import FLAT, Lean, fit_lean, lean_at
from recon.estimators.mlp import CHUNK_ROWS, channel_indices
from recon.estimators.shading import (
    LIGHT_POWERS,
    Light,
    Taught,
    blank_colors,
    fit_light,
    moved,
)
from recon.estimators.shown import shown_axes
from recon.pixels import Pixels
from sensor.errors import WedgeError

HIDDEN = (32, 32, 32)
MEMBERS = 3
"""Networks whose mean is taken."""
PARTS = 3
"""Of the presses. A network that is fitted without one and then forgotten measures the error."""
SMOOTHING = 1 / 240
"""Of the frame's shorter side: standard deviation of the Gaussian, less than a press' collar."""
DRIFT_STEP_PX = 8
LARGEST_DRIFT = 0.04
"""Of full scale, ten grey levels: a larger median is a contact and not the light's."""
STEEPEST_SLOPE = 4.0
SLOPE_KNOTS = np.array([0, 0.05, 0.1, 0.2, 0.4, 0.7, 1, 1.5, 2.5], np.float32)
"""Slopes at which the error was measured."""

Layer = tuple[np.ndarray, np.ndarray]
"""Weight (member, in, out) and bias (member, out)."""


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
    error90: Float32[np.ndarray, "k 2"]
    """Half the width of the interval that held 90 % of unseen truths, at ``SLOPE_KNOTS``."""

    def prepared(self, difference: Difference) -> Difference:
        """The difference without the frame's drift and grain."""
        return settled(difference)

    def slopes(
        self, color: Float32[np.ndarray, "n 3"], position: Float32[np.ndarray, "n 2"]
    ) -> Float32[np.ndarray, "n 2"]:
        """Gradients (mm/mm) of pixels, from prepared colours and positions (-1 to 1)."""
        slopes = np.empty((len(color), 2), np.float32)
        for start in range(0, len(color), CHUNK_ROWS):
            rows = slice(start, start + CHUNK_ROWS)
            inputs = self.inputs(color[rows], position[rows])
            normal = np.zeros((len(inputs), 2), np.float32)
            for member in range(len(self.layers[0][0])):
                normal += self._member(inputs, member)
            slopes[rows] = slopes_of(normal / len(self.layers[0][0]))
        return slopes

    def lean(self, position: Float32[np.ndarray, "*n 2"]) -> Float32[np.ndarray, "*n 2"]:
        """The dent's slopes less those of what is pressed in, mm/mm; zero on a flat gel."""
        return lean_at(self.gel, position)

    def half_width(self, slopes: Float32[np.ndarray, "*n 2"]) -> Float32[np.ndarray, "*n 2"]:
        """Half the width of each slope's 90 % interval, mm/mm.

        In nine of ten pixels of a press not learnt from, the truth lies inside.
        """
        steepness = np.linalg.norm(slopes, axis=-1)
        widths = [np.interp(steepness, SLOPE_KNOTS, column) for column in self.error90.T]
        return np.stack(widths, -1).astype(np.float32)

    def inputs(
        self, color: Float32[np.ndarray, "n 3"], position: Float32[np.ndarray, "n 2"]
    ) -> Float32[np.ndarray, "n f"]:
        """What the first layer sees, each of mean 0 and spread 1 among the fitted pixels."""
        raw = raw_inputs(color[:, channel_indices(self.channels)], self.light, position)
        return (raw - self.mean) / self.spread

    def tensors(self) -> dict[str, np.ndarray]:
        """Everything it learnt."""
        named = {
            "light": self.light,
            "mean": self.mean,
            "spread": self.spread,
            "gel": self.gel,
            "error90": self.error90,
        }
        for index, (weight, bias) in enumerate(self.layers):
            named |= {f"weight{index}": weight, f"bias{index}": bias}
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
            "error90": (len(SLOPE_KNOTS), 2),
        }
        for index, shape in enumerate(pairwise((features, *HIDDEN, 2))):
            shapes |= {f"weight{index}": (MEMBERS, *shape), f"bias{index}": (MEMBERS, shape[1])}
        for key, wanted in shapes.items():
            if tensors[key].shape != wanted:
                raise ValueError(f"{key} is {tensors[key].shape}, not {wanted}")
        layers = range(len(HIDDEN) + 1)
        return cls(
            channels=channels,
            **{key: tensors[key] for key in ("light", "mean", "spread", "gel", "error90")},
            layers=tuple((tensors[f"weight{i}"], tensors[f"bias{i}"]) for i in layers),
        )

    def _member(
        self, inputs: Float32[np.ndarray, "n f"], member: int
    ) -> Float32[np.ndarray, "n 2"]:
        values = inputs
        for weight, bias in self.layers[:-1]:
            values = values @ weight[member]
            values += bias[member]
            np.maximum(values, 0, out=values)
        weight, bias = self.layers[-1]
        return values @ weight[member] + bias[member]


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


def normal_of(slopes: Float32[np.ndarray, "n 2"]) -> Float32[np.ndarray, "n 2"]:
    """The components along x and y of the unit normal (Gx, Gy, 1) / |...|."""
    return slopes / np.sqrt(1 + (slopes**2).sum(1, keepdims=True))


def slopes_of(normal: Float32[np.ndarray, "n 2"]) -> Float32[np.ndarray, "n 2"]:
    """The inverse, bounded: no steeper than ``STEEPEST_SLOPE``."""
    squared = (normal**2).sum(1, keepdims=True)
    steepest = STEEPEST_SLOPE**2 / (1 + STEEPEST_SLOPE**2)
    within = np.sqrt(np.minimum(1, steepest / np.maximum(squared, 1e-12)))
    return normal * within / np.sqrt(1 - np.minimum(squared, steepest))


def fit_default(
    pixels: Pixels, channels: str, seed: int, progress: Callable[[float], None]
) -> Default:
    """Fit the networks to labelled pixels of prepared colours.

    Raises:
        WedgeError: torch is not installed.
    """
    try:
        from recon.estimators.default_training import train
    except ModuleNotFoundError as error:
        raise WedgeError(
            "calibration needs torch: install the extra, `pip install gelsight-wedge[train]`."
        ) from error
    chosen = channel_indices(channels)
    light = fit_light(pixels.position, pixels.blank[:, chosen])
    shown = shown_axes(pixels, chosen)
    gel = fit_lean(pixels, chosen, shown)
    taught = Taught(
        color=pixels.color[:, chosen],
        position=pixels.position,
        slopes=pixels.gradient + pixels.contact[:, None] * lean_at(gel, pixels.position),
        press=pixels.press,
    )
    raw = raw_inputs(taught.color, light, taught.position)
    mean, spread = raw.mean(0), np.maximum(raw.std(0), 1e-3)
    part = np.unique(pixels.press, return_inverse=True)[1] % PARTS
    target = normal_of if len(shown) == 2 else _alone
    lessons = [
        _lesson(some, light, target, seed)
        for some in (taught, *(taught[_others(part, k)] for k in range(PARTS)))
    ]
    ends = np.cumsum([len(inputs) for inputs, _ in lessons])
    rows = np.split(np.arange(ends[-1]), ends[:-1])
    layers = train(
        (np.concatenate([inputs for inputs, _ in lessons]) - mean) / spread,
        np.concatenate([normal for _, normal in lessons]),
        [rows[0]] * MEMBERS + rows[1:],
        seed,
        progress,
    )
    layers = _silent_but(shown, layers)
    made = Default(
        channels=channels,
        light=light,
        mean=mean,
        spread=spread,
        layers=tuple((weight[:MEMBERS], bias[:MEMBERS]) for weight, bias in layers),
        gel=gel,
        error90=np.zeros((len(SLOPE_KNOTS), 2), np.float32),
    )
    unseen = np.zeros_like(taught.slopes)
    for k in range(PARTS):
        judge = replace(made, layers=tuple((w[[MEMBERS + k]], b[[MEMBERS + k]]) for w, b in layers))
        left_out = part == k
        unseen[left_out] = judge.slopes(pixels.color[left_out], pixels.position[left_out])
    return replace(made, error90=_error90(unseen, np.abs(unseen - taught.slopes)))


def _lesson(
    taught: Taught, light: Light, target: Callable[[np.ndarray], np.ndarray], seed: int
) -> tuple[Float32[np.ndarray, "n f"], Float32[np.ndarray, "n 2"]]:
    """Raw inputs and targets of taught pixels and of those that the shading model moves."""
    both = taught, moved(taught, light, seed)
    inputs = [raw_inputs(pixels.color, light, pixels.position) for pixels in both]
    return np.concatenate(inputs), np.concatenate([target(pixels.slopes) for pixels in both])


def _others(part: Int[np.ndarray, " n"], left_out: int) -> Int[np.ndarray, " m"]:
    """The pixels of the other parts; all, where that part is all there is."""
    others = np.flatnonzero(part != left_out)
    return others if len(others) else np.arange(len(part))


def _alone(slopes: Float32[np.ndarray, "n 2"]) -> Float32[np.ndarray, "n 2"]:
    """Each slope's normal as if the other were zero: a guessed one would make it too steep."""
    return slopes / np.sqrt(1 + slopes**2)


def _silent_but(axes: list[int], layers: tuple[Layer, ...]) -> tuple[Layer, ...]:
    """Networks that answer zero but for some axes."""
    spoken = np.isin([0, 1], axes).astype(np.float32)
    weight, bias = layers[-1]
    return (*layers[:-1], (weight * spoken, bias * spoken))


def _error90(
    slopes: Float32[np.ndarray, "n 2"], errors: Float32[np.ndarray, "n 2"]
) -> Float32[np.ndarray, "k 2"]:
    """The 90 % quantile of errors near each knot of the steepness."""
    steepness = np.linalg.norm(slopes, axis=1)
    nearest = np.abs(steepness[:, None] - SLOPE_KNOTS).argmin(1)
    everywhere = np.quantile(errors, 0.9, axis=0)
    rows = [
        np.quantile(errors[nearest == k], 0.9, axis=0) if (nearest == k).sum() > 20 else everywhere
        for k in range(len(SLOPE_KNOTS))
    ]
    return np.stack(rows).astype(np.float32)
