# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Presses in brighter and darker light than the blank frame's: how much depth error is taken off.

    python -m benchmarks.other_light UNIT DATASET

All levels of the frames are multiplied by a factor and rounded, and saturate as a camera's would.
Per factor: the mean depth RMSE of the set's ball presses as the frames are, and brought back to the
blank frame's light. The unit may have learnt from them: rows are to be compared with each other.
The last line says of how many of the frames as they are a change of light is told.
"""

import argparse
from dataclasses import replace
from pathlib import Path

import numpy as np

from recon.arrays import DepthMap, Difference, Unwarped
from recon.calibration import Calibration, load_calibration
from recon.pixels import BallPress
from recon.presses import press_reader, read_presses
from recon.same_light import in_same_light
from sensor.arguments import ending_in_a_sentence
from sensor.dataset import read_dataset
from validation.datasets import dataset_folder
from validation.depth import depth_errors
from validation.reconstructed import reconstruct_press

FACTORS = (0.75, 0.9, 0.97, 1.0, 1.03, 1.1, 1.25)


def in_other_light(press: BallPress, blank: Unwarped, factor: float) -> Difference:
    """The difference image of a press in light that many times as bright."""
    levels = np.rint(255 * factor * (press.difference + blank)).clip(0, 255)
    return (levels / 255 - blank).astype(np.float32)


def depth_mm_of(unit: Calibration, press: BallPress, difference: Difference) -> DepthMap:
    """Depth by the unit."""
    seen = replace(press, difference=difference)
    card = unit.card
    return reconstruct_press(seen, unit.estimator, card.missing_axis, card.lights_deg).depth_mm


def measure(folder: Path, name: str) -> None:
    """Print row after row.

    Raises:
        WedgeError: unit or dataset cannot be read.
    """
    unit, dataset = load_calibration(folder), read_dataset(dataset_folder(name))
    presses, blank = read_presses(dataset).presses, press_reader(dataset).blank
    print(f"{'factor':>6}{'as it is':>10}{'taken off':>11}   (RMSE in mm, {len(presses)} presses)")
    for factor in FACTORS:
        found = []
        for press in presses:
            difference = in_other_light(press, blank, factor)
            found.append(
                [
                    depth_errors(depth_mm_of(unit, press, seen), press, dataset.folder).rmse_mm
                    for seen in (difference, in_same_light(difference, blank))
                ]
            )
        before, after = np.mean(found, axis=0)
        print(f"{factor:>6.2f}{before:>10.3f}{after:>11.3f}", flush=True)
    told = sum(in_same_light(one.difference, blank) is not one.difference for one in presses)
    print(f"a change of light is told of {told} of {len(presses)} frames as they are")


def main() -> None:
    """Print a table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("unit", type=Path)
    parser.add_argument("dataset")
    asked = parser.parse_args()
    with ending_in_a_sentence(parser):
        measure(asked.unit, asked.dataset)


if __name__ == "__main__":
    main()
