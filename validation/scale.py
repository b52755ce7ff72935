# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""A set's scale by two rulers: a caliper's jaws in its pictures, and the gel's printed grid.

``python -m validation.scale`` prints both for ``wedge-lab``, in the pixels of its importer's card.
"""

import argparse
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from recon.geometry.caliper import Gap, Scale, find_gap, scale_of, shading_response, slopes_of
from recon.images import read_image
from recon.presses import press_reader
from sensor.arguments import ending_in_a_sentence
from sensor.dataset import read_dataset
from sensor.toml import Pair
from validation.datasets import dataset_folder, shared_folder
from validation.importers.caliper import spread_over

NAME, PICTURES, GAP_MM = "wedge-lab", "calibration/5mm-*.jpg", 5.0


@dataclass(frozen=True, kw_only=True)
class TwoRulers:
    """What the caliper says, and the grid's pitch by it."""

    gaps: tuple[Gap, ...]
    scale: Scale
    grid_px: Pair
    """Pitch of the dots along x and y."""

    @property
    def grid_mm(self) -> Pair:
        """Alike along both axes where the scale is right, as the grid is square."""
        x, y = (px * mm for px, mm in zip(self.grid_px, self.scale.mm_per_px, strict=True))
        return x, y


def measure(folder: Path, pictures: list[Path], gap_mm: float) -> TwoRulers:
    """Measure a marker gel's scale from pictures of a caliper.

    Raises:
        WedgeError: something is missing or damaged, or the caliper is not recognised.
    """
    dataset = read_dataset(folder)
    few = tuple(spread_over(dataset.labels))
    reader = press_reader(replace(dataset, labels=few))
    response = shading_response([reader.read(label) for label in few])
    differences = [reader.unwarp(read_image(path)) - reader.blank for path in pictures]
    found = (find_gap(slopes_of(difference, response)) for difference in differences)
    gaps = tuple(gap for gap in found if gap is not None)
    assert reader.dots is not None
    markers = reader.dots.markers
    cells = np.column_stack([markers.cell, np.ones(len(markers.cell))])
    steps = np.linalg.lstsq(cells, markers.position_px, rcond=None)[0][:2]
    pitch = np.linalg.norm(steps, axis=1)
    first = int(np.abs(steps[:, 0]).argmax())  # whichever cell axis runs along x
    return TwoRulers(
        gaps=gaps,
        scale=scale_of(gaps, gap_mm),
        grid_px=(float(pitch[first]), float(pitch[1 - first])),
    )


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(prog="python -m validation.scale", description=__doc__)
    parser.parse_args()
    pictures = sorted((shared_folder() / NAME).glob(PICTURES))
    with ending_in_a_sentence(parser):
        folder = dataset_folder(NAME)
        rulers = measure(folder, pictures, GAP_MM)
    for gap in rulers.gaps:
        angle = np.degrees(np.arctan2(gap.normal[1], gap.normal[0])) % 180
        print(f"gap {gap.width_px:.2f} px across {angle:.1f} degrees at {np.round(gap.center_px)}")
    card, scale = read_dataset(folder).card, rulers.scale
    size = card.unwarped_size_px or (0, 0)
    rows = zip("xy", scale.mm_per_px, scale.sigma_mm_per_px, size, rulers.grid_mm, strict=True)
    for axis, mm, sigma, pixels, grid_mm in rows:
        print(
            f"{axis}: {mm:.5f} +- {sigma:.5f} mm/px, the pad {mm * pixels:.2f} +- "
            f"{sigma * pixels:.2f} mm, the grid's pitch {grid_mm:.3f} +- "
            f"{grid_mm * sigma / mm:.3f} mm"
        )


if __name__ == "__main__":
    main()
