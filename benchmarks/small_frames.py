# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Disturbed gel in frames of few pixels: what is found of that in whole frames, and on blank gel.

    python -m benchmarks.small_frames twin-standard twin-finger wedge-lab taxim-gelsight

Shapes and every fourth press of each set, averaged to about 160, 107 and 80 columns. Per set and
size: the mean and the least overlap (intersection over union) with the mask of the whole frame,
averaged to the same size, and how many of ``--blanks`` noisy blank frames show a contact.
"""

import argparse

import cv2
import numpy as np

from recon.arrays import Difference, Frame
from recon.contact.disturbed import disturbed_mask
from recon.presses import press_reader, read_presses
from sensor.dataset import Dataset, read_dataset
from validation.contact import blank_images, iou
from validation.datasets import dataset_folder
from validation.shapes import known_shapes

COLUMNS = (160, 107, 80)
PRESSES_EVERY = 4


def averaged(image: np.ndarray, columns: int) -> np.ndarray:
    """An image of fewer pixels, each the mean of those that it covers."""
    height, width = image.shape[:2]
    size_px = (columns, round(height * columns / width))
    return np.ascontiguousarray(cv2.resize(image, size_px, interpolation=cv2.INTER_AREA))


def overlaps(differences: list[Difference], columns: int) -> list[float]:
    """Of the masks of small frames with those of whole ones."""
    found = []
    for difference in differences:
        whole = averaged(disturbed_mask(difference).astype(np.float32), columns) > 0.5
        found.append(iou(disturbed_mask(averaged(difference, columns)), whole))
    return found


def blanks_in_contact(background: Frame, count: int) -> int:
    """How many of so many noisy blank frames are taken for a contact."""
    pairs = blank_images(background, lambda frame: frame.astype(np.float32) / 255, count)
    return sum(bool(disturbed_mask(image - blank).any()) for image, blank in pairs)


def touched(dataset: Dataset) -> list[Difference]:
    """Its shapes and some of its presses."""
    shapes = [shape.difference for shape in known_shapes(dataset)]
    presses = read_presses(dataset).presses[::PRESSES_EVERY]
    return [*shapes, *(press.difference for press in presses)]


def main() -> None:
    """Print a table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("dataset", nargs="+")
    parser.add_argument("--blanks", type=int, default=1000)
    asked = parser.parse_args()
    print(f"{'dataset':16}{'columns':>9}{'frames':>8}{'mean':>7}{'least':>7}{'blank':>12}")
    means: dict[int, list[float]] = {columns: [] for columns in COLUMNS}
    for name in asked.dataset:
        dataset = read_dataset(dataset_folder(name))
        differences, background = touched(dataset), press_reader(dataset).background
        for columns in COLUMNS:
            found = overlaps(differences, columns)
            means[columns].append(float(np.mean(found)))
            wrong = blanks_in_contact(averaged(background, columns), asked.blanks)
            print(
                f"{name:16}{columns:>9}{len(found):>8}{means[columns][-1]:>7.2f}"
                f"{min(found):>7.2f}{wrong:>6} of {asked.blanks}",
                flush=True,
            )
    for columns in COLUMNS:
        print(f"{'mean of sets':16}{columns:>9}{np.mean(means[columns]):>15.3f}")


if __name__ == "__main__":
    main()
