# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Time of the digital twin: one frame with each engine, and forty presses."""

import time
from collections.abc import Iterator, Sequence
from concurrent.futures import Executor
from dataclasses import replace

import numpy as np

from benchmarks.measurement import Measurement
from sensor.design import STANDARD
from simulation.dataset import Recipe, presses_of, trace_press
from simulation.engine import SCALAR, Engine, best_engine
from simulation.presses import Press
from simulation.render import render
from simulation.skin import gel_view

PRESSES = 40
TIMED = 2
"""Presses that are rendered; the rest take as long."""


def measure(executor: Executor) -> Iterator[Measurement]:
    """Each figure, measured in fresh processes."""
    best = executor.submit(best_engine).result()
    for engine, bar in {SCALAR: 15.0, best: 5.0 if best != SCALAR else 15.0}.items():
        yield Measurement(
            name=f"one 320x240 view of the gel, 64 samples, {engine.variant}",
            value=executor.submit(frame_s, engine).result(),
            unit="s",
            bar=bar,
        )
    recipe = Recipe(engine=best, design=STANDARD)
    presses = presses_of(STANDARD, "balls", count=TIMED, seed=0)
    _trace(executor, replace(recipe, samples=1), presses)  # workers start
    start = time.perf_counter()
    _trace(executor, recipe, presses)
    yield Measurement(
        name=f"{PRESSES} ball presses at {recipe.samples} samples, {best.variant}, from {TIMED}",
        value=(time.perf_counter() - start) * PRESSES / TIMED,
        unit="s",
        bar=900,
    )


def _trace(executor: Executor, recipe: Recipe, presses: Sequence[Press]) -> None:
    for future in [executor.submit(trace_press, recipe, press) for press in presses]:
        future.result()


def frame_s(engine: Engine) -> float:
    """Seconds that one frame takes once the engine is warm."""
    view = gel_view(STANDARD, 320)
    rest = np.zeros(view.size_px[::-1])
    render(engine, STANDARD, view, rest, samples=1, seed=0)
    start = time.perf_counter()
    render(engine, STANDARD, view, rest, samples=64, seed=0)
    return time.perf_counter() - start
