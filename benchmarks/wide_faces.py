# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Flat plates pressed on the middle of a rendered pad, up to as wide as it.

    python -m benchmarks.wide_faces UNIT standard

Per plate: its length and width as shares of the pad's, how deep it was pressed in, what share of
the gel is dented and found to be disturbed, the deepest true and measured point, and the depth RMSE
in mm where the truth is deeper than 0.02 mm.
"""

import argparse
import sys
import tempfile
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from multiprocessing import get_context
from pathlib import Path

import numpy as np

from recon.calibration import Calibration, load_calibration
from recon.pipeline import reconstruct
from sensor.arguments import ending_in_a_sentence
from sensor.dataset import read_dataset
from sensor.design import FINGER, STANDARD, Wedge
from simulation.dataset import Recipe, write_set
from simulation.engine import best_engine
from simulation.indenters import Indenter
from simulation.presses import Press
from validation.shapes import DEEPER_THAN_MM, KnownShape, known_shapes, rmse_of_deeper_mm

PLATES = (
    (0.5, 0.5, 0.4),
    (0.65, 0.65, 0.4),
    (0.65, 0.65, 0.8),
    (0.77, 0.86, 0.6),
    (0.77, 0.86, 1.0),
    (0.95, 0.4, 0.5),
    (0.3, 0.95, 0.5),
    (0.95, 0.95, 0.6),
)
"""Shares of the pad's length and width, and depth in mm below its middle."""
SAMPLES = 64


def plates(design: Wedge) -> list[Press]:
    """The presses of a design."""
    pressed = []
    for number, (along, across, depth_mm) in enumerate(PLATES):
        size_mm = along * design.pad_size_mm[0], across * design.pad_size_mm[1]
        plate = Indenter(
            name="plate",
            profile=partial(_plate, size_mm=size_mm),
            size_mm=size_mm,
            depth_mm=depth_mm,
        )
        pressed.append(
            Press(name=f"plate_{number}", indenter=plate, center_mm=(0.0, 0.0), depth_mm=depth_mm)
        )
    return pressed


def _plate(x: np.ndarray, y: np.ndarray, *, size_mm: tuple[float, float]) -> np.ndarray:
    inside = (np.abs(x) < size_mm[0] / 2) & (np.abs(y) < size_mm[1] / 2)
    return np.where(inside, 0.0, np.inf)


def render(folder: Path, design: Wedge) -> None:
    """Frames of all plates, and their true depth."""
    recipe = Recipe(engine=best_engine(), design=design, samples=SAMPLES)
    with ProcessPoolExecutor(2, get_context("spawn")) as executor:
        write_set(
            folder,
            recipe,
            plates(design),
            source=f"plates on the {design.name} design",
            executor=executor,
            progress=lambda share, what: print(f"{share:4.0%} {what}", file=sys.stderr, flush=True),
        )


def row(unit: Calibration, plate: KnownShape) -> str:
    """One plate, as measured."""
    along, across, depth_mm = PLATES[int(plate.name.removeprefix("plate_"))]
    found = reconstruct(
        plate.difference,
        unit.estimator,
        missing=unit.card.missing_axis,
        lights_deg=unit.card.lights_deg,
        mm_per_px=unit.card.mm_per_px,
    )
    dented = (plate.truth_mm > DEEPER_THAN_MM).mean()
    return (
        f"{along:>6.2f}{across:>7.2f}{depth_mm:>7.1f}{dented:>8.2f}{found.disturbed.mean():>7.2f}"
        f"{plate.truth_mm.max():>7.2f}{found.depth_mm.max():>10.2f}"
        f"{rmse_of_deeper_mm(found.depth_mm, plate.truth_mm):>8.3f}"
    )


def main() -> None:
    """Render, measure and print."""
    designs = {design.name: design for design in (STANDARD, FINGER)}
    parser = argparse.ArgumentParser(prog="python -m benchmarks.wide_faces", description=__doc__)
    parser.add_argument("unit", type=Path, help="calibrated on that design's twin")
    parser.add_argument("design", choices=designs)
    asked = parser.parse_args()
    with ending_in_a_sentence(parser), tempfile.TemporaryDirectory() as made:
        unit = load_calibration(asked.unit)
        folder = Path(made) / "plates"
        folder.mkdir()
        render(folder, designs[asked.design])
        print(
            f"{'long':>6}{'wide':>7}{'press':>7}{'dented':>8}{'found':>7}{'truth':>7}{'measured':>10}"
            f"{'RMSE':>8}"
        )
        for plate in known_shapes(read_dataset(folder)):
            print(row(unit, plate), flush=True)


if __name__ == "__main__":
    main()
