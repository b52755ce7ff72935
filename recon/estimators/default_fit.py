# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Fitting of the default estimator: lean, light, networks with and without their surroundings."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float32, Int

from recon.estimators.context import Context, fit_context, no_context, spread_of
from recon.estimators.default import (
    MEMBERS,
    SLOPE_KNOTS,
    Default,
    normal_of,
    raw_inputs,
    slopes_of,
    strength_of,
    with_around,
)
from recon.estimators.lean import Lean, fit_lean, lean_at
from recon.estimators.mlp import channel_indices
from recon.estimators.networks import Layer, answers, members_of
from recon.estimators.shading import Light, Taught, fit_light, moved
from recon.estimators.shown import shown_axes
from recon.pixels import Pixels
from sensor.errors import WedgeError

PARTS = 3
"""Of the presses. A network that is fitted without one and then forgotten measures the error."""
EXPECTED_FOR = 0.4
"""Of the networks' training, for what their surroundings are expected from."""

Progress = Callable[[float], None]
Train = Callable[..., tuple[Layer, ...]]
"""``default_training.train``, which is imported where it is needed: it brings torch."""
Inputs = Float32[np.ndarray, "n _"]


def fit_default(pixels: Pixels, channels: str, seed: int, progress: Progress) -> Default:
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
    told = _told(pixels, channels)
    share = 1.0 if told.around is None else 0.8  # of the time
    layers = _fit_networks(told, train, seed, lambda done: progress(share * done))
    context = _fit_context(told, train, seed, lambda done: progress(share + (1 - share) * done))
    return Default(
        channels=channels,
        light=told.light,
        mean=told.mean,
        spread=told.spread,
        layers=members_of(layers, slice(MEMBERS)),
        gel=told.gel,
        context=context,
        error90=_measured_error90(told, layers),
    )


@dataclass(frozen=True, kw_only=True)
class _Told:
    """Labelled pixels as the networks are told of them."""

    taught: Taught
    light: Light
    gel: Lean
    shown: list[int]
    """The axes whose slopes the colours show, of 0 and 1."""
    mean: Float32[np.ndarray, " f"]
    spread: Float32[np.ndarray, " f"]
    own: Inputs
    """What each pixel says by itself, of mean 0 and spread 1."""
    around: Inputs | None
    """What lies around, of full scale; ``None`` where nobody looked."""
    beside: Inputs | None
    """The same, of spread 1."""
    part: Int[np.ndarray, " n"]
    """Of the presses, to which each pixel belongs."""

    @property
    def colors(self) -> int:
        """How many are looked at."""
        return self.taught.color.shape[1]

    def others(self, left_out: int) -> Int[np.ndarray, " m"]:
        """The pixels of the other parts; all, where that part is all there is."""
        others = np.flatnonzero(self.part != left_out)
        return others if len(others) else np.arange(len(self.part))

    def choices(self) -> list[Int[np.ndarray, " _"]]:
        """All pixels, then those without each part."""
        return [np.arange(len(self.part)), *(self.others(k) for k in range(PARTS))]


def _told(pixels: Pixels, channels: str) -> _Told:
    """The dent's slopes and each pixel's scaled inputs, from labels and prepared colours."""
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
    around = pixels.color[:, 3:][:, chosen] if pixels.color.shape[1] > 3 else None
    return _Told(
        taught=taught,
        light=light,
        gel=gel,
        shown=shown,
        mean=mean,
        spread=spread,
        own=(raw - mean) / spread,
        around=around,
        beside=None if around is None else around / spread_of(around),
        part=np.unique(pixels.press, return_inverse=True)[1] % PARTS,
    )


def _lesson(
    told: _Told, some: Int[np.ndarray, " m"], seed: int
) -> tuple[Inputs, Float32[np.ndarray, "n 2"]]:
    """Some pixels, others moved from them, and some with their surroundings: inputs and normals."""
    elsewhere = moved(told.taught[some], told.light, seed)
    raw = raw_inputs(elsewhere.color, told.light, elsewhere.position)
    there = (raw - told.mean) / told.spread
    slopes = [told.taught.slopes[some], elsewhere.slopes]
    inputs = [with_around(own, None, told.colors) for own in (told.own[some], there)]
    if told.beside is not None:
        inputs.append(with_around(told.own[some], told.beside[some], told.colors))
        slopes.append(told.taught.slopes[some])
    target = normal_of if len(told.shown) == 2 else _alone
    return np.concatenate(inputs), target(np.concatenate(slopes))


def _fit_networks(told: _Told, train: Train, seed: int, progress: Progress) -> tuple[Layer, ...]:
    """``MEMBERS`` networks that learn from all pixels, then one without each part."""
    lessons = [_lesson(told, some, seed) for some in told.choices()]
    ends = np.cumsum([len(inputs) for inputs, _ in lessons])
    rows = np.split(np.arange(ends[-1]), ends[:-1])
    layers = train(
        np.concatenate([inputs for inputs, _ in lessons]),
        np.concatenate([normals for _, normals in lessons]),
        [rows[0]] * MEMBERS + rows[1:],
        seed,
        progress,
    )
    return _silent_but(told.shown, layers)


def _measured_error90(told: _Told, layers: tuple[Layer, ...]) -> Float32[np.ndarray, "2 k 2"]:
    """The errors' quantiles by networks that saw no such press: without, with surroundings."""
    truth = told.taught.slopes
    unseen = np.zeros((2, *truth.shape), np.float32)
    for k in range(PARTS):
        left_out = told.part == k
        beside = None if told.beside is None else told.beside[left_out]
        for row, given in enumerate((None, beside)):
            inputs = with_around(told.own[left_out], given, told.colors)
            unseen[row, left_out] = slopes_of(answers(layers, MEMBERS + k, inputs))
    return np.stack([_error90(found, np.abs(found - truth)) for found in unseen])


def _fit_context(told: _Told, train: Train, seed: int, progress: Progress) -> Context:
    """What surroundings are expected of a pixel's own inputs, by networks of their own."""
    if told.around is None or told.beside is None:
        return no_context(told.colors, told.own.shape[1])
    expecting = train(told.own, told.beside, told.choices(), seed, progress, EXPECTED_FOR)
    held_out = np.zeros_like(told.around)
    for k in range(PARTS):
        held_out[told.part == k] = answers(expecting, 1 + k, told.own[told.part == k])
    return fit_context(
        members_of(expecting, slice(1)),
        told.around,
        strength_of(told.taught.color, told.spread),
        told.taught.press,
        held_out,
    )


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
