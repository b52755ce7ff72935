# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Shapes that are no balls: reconstructed by a unit that has seen balls alone, against their truth.

The truth is the skin's own depth, ``truth/NAME.npy``, of a frame that no label names.
"""

from collections.abc import Collection, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from recon.arrays import DepthMap, Difference, Unwarped
from recon.calibration import Calibration
from recon.cloud import expected_error_mm
from recon.images import read_frame
from recon.pipeline import reconstruct
from recon.presses import press_reader
from recon.rendered_presses import depth_files, read_depth
from sensor.dataset import Dataset, read_dataset
from sensor.toml import Pair

TOUCHED = 0.05
"""Share of the deepest true depth from which the skin counts as pressed (``Shape``)."""
DEEPER_THAN_MM = 0.02
"""The same where lights are compared (``rmse_of_deeper_mm``): what they leave of a shape's faint
outskirts is no share of how deep it is."""
_CAPITALS = {"lego": "Lego", "m2": "M2"}


@dataclass(frozen=True, kw_only=True)
class KnownShape:
    """One shape as a camera saw it, and its true depth."""

    name: str
    frame: Unwarped
    difference: Difference
    truth_mm: DepthMap


@dataclass(frozen=True, kw_only=True)
class Shape:
    """One shape as reconstructed."""

    name: str
    frame: Unwarped
    difference: Difference
    depth_mm: DepthMap
    truth_mm: DepthMap
    mm_per_px: Pair
    expected_error_mm: DepthMap | None = None
    """Standard deviation of the depth's error; ``None`` where the estimator does not know any."""

    @property
    def touched(self) -> np.ndarray:
        """Where the skin is pressed, (h, w)."""
        return self.truth_mm > TOUCHED * self.truth_mm.max()

    @property
    def rmse_mm(self) -> float:
        """Root mean square error where the skin is pressed."""
        return float(np.sqrt(np.mean((self.depth_mm - self.truth_mm)[self.touched] ** 2)))

    @property
    def bias_mm(self) -> float:
        """Mean of reconstruction minus truth where the skin is pressed."""
        return float(np.mean((self.depth_mm - self.truth_mm)[self.touched]))

    @property
    def deviations(self) -> float | None:
        """Root mean square of the pressed skin's errors, each by what was expected of it."""
        if self.expected_error_mm is None:
            return None
        off = ((self.depth_mm - self.truth_mm) / self.expected_error_mm)[self.touched]
        return float(np.sqrt(np.mean(off**2)))

    @property
    def peak_error_mm(self) -> float:
        """Reconstruction minus truth at the deepest true pixel."""
        deepest = np.unravel_index(self.truth_mm.argmax(), self.truth_mm.shape)
        return float((self.depth_mm - self.truth_mm)[deepest])


def name_in_words(name: str) -> str:
    """A shape's name as tables and pictures write it: ``m2_screw`` is an M2 screw."""
    return " ".join(_CAPITALS.get(word, word) for word in name.split("_"))


def known_shapes(dataset: Dataset, names: Collection[str] | None = None) -> Iterator[KnownShape]:
    """Every unlabelled frame of a dataset whose depth is known, or those of some names.

    Raises:
        WedgeError: a frame or a truth file cannot be used.
    """
    reader = press_reader(dataset)
    labelled = {Path(label.file).stem for label in dataset.labels}
    for path in depth_files(dataset.folder):
        if path.stem in labelled or (names is not None and path.stem not in names):
            continue
        frame = reader.unwarp(read_frame(dataset.folder, f"{path.stem}.jpg"))
        yield KnownShape(
            name=path.stem,
            frame=frame,
            difference=reader.difference(frame),
            truth_mm=read_depth(path, frame.shape[:2]),
        )


def rmse_of_deeper_mm(depth_mm: DepthMap, truth_mm: DepthMap) -> float:
    """Root mean square error of depth where the true one is more than ``DEEPER_THAN_MM``."""
    error = (depth_mm - truth_mm)[truth_mm > DEEPER_THAN_MM]
    return float(np.sqrt(np.mean(error**2)))


def measure_shapes(folder: Path, unit: Calibration) -> list[Shape]:
    """Reconstruct every unlabelled frame of a dataset whose depth is known.

    Args:
        folder: of the dataset.
        unit: calibrated on its ball presses.

    Raises:
        WedgeError: a frame or a truth file cannot be used.
    """
    dataset = read_dataset(folder)
    shapes = []
    for known in known_shapes(dataset):
        found = reconstruct(
            known.difference,
            unit.estimator,
            missing=unit.card.missing_axis,
            lights_deg=unit.card.lights_deg,
            mm_per_px=dataset.card.mm_per_px,
        )
        shapes.append(
            Shape(
                name=known.name,
                frame=known.frame,
                difference=known.difference,
                depth_mm=found.depth_mm,
                truth_mm=known.truth_mm,
                mm_per_px=dataset.card.mm_per_px,
                expected_error_mm=None if found.slope_error is None else expected_error_mm(found),
            )
        )
    return shapes
