# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""How far the dents of the twins' balls are from the balls' caps, as gel on a dome leans.

    python -m benchmarks.dents

Per design: the RMSE in mm between cap and true skin in the contact, less the mean at its rim, as
depth of balls is judged; and the same if the lean that ``default`` finds in the twin's frames is
taken off the skin first. Nothing is rendered.
"""

import argparse

import numpy as np

from recon.ball import ball_cap, offsets_mm
from recon.estimators import lesson_of
from recon.estimators.default_fit import LEANING, dents
from recon.estimators.lean import Lean
from recon.presses import read_presses
from sensor.arguments import ending_in_a_sentence
from sensor.dataset import read_dataset
from sensor.design import FINGER, STANDARD, Wedge
from sensor.toml import Pair
from simulation.dataset import Recipe, dent_of, presses_of
from simulation.engine import SCALAR
from simulation.indenters import CALIBRATION_BALL_MM
from validation.datasets import dataset_folder
from validation.depth import RIM_WIDTH_PX

PRESSES, SEED = 40, 0
COLORS = [0, 1, 2]


def found_lean(design: Wedge) -> Lean:
    """The lean of a design's gel, as the balls of its twin tell."""
    presses = read_presses(read_dataset(dataset_folder(f"twin-{design.name}"))).presses
    pixels = lesson_of("default", presses, range(len(presses)), SEED)
    return np.asarray(dents(pixels, COLORS)[2] / np.float32(LEANING))


def rise_mm(lean: Lean, size_px: tuple[int, int], mm_per_px: Pair) -> np.ndarray:
    """The depth (h, w) whose slopes are a lean's, zero in the middle."""
    along = []
    for (level, more), count, pitch in zip(lean, size_px, mm_per_px, strict=True):
        half = (count - 1) / 2
        place = (np.arange(count) - half) / half
        along.append(half * pitch * (level * place + more * place**2 / 2))
    return np.asarray(along[0][None, :] + along[1][:, None])


def from_cap_mm(design: Wedge) -> tuple[float, float]:
    """Mean RMSE of the skin as it is, and with the found lean taken off."""
    recipe = Recipe(engine=SCALAR, design=design)
    size_px, pitch = recipe.view.size_px, recipe.view.mm_per_px
    lean_mm = rise_mm(found_lean(design), size_px, pitch)
    found = []
    for press in presses_of(design, "balls", count=PRESSES, seed=SEED):
        dent = dent_of(recipe, press)
        assert dent.circle_px is not None
        *center_px, radius_px = dent.circle_px
        at = (center_px[0], center_px[1])
        cap = ball_cap(size_px, at, radius_px * pitch[0], CALIBRATION_BALL_MM, pitch)
        away_mm = np.hypot(*offsets_mm(size_px, at, pitch))
        rim = cap.contact & (away_mm > (radius_px - RIM_WIDTH_PX) * pitch[0])
        off = [skin - cap.depth_mm for skin in (dent.truth_mm, dent.truth_mm - lean_mm)]
        found.append(
            [np.sqrt(np.mean((each - each[rim].mean())[cap.contact] ** 2)) for each in off]
        )
    as_it_is, without = np.mean(found, axis=0)
    return float(as_it_is), float(without)


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.dents", description=__doc__)
    parser.parse_args()
    with ending_in_a_sentence(parser):
        for design in (STANDARD, FINGER):
            as_it_is, without = from_cap_mm(design)
            print(f"{design.name}: {as_it_is:.4f} mm, with the lean taken off {without:.4f} mm")


if __name__ == "__main__":
    main()
