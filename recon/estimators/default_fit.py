# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Fitting of the default estimator: lean, light, networks taught by balls and rendered things."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float32, Int

from recon.estimators.default import (
    MEMBERS,
    MEMBERS_OF_FEW,
    SLOPE_KNOTS,
    Default,
    normal_of,
    raw_inputs,
    slopes_of,
)
from recon.estimators.effort import Effort
from recon.estimators.elsewhere import (
    COVERED,
    UNTOLD,
    covered_by,
    here_and_elsewhere,
    times_elsewhere,
)
from recon.estimators.lean import Lean, fit_lean, lean_at
from recon.estimators.lesson import FEW
from recon.estimators.networks import Layer, answers, members_of
from recon.estimators.rendered import rendered_pixels, unlike
from recon.estimators.shading import Light, Taught, fit_light, fit_shading
from recon.estimators.shown import shown_axes
from recon.estimators.surroundings import columns_around, of_other_sizes
from recon.lights import channel_indices
from recon.pixels import Pixels
from recon.still import reach_of

LEFT_OUT = 3
"""One in so many presses, and in so many rendered pixels, is held out from an extra network, which
measures the error and is then forgotten."""
FEWEST_PIXELS = 20
"""Held-out pixels near a slope knot, below which the error there is not told."""
LEANING = 0.6
"""Share of the lean that colours tell, by which labels lean: the rest is light that a dent turns
away."""
RENDERED = 2.0
"""Rendered pixels for each pixel of a ball."""
RENDERED_BESIDE_FEW = 1.0
"""The same where there are few presses, each of which teaches more pixels."""
FEWEST_COLLARS = 3
"""Presses with a fitted collar, below which none is told of the sensor."""
OTHER_SIZES = 0.8, 1.8
"""Half of the balls' pixels are taught as those of a ball so many times as large: balls of one size
would teach that size."""
HASTY = 1 / 3
"""Share of the training's steps in a hasty fit."""
STANDARD, COLORS = "standard", "RGB"
"""The rendered sensor to whose light ``Default.unlike`` compares, and the colours that it needs."""
UNLIKE = 0.25
"""Unexplained share of the balls' change of colour, from which on rendered sensors do not say how
the gel beside a contact looks: all labelled collars are then learnt from."""

Progress = Callable[[float], None]
Inputs = Float32[np.ndarray, "n f"]


def fit_default(
    pixels: Pixels, channels: str, seed: int, progress: Progress, effort: Effort
) -> Default:
    """Fit the networks to labelled pixels of prepared colours.

    Its error is measured by one more network.

    Raises:
        WedgeError: the rendered pixels are damaged.
    """
    from recon.estimators.default_training import train

    told = _told(pixels, channels, seed)
    with_doubt = effort is Effort.WHOLE
    layers = train(
        told.inputs,
        normal_of(told.slopes),
        _choices(told),
        told.members + with_doubt,
        seed,
        progress,
        HASTY if effort is Effort.HASTY else 1.0,
    )
    return Default(
        channels=channels,
        light=told.light,
        mean=told.mean,
        spread=told.spread,
        layers=members_of(layers, slice(told.members)),
        gel=told.gel,
        error90=_measured_error90(told, layers) if with_doubt else None,
        reach=reach_of(collar_of(pixels)),
        unlike=told.unlike,
    )


@dataclass(frozen=True, kw_only=True)
class _Told:
    """What the networks are taught: pixels of balls, then of rendered presses.

    Balls come first where they were pressed, then moved elsewhere, ``times`` times in each way.
    """

    light: Light
    gel: Lean
    mean: Float32[np.ndarray, " f"]
    spread: Float32[np.ndarray, " f"]
    inputs: Inputs
    """Of mean 0 and spread 1 among the balls' pixels as they are, before some change size."""
    slopes: Float32[np.ndarray, "n 2"]
    """Of the dent, mm/mm."""
    of_balls: Bool[np.ndarray, " n"]
    unseen: Bool[np.ndarray, " n"]
    """Held out from the network that measures the error: some balls and some rendered pixels."""
    measured: Int[np.ndarray, " m"]
    """The held-out pixels that the error is measured on; of balls, where they were pressed."""
    measured_inputs: Float32[np.ndarray, "m f"]
    """Their inputs, with balls of their own size."""
    times: int
    """How often a network is taught each ball elsewhere."""
    ways: int
    """How many ways of moving balls there are; each network is taught one."""
    members: int
    """Networks whose mean is taken."""
    unlike: float | None
    """As ``Default.unlike``."""
    here_alone: int
    """How many of them, the first, are taught balls only where they were pressed: what these learn
    by heart and what the model of the light tells the others wrongly are errors of two kinds."""


