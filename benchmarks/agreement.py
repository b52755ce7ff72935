# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""How far the compiled reconstruction by ``default`` is from the reference, by the frame's size.

    python -m benchmarks.agreement twin-standard twin-finger

A unit is calibrated on all presses of a rendered set; six of them and all shapes are made smaller,
and reconstructed both ways. Depth is off by so much of the frame's peak, at most.
"""

import argparse
from dataclasses import replace

import cv2
import numpy as np

from recon.arrays import Frame
from recon.calibration import Calibration, unit_of_set
from recon.fast import FastReconstructor
from recon.images import read_frame
from recon.pipeline import Reconstructor
from sensor.arguments import ending_in_a_sentence
from sensor.dataset import read_dataset
from validation.datasets import dataset_folder

SIZES_PX = ((320, 240), (200, 150), (160, 120), (97, 83), (64, 48))
PRESSES = 6


def taught(name: str) -> tuple[Calibration, list[Frame]]:
    """A unit of a rendered set, and frames of its presses and shapes."""
    folder = dataset_folder(name)
    dataset = read_dataset(folder)
    unit = unit_of_set(dataset, "default")
    files = [label.file for label in dataset.labels[:PRESSES]]
    files += [f"{path.stem}.jpg" for path in sorted((folder / "truth").glob("*.npy"))]
    return unit, [read_frame(folder, file) for file in files]


def smaller(unit: Calibration, size_px: tuple[int, int]) -> Calibration:
    """The same unit, of frames of another (width, height)."""
    card = unit.card
    pitch_x, pitch_y = (
        pitch_mm * own / other
        for pitch_mm, own, other in zip(card.mm_per_px, card.size_px, size_px, strict=True)
    )
    card = replace(card, frame_size_px=size_px, size_px=size_px, mm_per_px=(pitch_x, pitch_y))
    return replace(unit, background=resized(unit.background, size_px), card=card)


def resized(frame: Frame, size_px: tuple[int, int]) -> Frame:
    """A frame of another (width, height)."""
    return np.asarray(cv2.resize(frame, size_px, interpolation=cv2.INTER_AREA), np.uint8)


def depth_off(unit: Calibration, frames: list[Frame]) -> list[float]:
    """Largest difference of depth from the reference, of its peak, frame by frame."""
    reference, fast = Reconstructor(unit), FastReconstructor(unit)
    found = []
    for frame in frames:
        truth_mm = reference(frame).depth_mm
        found.append(float(np.abs(fast(frame).depth_mm - truth_mm).max() / truth_mm.max()))
    return found


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.agreement", description=__doc__)
    parser.add_argument("datasets", nargs="+", help="rendered sets, such as twin-standard")
    options = parser.parse_args()
    with ending_in_a_sentence(parser):
        for name in options.datasets:
            unit, frames = taught(name)
            for size_px in SIZES_PX:
                off = depth_off(smaller(unit, size_px), [resized(f, size_px) for f in frames])
                print(
                    f"{name}, {size_px[0]}x{size_px[1]}: depth off by {np.median(off):.2%} of its "
                    f"peak, {max(off):.2%} at most (n {len(off)})"
                )


if __name__ == "__main__":
    main()
