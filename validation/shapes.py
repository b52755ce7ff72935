# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Shapes that are no balls: reconstructed by a unit that has seen balls alone, against their truth.

The truth is the skin's own depth, ``truth/NAME.npy``, of a frame that no label names.
"""

from collections.abc import Collection, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from recon.arrays import ContactMask, DepthMap, Difference, Unwarped
from recon.calibration import Calibration
from recon.cloud import expected_error_mm
from recon.images import read_frame
from recon.labels.label_book import pressed_frames
from recon.pipeline import reconstruct
from recon.presses import press_reader
from recon.rendered_presses import depth_files, read_depth
from sensor.dataset import Dataset, read_dataset
from sensor.errors import WedgeError
from sensor.toml import Pair
from validation.depth import truth_file
from validation.evaluation import light_beside

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
    file: str
    """Of the frame."""
    frame: Unwarped
    difference: Difference
    hidden: ContactMask | None
    """Where dots hid the colour, of a marker gel."""
    truth_mm: DepthMap


@dataclass(frozen=True, kw_only=True)
class Shape:
    """One shape as reconstructed."""

    name: str
    file: str
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


def shape_files(dataset: Dataset) -> list[Path]:
    """The true depths of frames that no label names, in the order of their names."""
    labelled = {truth_file(dataset.folder, label.file) for label in dataset.labels}
    return [path for path in depth_files(dataset.folder) if path not in labelled]


def known_shapes(dataset: Dataset, names: Collection[str] | None = None) -> Iterator[KnownShape]:
    """Every unlabelled frame of a dataset whose depth is known, or those of some names.

    Raises:
        WedgeError: a frame or a truth file cannot be used, or a truth file has no frame.
    """
    reader = press_reader(dataset)
    frames = pressed_frames(dataset.folder, dataset.card)
    frame_of = {truth_file(dataset.folder, name): name for name in frames}
    for path in shape_files(dataset):
        if names is not None and path.stem not in names:
            continue
        file = frame_of.get(path)
        if file is None:
            raise WedgeError(
                f"{path} is the depth of a frame that is missing: copy it or remove both."
            )
        frame = reader.unwarped(file, read_frame(dataset.folder, file))
        seen = reader.seen(frame)
        yield KnownShape(
            name=path.stem,
            file=file,
            frame=frame,
            difference=seen.difference,
            hidden=seen.hidden,
            truth_mm=read_depth(path, frame.shape[:2], dataset.card.mm_per_px),
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
    return list(reconstructed_shapes(read_dataset(folder), unit))


def reconstructed_shapes(dataset: Dataset, unit: Calibration) -> Iterator[Shape]:
    """The same one at a time, of a dataset that was read, in the light of the unit's calibration.

    Raises:
        WedgeError: a frame or a truth file cannot be used.
    """
    light = light_beside(unit, press_reader(dataset).blank)
    for known in known_shapes(dataset):
        found = reconstruct(
            known.difference / light,
            unit.estimator,
            missing=unit.card.missing_axis,
            lights_deg=unit.card.lights_deg,
            mm_per_px=dataset.card.mm_per_px,
            hidden=known.hidden,
        )
        yield Shape(
            name=known.name,
            file=known.file,
            frame=known.frame,
            difference=known.difference,
            depth_mm=found.depth_mm,
            truth_mm=known.truth_mm,
            mm_per_px=dataset.card.mm_per_px,
            expected_error_mm=None if found.slope_error is None else expected_error_mm(found),
        )