def dents(pixels: Pixels, columns: list[int]) -> tuple[Taught, Light, Lean]:
    """Labelled balls as the dents that they leave, the light of the blank gel, and its lean.

    Args:
        pixels: of balls, labelled.
        columns: of the colours that are looked at.
    """
    light = fit_light(pixels.position, pixels.blank[:, columns])
    gel = np.float32(LEANING) * fit_lean(pixels, columns, shown_axes(pixels, columns))
    taught = Taught(
        color=pixels.color[:, columns],
        position=pixels.position,
        slopes=pixels.gradient + pixels.contact[:, None] * lean_at(gel, pixels.position),
        cap=pixels.cap,
        press=pixels.press,
    )
    return taught, light, gel


def collar_of(pixels: Pixels) -> float:
    """How far the gel beside contacts follows, in shares of the frame's shorter side.

    The median press's; NaN where it was fitted to too few.
    """
    first = np.unique(pixels.press, return_index=True)[1]
    fitted = pixels.collar[first][np.isfinite(pixels.collar[first])]
    return float(np.median(fitted)) if len(fitted) >= FEWEST_COLLARS else np.nan


def with_some_collars(pixels: Pixels, share: float, seed: int) -> Int[np.ndarray, " _"]:
    """The pixels, of the gel beside the contacts that share only, drawn by the seed.

    Its slopes are a fit, in a light that scatters from the contact; a rendered skin's are known.
    """
    collar = ~pixels.contact & pixels.gradient.any(1)
    beside = np.flatnonzero(collar)
    drawn = np.random.default_rng([seed, 1]).choice(beside, round(share * len(beside)), False)
    return np.sort(np.concatenate([np.flatnonzero(~collar), drawn]))


