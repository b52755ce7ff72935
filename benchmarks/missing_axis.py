# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""The missing gradient axis: what infers it, how well on balls nobody trained on, how quickly."""

from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Executor
from time import perf_counter

import numpy as np
from jaxtyping import Float

from benchmarks.measurement import Measurement, interleaved_ms
from recon.integration.pressed import nearest_pressed
from recon.missing_axis.baselines import by_columns, by_convex_fit
from recon.missing_axis.inference import infer_missing_axis
from recon.training.random_balls import SQUARE, random_ball
from recon.training.random_surfaces import RECIPES, surface_set

SIZE_PX = (320, 240)
SLOPE_NOISE = 0.04
BALLS = 12
SURFACES = 1000
SURFACE_PX = (96, 128)
BAR_MS = 15.0
"""Of one frame of 320x240 on one core."""

Slopes = Float[np.ndarray, "h w"]
Answer = Callable[[Slopes], Slopes]

ANSWERS: dict[str, Answer] = {
    "column-wise integral": lambda known: by_columns(known, "x", SQUARE)[..., 0],
    "convex fit": lambda known: by_convex_fit(known, "x", SQUARE)[..., 0],
    "network": lambda known: infer_missing_axis(known, "x", SQUARE).gradient[..., 0],
}
"""What stands in for the x gradient, from the y gradient."""


def shares_of_zeros_error(answers: Sequence[Answer]) -> list[float]:
    """Mean absolute error of each answer over that of zero, on random balls in 320x240.

    Pixels of the error table: inside the contact, and 5 % of those beyond 1.3 contact radii.
    """
    rng = np.random.default_rng(0)
    errors, zero = np.zeros(len(answers)), 0.0
    for _ in range(BALLS):
        ball = random_ball(rng, SIZE_PX)
        truth = ball.gradient
        known = truth[..., 1] + SLOPE_NOISE * rng.standard_normal(truth.shape[:2])
        chosen = ball.judged(rng)
        zero += float(np.abs(truth[..., 0])[chosen].sum())
        for index, answer in enumerate(answers):
            errors[index] += np.abs(answer(known) - truth[..., 0])[chosen].sum()
    return [float(error / zero) for error in errors]


def measure() -> Iterator[Measurement]:
    """Errors of every answer, and the time that the network takes."""
    shares = shares_of_zeros_error(list(ANSWERS.values()))
    for name, share in zip(ANSWERS, shares, strict=True):
        yield Measurement(
            name=f"missing axis by {name}, {BALLS} balls, slope noise {SLOPE_NOISE}",
            value=share,
            unit="of the error of zero",
            bar=0.2 if name == "network" else None,
        )
    known = SLOPE_NOISE * np.random.default_rng(0).standard_normal(SIZE_PX[::-1])
    product = np.random.default_rng(1).random((512, 512), np.float32)
    free = 0.1 * np.random.default_rng(2).standard_normal(SIZE_PX[::-1]).astype(np.float32)
    everywhere = np.ones(free.shape, bool)
    network_ms, pressed_ms, product_ms = interleaved_ms(
        [
            lambda: infer_missing_axis(known, "x", SQUARE),
            lambda: nearest_pressed(free, everywhere, SQUARE, "dirichlet"),
            lambda: product @ product,
        ],
        rounds=15,
    )
    yield Measurement(
        name=f"missing axis by network, {SIZE_PX[0]}x{SIZE_PX[1]}, one core; beside it a product of"
        f" 512x512 matrices took {product_ms:.1f} ms",
        value=network_ms,
        unit="ms",
        bar=BAR_MS,
    )
    yield Measurement(
        name=f"depth made nowhere negative, {SIZE_PX[0]}x{SIZE_PX[1]}, one core",
        value=pressed_ms,
        unit="ms",
    )


def measure_surfaces(executor: Executor) -> Iterator[Measurement]:
    """Time of ten thousand random surfaces, from a tenth of them."""
    for recipe in RECIPES:
        begin = perf_counter()
        surface_set(recipe, SURFACES, SURFACE_PX, 0, executor)
        yield Measurement(
            name=f"ten thousand surfaces, recipe {recipe}, {SURFACE_PX[1]}x{SURFACE_PX[0]}, from"
            f" {SURFACES} on two cores",
            value=(perf_counter() - begin) * 10_000 / SURFACES,
            unit="s",
            bar=120,
        )
