# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""The error table per light configuration, as the paper's Table I, split by press.

A configuration is a set of lights, that is, of colour channels. Where the lights sit as the
Wedge's do, the rows are the paper's six; for other sensors, every subset of the lit channels, and
where these leave an axis unseen, without and with the network.
"""

from collections.abc import Callable, Collection, Mapping, Sequence
from concurrent.futures import Executor, as_completed
from dataclasses import dataclass
from functools import lru_cache
from itertools import chain, combinations
from pathlib import Path

import numpy as np

from recon.calibration import CHANNELS, lit_channels
from recon.estimators import (
    ESTIMATORS,
    GradientEstimator,
    fit_estimator,
    training_pixels,
)
from recon.estimators.effort import Effort
from recon.estimators.lesson import FEW
from recon.lights import sits_like_wedge, unseen_axis
from recon.pipeline import Reconstruction
from recon.pixels import BallPress, Pixels, join, label_pixels
from recon.presses import LeftOut, PressReader, press_reader, refuse_no_press, sifted
from sensor.dataset import BallLabel, read_dataset
from sensor.unit import MissingAxis
from validation.contact import Overlap, disc_overlap
from validation.depth import DepthErrors, depth_errors
from validation.folds import Fold
from validation.metrics import PIXEL_SETS, Errors, PixelSet, PressErrors, mean_errors, press_errors
from validation.reconstructed import Slopes, reconstruct_press, slopes_in, slopes_of
from validation.splits import Split, splits

Progress = Callable[[float, str], None]
"""Called with the share that is done and what was done last."""

WEDGE_CONFIGURATIONS: Mapping[str, tuple[MissingAxis, ...]] = {
    "R": ("zero", "network"),
    "RB": ("zero", "network"),
    "RG": ("none",),
    "RGB": ("none",),
}


@dataclass(frozen=True, kw_only=True)
class Row:
    """One line of the table."""

    configuration: str
    missing_axis: MissingAxis
    estimator: str
    pixels: PixelSet
    errors: Errors


@dataclass(frozen=True, kw_only=True)
class ErrorTable:
    """Gradient errors of one dataset, and depth errors of its full light configuration."""

    dataset: str
    licence: str
    ball_radii_mm: tuple[float, ...]
    """Of its balls, the smallest first."""
    train: int
    test: int
    folds: int
    seed: int
    rows: tuple[Row, ...]
    depth: Mapping[str, tuple[DepthErrors, ...]]
    """Per estimator, one entry a held-out press, with all lights and as a unit reads them."""
    contact: Mapping[str, tuple[Overlap, ...]]
    """Likewise, how the contact mask fits the labelled disc."""
    left_out: tuple[LeftOut, ...]
    """Presses that could not be used."""
    folds_fitted: Mapping[str, tuple[Fold, ...]]
    """Per estimator, what each split taught it, with all lights. The first tells its doubt too."""

    @property
    def balls(self) -> str:
        """The radii of its balls in words."""
        return f"{' and '.join(f'{radius_mm:g}' for radius_mm in self.ball_radii_mm)} mm"


@dataclass(frozen=True, kw_only=True)
class Task:
    """Fit one estimator to one configuration on one split: a unit of parallel work."""

    folder: Path
    estimator: str
    channels: str
    missing_axes: tuple[MissingAxis, ...]
    split: Split
    seed: int
    effort: Effort


@dataclass(frozen=True, kw_only=True)
class TaskResult:
    """Errors of the presses that a task held out."""

    presses: Mapping[tuple[MissingAxis, PixelSet], tuple[PressErrors, ...]]
    depth: tuple[DepthErrors, ...]
    """Only of all lights that the dataset has."""
    contact: tuple[Overlap, ...]
    """Likewise."""
    fitted: GradientEstimator


def error_table(
    folder: Path,
    estimators: Sequence[str],
    *,
    folds: int,
    seed: int,
    executor: Executor,
    all_lights_only: Collection[str] = (),
    progress: Progress = lambda _share, _what: None,
) -> ErrorTable:
    """Measure every configuration with every estimator.

    Args:
        folder: the dataset.
        estimators: names from ``recon.estimators.ESTIMATORS``.
        folds: 1 for a single split, more for cross-validation.
        seed: of splits, drawn pixels, training and resampling.
        executor: runs the tasks; the result does not depend on which.
        all_lights_only: estimators that are spared the other configurations.
        progress: called after every task.

    Raises:
        WedgeError: the dataset cannot be used.
    """
    dataset = read_dataset(folder)
    lit, _ = lit_channels(dataset)
    survey = executor.submit(_survey, folder, seed).result()
    parts = splits(survey.usable, folds, seed)
    tasks = [
        Task(
            folder=folder,
            estimator=estimator,
            channels=channels,
            missing_axes=missing_axes,
            split=part,
            seed=seed,
            effort=Effort.WHOLE if channels == lit and part is parts[0] else Effort.SLOPES,
        )
        for estimator in estimators
        for channels, missing_axes in configurations(dataset.card.lights_deg).items()
        if channels == lit or estimator not in all_lights_only
        for part in parts
    ]
    futures = {executor.submit(run_task, task): task for task in tasks}
    try:
        for done, future in enumerate(as_completed(futures), start=1):
            task = futures[future]
            future.result()
            progress(done / len(tasks), f"{task.estimator} {task.channels}")
    except BaseException:
        for future in futures:
            future.cancel()
        raise
    results = {task: future.result() for future, task in futures.items()}
    by_estimator = {
        estimator: [result for task, result in results.items() if task.estimator == estimator]
        for estimator in estimators
    }
    return ErrorTable(
        dataset=dataset.card.name,
        licence=dataset.card.licence,
        ball_radii_mm=dataset.ball_radii_mm,
        train=min(len(part.train) for part in parts),
        test=sum(len(part.test) for part in parts),
        folds=folds,
        seed=seed,
        rows=_rows(results, seed),
        depth={
            name: tuple(chain.from_iterable(one.depth for one in found))
            for name, found in by_estimator.items()
        },
        contact={
            name: tuple(chain.from_iterable(one.contact for one in found))
            for name, found in by_estimator.items()
        },
        left_out=survey.left_out,
        folds_fitted={
            estimator: tuple(
                Fold(estimator=result.fitted, test=task.split.test)
                for task, result in results.items()
                if (task.estimator, task.channels) == (estimator, lit)
            )
            for estimator in estimators
        },
    )


def configurations(
    lights_deg: Mapping[str, float] | None,
) -> Mapping[str, tuple[MissingAxis, ...]]:
    """Channels to measure, and what stands in for an unseen axis in each of their rows."""
    if sits_like_wedge(lights_deg):
        return WEDGE_CONFIGURATIONS
    lit = [channel for channel in CHANNELS if lights_deg is None or channel in lights_deg]
    subsets = ("".join(some) for n in range(1, len(lit) + 1) for some in combinations(lit, n))
    return {
        channels: ("zero", "network") if unseen_axis(lights_deg, channels) else ("none",)
        for channels in subsets
    }


def widest(rows: Sequence[Row]) -> list[tuple[str, MissingAxis]]:
    """The configurations of the estimator that was measured with most of them, in order."""
    by_estimator: dict[str, dict[tuple[str, MissingAxis], None]] = {}
    for row in rows:
        by_estimator.setdefault(row.estimator, {})[row.configuration, row.missing_axis] = None
    return max((list(lines) for lines in by_estimator.values()), key=len)


def run_task(task: Task) -> TaskResult:
    """Fit on the train presses of a task and measure its test presses."""
    dataset = read_dataset(task.folder)
    lights_deg, (lit, shipped) = dataset.card.lights_deg, lit_channels(dataset)
    labelled = _labelled(task.folder, task.seed)
    # All few presses teach alike, and all many, so that folds share what is kept.
    taught = FEW if len(task.split.train) <= FEW else FEW + 1
    lessons = _lessons(task.folder, task.seed, task.estimator, taught)
    train = join([lessons[index] for index in task.split.train])
    estimator = fit_estimator(task.estimator, train, task.channels, task.seed, effort=task.effort)
    del train
    measured: dict[tuple[MissingAxis, PixelSet], list[PressErrors]] = {}
    depth: list[DepthErrors] = []
    contact: list[Overlap] = []
    for index in task.split.test:
        press, pixels = labelled.reader.read(labelled.labels[index]), labelled.pixels[index]
        for missing in task.missing_axes:
            if (task.channels, missing) == (lit, shipped):  # as a unit reads it: depth as well
                found = reconstruct_press(press, estimator, missing, lights_deg)
                depth.append(depth_errors(found.depth_mm, press, task.folder))
                contact.append(disc_overlap(press, found.contact))
                errors = errors_in(found, estimator, press.file, pixels)
            else:
                errors = measure_press(estimator, press, pixels, missing, lights_deg)
            for name, error in zip(PIXEL_SETS, errors, strict=True):
                measured.setdefault((missing, name), []).append(error)
    return TaskResult(
        presses={key: tuple(errors) for key, errors in measured.items()},
        depth=tuple(depth),
        contact=tuple(contact),
        fitted=estimator,
    )


def measure_press(
    estimator: GradientEstimator,
    press: BallPress,
    pixels: Pixels,
    missing: MissingAxis,
    lights_deg: Mapping[str, float] | None,
) -> tuple[PressErrors, ...]:
    """Errors of one press, one entry per pixel set."""
    slopes = slopes_of(estimator, press, pixels, missing, lights_deg)
    return _errors_by_set(press.file, slopes, pixels)


def errors_in(
    found: Reconstruction, estimator: GradientEstimator, file: str, pixels: Pixels
) -> tuple[PressErrors, ...]:
    """Errors of one press that was reconstructed already, one entry per pixel set."""
    return _errors_by_set(file, slopes_in(found, estimator, pixels), pixels)


def _errors_by_set(file: str, slopes: Slopes, pixels: Pixels) -> tuple[PressErrors, ...]:
    everything = np.ones(len(pixels), bool)
    chosen: Mapping[PixelSet, np.ndarray] = {"contact+5%": everything, "contact": pixels.contact}
    return tuple(press_errors(file, slopes, pixels.gradient, chosen[name]) for name in PIXEL_SETS)


def _rows(results: Mapping[Task, TaskResult], seed: int) -> tuple[Row, ...]:
    pooled: dict[tuple[str, str, MissingAxis, PixelSet], list[PressErrors]] = {}
    for task, result in results.items():
        for (missing, pixels), presses in result.presses.items():
            key = (task.estimator, task.channels, missing, pixels)
            pooled.setdefault(key, []).extend(presses)
    return tuple(
        Row(
            configuration=channels,
            missing_axis=missing,
            estimator=estimator,
            pixels=pixels,
            errors=mean_errors(presses, seed),
        )
        for (estimator, channels, missing, pixels), presses in pooled.items()
    )


@dataclass(frozen=True, kw_only=True)
class _Survey:
    """What the splits need to know of a dataset."""

    usable: int
    left_out: tuple[LeftOut, ...]


@dataclass(frozen=True, kw_only=True)
class _Labelled:
    """The usable presses of a dataset, without their frames."""

    reader: PressReader
    labels: tuple[BallLabel, ...]
    pixels: tuple[Pixels, ...]
    left_out: tuple[LeftOut, ...]


def _survey(folder: Path, seed: int) -> _Survey:
    labelled = _labelled(folder, seed)
    return _Survey(usable=len(labelled.labels), left_out=labelled.left_out)


@lru_cache(maxsize=1)
def _labelled(folder: Path, seed: int) -> _Labelled:
    """Kept per process: every task of a table needs the same pixels."""
    dataset = read_dataset(folder)
    reader = press_reader(dataset)
    labels: list[BallLabel] = []
    pixels: list[Pixels] = []
    left_out: list[LeftOut] = []
    for label, press in zip(dataset.labels, sifted(reader), strict=True):
        if isinstance(press, LeftOut):
            left_out.append(press)
        else:
            pixels.append(label_pixels(press, len(labels), seed))
            labels.append(label)
    refuse_no_press(dataset, len(labels), left_out)
    return _Labelled(
        reader=reader, labels=tuple(labels), pixels=tuple(pixels), left_out=tuple(left_out)
    )


@lru_cache(maxsize=1)
def _lessons(folder: Path, seed: int, estimator: str, taught: int) -> tuple[Pixels, ...]:
    """What is learnt from each press, one of so many; kept as long as its tasks follow."""
    labelled = _labelled(folder, seed)
    kind = ESTIMATORS.get(estimator)
    if kind and not kind.teach:  # the same as it is judged by: read no frame twice
        return labelled.pixels
    return tuple(
        training_pixels(estimator, labelled.reader.read(label), index, seed, taught)
        for index, label in enumerate(labelled.labels)
    )