def _told(pixels: Pixels, channels: str, seed: int) -> _Told:
    """The dent's slopes and each pixel's scaled inputs, from labels and prepared colours."""
    chosen = channel_indices(channels)
    taught, light, gel = dents(pixels, chosen)
    presses = len(np.unique(pixels.press))
    few = presses <= FEW
    times = times_elsewhere(presses)
    wide = covered_by(pixels) >= COVERED
    ways = UNTOLD[:1] if wide else UNTOLD
    members = MEMBERS_OF_FEW if few else MEMBERS
    for_one = RENDERED_BESIDE_FEW if few else RENDERED
    count = round(for_one * (1 + times) * len(pixels))
    other, unexplained = rendered_pixels(taught, light, collar_of(pixels), count, seed)
    # Squared, as even of a light that is much alike a little is left unexplained.
    kept = with_some_collars(pixels, min(1.0, unexplained / UNLIKE) ** 2, seed)
    around = pixels.color[kept][:, columns_around(chosen)]
    beside = taught[kept]
    own = raw_inputs(beside.color, around, light, beside.position)
    others = raw_inputs(other.color, other.around, light, other.position)
    mean, spread = own.mean(0), np.maximum(own.std(0), 1e-3)
    balls = beside
    if times:
        shading = fit_shading(taught, light)
        untold = np.repeat(ways, times)
        balls, around = here_and_elsewhere(beside, around, light, shading, untold, seed)
    sized = of_other_sizes(around, _sizes(len(around), seed))
    resized = raw_inputs(balls.color, sized, light, balls.position)
    unseen = np.unique(beside.press, return_inverse=True)[1] % LEFT_OUT == 0
    unseen_others = np.arange(len(others)) % LEFT_OUT == 0
    return _Told(
        light=light,
        gel=gel,
        mean=mean,
        spread=spread,
        inputs=(np.concatenate([resized, others]) - mean) / spread,
        slopes=np.concatenate([balls.slopes, other.slopes]),
        of_balls=np.arange(len(resized) + len(others)) < len(resized),
        unseen=np.concatenate([np.tile(unseen, len(resized) // len(unseen)), unseen_others]),
        measured=np.concatenate(
            [np.flatnonzero(unseen), len(resized) + np.flatnonzero(unseen_others)]
        ),
        measured_inputs=(np.concatenate([own[unseen], others[unseen_others]]) - mean) / spread,
        times=times,
        ways=len(ways),
        unlike=unlike(STANDARD, taught, light) if channels == COLORS else None,
        members=members,
        here_alone=members // 2 if wide else 0,
    )


def _sizes(count: int, seed: int) -> Float32[np.ndarray, " n"]:
    """How many times as large the balls of so many pixels are taken to be: half as they are."""
    random = np.random.default_rng([seed, 2])
    smallest, largest = np.log(OTHER_SIZES)
    sizes = np.exp(random.uniform(smallest, largest, count))
    return np.where(random.random(count) < 0.5, sizes, 1).astype(np.float32)


def _choices(told: _Told) -> list[Int[np.ndarray, " _"]]:
    """What each network learns from: some nothing elsewhere, the last nothing that is unseen."""
    # Of balls all, where the presses left out are all there are.
    none_left = not (told.of_balls & ~told.unseen).any()
    elsewhere = [_elsewhere(told, number) for number in range(told.members - told.here_alone)]
    first = elsewhere[0]
    part = first[~told.unseen[first] | (told.of_balls[first] & none_left)]
    return [*(_here(told, number) for number in range(told.here_alone)), *elsewhere, part]


def _elsewhere(told: _Told, number: int) -> Int[np.ndarray, " _"]:
    """Balls where they were pressed and elsewhere, each way in turn, and all rendered things."""
    balls, rendered = np.flatnonzero(told.of_balls), np.flatnonzero(~told.of_balls)
    pressed, *moved = np.split(balls, 1 + told.times * told.ways)
    first = told.times * (number % told.ways)
    return np.concatenate([pressed, *moved[first : first + told.times], rendered])


def _here(told: _Told, number: int) -> Int[np.ndarray, " _"]:
    """Balls where they were pressed, and as many of the rendered for each as everybody has."""
    balls, rendered = np.flatnonzero(told.of_balls), np.flatnonzero(~told.of_balls)
    pressed = balls[: len(balls) // (1 + told.times * told.ways)]
    shared = 1 + told.times
    return np.concatenate([pressed, rendered[number % shared :: shared]])


def _measured_error90(told: _Told, layers: tuple[Layer, ...]) -> Float32[np.ndarray, "k 2"]:
    """The errors' quantiles on what the last network did not see, near each knot of steepness.

    On balls, and on rendered things at slopes that no ball shows; where neither has enough, as at
    the nearest gentler slope.
    """
    slopes = slopes_of(answers(layers, told.members, told.measured_inputs))
    errors = np.abs(slopes - told.slopes[told.measured])
    of_balls = told.of_balls[told.measured]
    by_balls, by_others = (_error90(slopes[some], errors[some]) for some in (of_balls, ~of_balls))
    table = np.where(np.isnan(by_balls), by_others, by_balls)
    known = np.flatnonzero(np.isfinite(table[:, 0]))
    if not len(known):
        return np.tile(np.quantile(errors, 0.9, axis=0), (len(table), 1)).astype(np.float32)
    gentler = np.searchsorted(known, np.arange(len(table)), side="right") - 1
    return table[known[np.maximum(gentler, 0)]]


def _error90(
    slopes: Float32[np.ndarray, "n 2"], errors: Float32[np.ndarray, "n 2"]
) -> Float32[np.ndarray, "k 2"]:
    """The 90 % quantile of errors near each knot of the steepness; NaN near which are too few."""
    steepness = np.linalg.norm(slopes, axis=1)
    nearest = np.abs(steepness[:, None] - SLOPE_KNOTS).argmin(1)
    table = np.full((len(SLOPE_KNOTS), 2), np.nan, np.float32)
    for k in range(len(SLOPE_KNOTS)):
        near = errors[nearest == k]
        if len(near) >= FEWEST_PIXELS:
            table[k] = np.quantile(near, 0.9, axis=0)
    return table
