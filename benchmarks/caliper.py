# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""The pad that a caliper measures on rendered sensors of known size, and balls taken for its jaws.

    python -m benchmarks.caliper

Jaws 5 mm apart are pressed into the middle of each design's pad, and of a finger's with fewer
lights, twice along and twice across, and balls beside. Raw frames are traced, and read as ``wedge
calibrate FOLDER`` reads them, by a pad that is assumed to be the design's own and by one that is
assumed to be the standard's. Then every ball press of the known sets is looked at as if it were
named as a caliper's.
"""

import argparse
import multiprocessing
import os
import sys
import tempfile
from collections.abc import Iterator
from concurrent.futures import Executor, ProcessPoolExecutor
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Final

import numpy as np

from recon.geometry.caliper import find_gap, shading_response, slopes_of
from recon.presses import read_presses
from sensor.arguments import ending_in_a_sentence
from sensor.dataset import LENS_FILE, read_dataset
from sensor.design import FINGER, STANDARD, Wedge
from sensor.toml import Pair
from simulation.dataset import Recipe, write_set
from simulation.engine import best_engine
from simulation.indenters import CALIBRATION_BALL_MM, Indenter, calibration_ball
from simulation.presses import Press, ball_presses
from simulation.skin import gel_view
from validation.datasets import dataset_folder
from validation.importers.caliper import spread_over
from validation.importers.raw_frames import import_raw_frames

DESIGNS: Final = (STANDARD, FINGER)
FEW_LIGHTS: Final = (
    replace(FINGER, name="finger, red and blue", lights=replace(FINGER.lights, green_base_leds=0)),
    replace(
        FINGER,
        name="finger, red",
        lights=replace(FINGER.lights, green_base_leds=0, blue_side_leds=0),
    ),
)
BALL_SETS: Final = ("taxim-gelsight", "known-depth", "wedge-lab", "twin-standard", "twin-finger")
GAP_MM: Final = 5.0
JAW_MM: Final = 2.0
HALF_WIDTH_MM: Final = 3.0
DEPTH_MM: Final = 0.4
BESIDE_MM: Final = (0.0, 1.5)
"""Along x from the pad's middle, of both pictures of each direction."""
BALLS, SAMPLES, SEED = 12, 48, 0


def caliper_presses(design: Wedge) -> list[Press]:
    """Jaws in the middle of the pad, named as a caliper's pictures are."""
    half_px_mm = gel_view(design, Recipe.width_px).mm_per_px[0] / 2
    presses = []
    for along_x in (True, False):
        for number, x_mm in enumerate(BESIDE_MM, start=1):
            length_mm, width_mm = GAP_MM + 2 * JAW_MM, 2 * HALF_WIDTH_MM
            jaws = Indenter(
                name="jaws",
                profile=partial(_jaws, along_x=along_x, half_px_mm=half_px_mm),
                size_mm=(length_mm, width_mm) if along_x else (width_mm, length_mm),
                depth_mm=DEPTH_MM,
            )
            name = f"{GAP_MM:g}mm-{'x' if along_x else 'y'}{number}"
            presses.append(
                Press(name=name, indenter=jaws, center_mm=(x_mm, 0.0), depth_mm=DEPTH_MM)
            )
    return presses


def _jaws(x: np.ndarray, y: np.ndarray, *, along_x: bool, half_px_mm: float) -> np.ndarray:
    """Two flat jaws; their first pixels are wholly pressed, so they begin half a pixel before."""
    across, along = (np.abs(x), np.abs(y)) if along_x else (np.abs(y), np.abs(x))
    inside = (across > GAP_MM / 2 - half_px_mm) & (across < GAP_MM / 2 + JAW_MM)
    return np.where(inside & (along < HALF_WIDTH_MM), 0.0, np.inf)


def render(folder: Path, design: Wedge, executor: Executor) -> None:
    """Raw frames of the caliper, of balls and of blank gel, named as a person would."""
    recipe = Recipe(engine=best_engine(), design=design, samples=SAMPLES, seed=SEED, raw=True)
    balls = ball_presses(design, calibration_ball(), BALLS, SEED)
    write_set(
        folder,
        recipe,
        [*balls, *caliper_presses(design)],
        source=f"a caliper on the {design.name} design",
        executor=executor,
        progress=lambda share, what: print(f"{share:4.0%} {what}", file=sys.stderr, flush=True),
    )
    (folder / LENS_FILE).unlink()  # nobody has measured this lens


def measured_pad(frames: Path, assumed_mm: Pair, executor: Executor) -> tuple[Pair, int, int]:
    """The pad by the caliper's pictures, in how many the jaws were seen, and how many there are.

    Raises:
        WedgeError: the pictures tell no scale.
    """
    with tempfile.TemporaryDirectory() as made:
        prepared = import_raw_frames(
            frames,
            Path(made) / "set",
            executor,
            ball_radius_mm=CALIBRATION_BALL_MM,
            pad_size_mm=assumed_mm,
        )
    pad_mm, scale = prepared.card.pad_size_mm, prepared.scale
    assert pad_mm is not None
    assert scale is not None
    return pad_mm, scale.gaps, prepared.caliper


def balls_with_gap(name: str) -> tuple[int, int]:
    """How many ball presses of a set would pass for a caliper's jaws, and how many it has."""
    presses = read_presses(read_dataset(dataset_folder(name))).presses
    response = shading_response(spread_over(presses))
    found = [find_gap(slopes_of(press.difference, response)) for press in presses]
    return sum(gap is not None for gap in found), len(found)


def rows() -> Iterator[str]:
    """Line after line of what was measured."""
    os.environ.setdefault("OMP_NUM_THREADS", "1")
    with ProcessPoolExecutor(2, multiprocessing.get_context("spawn")) as executor:
        for design in (*DESIGNS, *FEW_LIGHTS):
            with tempfile.TemporaryDirectory() as folder:
                render(Path(folder), design, executor)
                for assumed in {one.name: one for one in (design, STANDARD)}.values():
                    pad, seen, of = measured_pad(Path(folder), assumed.pad_size_mm, executor)
                    yield (
                        f"{design.name}, {design.pad_size_mm[0]:g} x {design.pad_size_mm[1]:g} mm, "
                        f"pad assumed as of {assumed.name}: {pad[0]:.2f} x {pad[1]:.2f} "
                        f"mm by {seen} of {of} pictures"
                    )
    for name in BALL_SETS:
        taken, presses = balls_with_gap(name)
        yield f"{name}: {taken} of {presses} balls would pass for jaws"


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.caliper", description=__doc__)
    parser.parse_args()
    with ending_in_a_sentence(parser):
        for row in rows():
            print(row, flush=True)


if __name__ == "__main__":
    main()
