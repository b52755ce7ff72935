# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""A unit's depth errors on the shapes of a data set: frames without a circle, of known depth."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from recon.calibration import Calibration
from recon.labels.label_book import pressed_frames
from recon.presses import LeftOut, press_reader
from sensor.dataset import Dataset
from validation.acceptance.moved import moved_px
from validation.depth import DepthErrors, truth_file
from validation.drift import Number, Pairing, depth_numbers
from validation.evaluation import colors_lit_otherwise, refuse_other_sensor
from validation.shapes import Shape, reconstructed_shapes, shape_files

UNKNOWN = "neither a circle nor a truth file says how deep it is"


@dataclass(frozen=True, kw_only=True)
class ShapeErrors(Pairing):
    """One unit on the shapes of one data set."""

    estimator: str
    seed: int
    """Of the intervals."""
    depth: tuple[DepthErrors, ...]
    """Where the skin is pressed, as ``Shape`` says."""
    numbers: Mapping[str, Number]
    """``depth_rmse_mm`` and ``depth_bias_mm``."""
    left_out: tuple[LeftOut, ...]
    """Frames of unknown depth."""


def judge_shapes(
    calibration: Calibration,
    dataset: Dataset,
    *,
    seed: int,
    called: str,
    progress: Callable[[float], None] = lambda _: None,
) -> ShapeErrors:
    """Measure a unit's depth on every shape of a data set that has some.

    Args:
        calibration: the unit.
        dataset: with truth files of frames that no label names.
        seed: of the intervals.
        called: what to call the set.
        progress: called with the share that is done.

    Raises:
        WedgeError: a frame or a truth file cannot be used, or the set comes from another sensor.
    """
    reader, card = press_reader(dataset), calibration.card
    refuse_other_sensor(calibration, dataset, reader)
    count, depth = len(shape_files(dataset)), []
    for shape in reconstructed_shapes(dataset, calibration):
        depth.append(errors_of(shape))
        progress(len(depth) / count)
    before, now = map(calibration.unwarp, (calibration.background, reader.background))
    return ShapeErrors(
        unit=card.serial,
        dataset=called,
        estimator=calibration.estimator.name,
        seed=seed,
        depth=tuple(depth),
        numbers=depth_numbers(depth, seed),
        left_out=tuple(
            LeftOut(file=name, reason=UNKNOWN)
            for name in pressed_frames(dataset.folder, dataset.card)
            if dataset.label(name) is None and not truth_file(dataset.folder, name).is_file()
        ),
        moved_px=moved_px(before, now),
        lit_otherwise=colors_lit_otherwise(card, dataset.card),
    )


def errors_of(shape: Shape) -> DepthErrors:
    """The errors of one shape; the peak is where it is deepest."""
    peak_mm = float(shape.truth_mm.max())
    return DepthErrors(
        file=shape.file,
        truth="truth file",
        rmse_mm=shape.rmse_mm,
        bias_mm=shape.bias_mm,
        peak_mm=peak_mm + shape.peak_error_mm,
        peak_truth_mm=peak_mm,
    )
