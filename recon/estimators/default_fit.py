# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Fitting of the default estimator: lean, light, networks with and without their surroundings."""

from collections.abc import Callable

import numpy as np
from jaxtyping import Float32, Int

from recon.estimators.context import fit_context, no_context, spread_of
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
from recon.estimators.lean import fit_lean, lean_at
from recon.estimators.mlp import channel_indices
from recon.estimators.networks import Layer, answers, members_of
from recon.estimators.shading import Taught, fit_light, moved
from recon.estimators.shown import shown_axes
from recon.pixels import Pixels
from sensor.errors import WedgeError

PARTS = 3
"""Of the presses. A network that is fitted without one and then forgotten measures the error."""
EXPECTED_FOR = 0.4
"""Of the networks' training, for what their surroundings are expected from."""


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
    own = (raw - mean) / spread
    around = pixels.color[:, 3:][:, chosen] if pixels.color.shape[1] > 3 else None
    unit = np.ones(len(chosen), np.float32) if around is None else spread_of(around)
    part = np.unique(pixels.press, return_inverse=True)[1] % PARTS
    target = normal_of if len(shown) == 2 else _alone
    lessons = []
    for some in (np.arange(len(part)), *(_others(part, k) for k in range(PARTS))):
        elsewhere = moved(taught[some], light, seed)
        there = (raw_inputs(elsewhere.color, light, elsewhere.position) - mean) / spread
        inputs = [with_around(own[some], None, len(chosen)), with_around(there, None, len(chosen))]
        slopes = [taught.slopes[some], elsewhere.slopes]
        if around is not None:
            inputs.append(with_around(own[some], around[some] / unit, len(chosen)))
            slopes.append(taught.slopes[some])
        lessons.append((np.concatenate(inputs), target(np.concatenate(slopes))))
    ends = np.cumsum([len(inputs) for inputs, _ in lessons])
    rows = np.split(np.arange(ends[-1]), ends[:-1])
    layers = train(
        np.concatenate([inputs for inputs, _ in lessons]),
        np.concatenate([normal for _, normal in lessons]),
        [rows[0]] * MEMBERS + rows[1:],
        seed,
        lambda share: progress(share if around is None else 0.8 * share),
    )
    layers = _silent_but(shown, layers)
    unseen = np.zeros((2, *taught.slopes.shape), np.float32)
    for k in range(PARTS):
        left_out = part == k
        seen = None if around is None else around[left_out] / unit
        for row, given in enumerate((None, seen)):
            with_it = with_around(own[left_out], given, len(chosen))
            unseen[row, left_out] = slopes_of(answers(layers, MEMBERS + k, with_it))
    context = no_context(len(chosen), own.shape[1])
    if around is not None:
        others = [_others(part, k) for k in range(PARTS)]
        expecting = train(
            own,
            around / unit,
            [np.arange(len(own)), *others],
            seed,
            lambda share: progress(0.8 + 0.2 * share),
            EXPECTED_FOR,
        )
        held_out = np.zeros_like(around)
        for k in range(PARTS):
            held_out[part == k] = answers(expecting, 1 + k, own[part == k])
        context = fit_context(
            members_of(expecting, slice(1)),
            around,
            strength_of(taught.color, spread),
            pixels.press,
            held_out,
        )
    return Default(
        channels=channels,
        light=light,
        mean=mean,
        spread=spread,
        layers=members_of(layers, slice(MEMBERS)),
        gel=gel,
        context=context,
        error90=np.stack([_error90(found, np.abs(found - taught.slopes)) for found in unseen]),
    )


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
