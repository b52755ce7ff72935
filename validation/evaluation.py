# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""One estimator measured on presses that it has not learnt from."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from statistics import fmean

import numpy as np
from jaxtyping import Float32

from recon.arrays import Unwarped
from recon.calibration import Calibration, lit_channels
from recon.estimators import GradientEstimator, fit_estimator, lesson_of
from recon.estimators.effort import Effort
from recon.geometry.caliper import of_one_scale
from recon.lights import azimuth_deg
from recon.pixels import label_pixels
from recon.presses import PressReader, PressSet
from recon.same_light import light_of
from sensor.dataset import Dataset, DatasetCard
from sensor.errors import WedgeError
from sensor.unit import MissingAxis, UnitCard
from validation.depth import DepthErrors, depth_errors, rmse_interval_mm
from validation.error_table import ErrorTable, Row, errors_in
from validation.intervals import Interval
from validation.metrics import PIXEL_SETS, PressErrors, mean_errors
from validation.reconstructed import reconstruct_press
from validation.splits import splits

Progress = Callable[[float], None]
ELSEWHERE_DEG = 45.0
"""A light that has turned by more is another one's, or another sensor's."""


def refuse_other_sensor(
    calibration: Calibration, dataset: Dataset, presses: PressSet | PressReader
) -> None:
    """Refuse presses that cannot be a unit's.

    Raises:
        WedgeError: the frames have another size than the unit's, or their pixels show another
            length.
    """
    card = calibration.card
    seen, needed = presses.unwarp.frame_size_px, card.frame_size_px
    if seen != needed:
        raise WedgeError(
            f"{dataset.folder / dataset.card.background[0]} is {seen[0]}x{seen[1]} pixels, but "
            f"frames of the unit {card.serial} are {needed[0]}x{needed[1]}: it is another sensor's."
        )
    if not of_one_scale(dataset.card.mm_per_px, card.mm_per_px):
        its, ours = ("{:.4g} x {:.4g}".format(*c.mm_per_px) for c in (dataset.card, card))
        raise WedgeError(
            f"{dataset.folder}: its pixels are {its} mm, but those of the unit {card.serial} are "
            f"{ours} mm: correct the scale of one of them, or calibrate again."
        )


def colors_lit_otherwise(unit: UnitCard, dataset: DatasetCard) -> str:
    """Those of a unit's colours that a dataset says to have no light, or one elsewhere."""
    there = dataset.lights_deg
    if there is None:
        return ""
    before = unit.lights_deg or there
    return "".join(
        color
        for color in unit.channels
        if color not in there or abs(azimuth_deg(there[color] - before[color])) > ELSEWHERE_DEG
    )


def learnt_presses(card: UnitCard, dataset: Dataset, presses: PressSet) -> int:
    """How many of these presses a unit has learnt from, whatever files and labels they have now."""
    if card.learnt_frames is None:
        return len(presses.presses) if dataset.sha256 == card.dataset_sha256 else 0
    return sum(press.fingerprint in card.learnt_frames for press in presses.presses)


def refuse_other_truths(card: UnitCard, presses: PressSet) -> None:
    """Refuse presses that a unit has learnt from otherwise: its own errors are not of these.

    Raises:
        WedgeError: circles, the ball or the scale have changed since.
    """
    learnt = dict(zip(card.learnt_frames or (), card.learnt_truths or (), strict=False))
    changed = [
        press.file
        for press in presses.presses
        if learnt.get(press.fingerprint, press.truth_fingerprint) != press.truth_fingerprint
    ]
    if changed:
        raise WedgeError(
            f"circle, ball or scale of {len(changed)} of these presses, such as {changed[0]}, are "
            f"others than unit {card.serial} has learnt from: calibrate it again."
        )


@dataclass(frozen=True, kw_only=True)
class Judged:
    """Errors of some presses, each by itself."""

    per_press: tuple[tuple[PressErrors, ...], ...]
    """One entry for each of ``PIXEL_SETS``."""
    depth: tuple[DepthErrors, ...]


def judge_presses(
    calibration: Calibration,
    dataset: Dataset,
    presses: PressSet,
    *,
    seed: int,
    progress: Progress = lambda _: None,
) -> ErrorTable:
    """Gradient and depth errors of a unit on presses that were read already."""
    judged = judge_presses_singly(calibration, dataset, presses, seed=seed, progress=progress)
    return table_of(calibration, dataset, presses, judged, seed)


def judge_presses_singly(
    calibration: Calibration,
    dataset: Dataset,
    presses: PressSet,
    *,
    seed: int,
    progress: Progress = lambda _: None,
) -> Judged:
    """Errors of a unit on each of some presses."""
    card = calibration.card
    return _judge(
        calibration.estimator,
        dataset,
        in_light_of(calibration, presses),
        judged=range(len(presses.presses)),
        missing=card.missing_axis,
        lights_deg=card.lights_deg,
        seed=seed,
        progress=progress,
    )


def in_light_of(calibration: Calibration, presses: PressSet) -> PressSet:
    """Presses as the light of a unit's calibration would show them, as its frames are seen."""
    blank = presses.unwarp(presses.background)
    light = light_beside(calibration, blank)
    if (light == 1).all():
        return presses
    return replace(
        presses,
        presses=tuple(
            replace(press, difference=press.difference / light, blank=blank / light)
            for press in presses.presses
        ),
    )


def light_beside(calibration: Calibration, blank: Unwarped) -> Float32[np.ndarray, "3"]:
    """How many times as bright as at a unit's calibration each colour of a blank gel is."""
    own = calibration.unwarp(calibration.background)
    return light_of(blank - own, own) if own.shape == blank.shape else np.ones(3, np.float32)


def table_of(
    calibration: Calibration, dataset: Dataset, presses: PressSet, judged: Judged, seed: int
) -> ErrorTable:
    """The error table of a unit on presses that it was judged on."""
    card = calibration.card
    train = int(card.metrics.get("fitted_presses", 0))
    return _table(calibration.estimator, dataset, presses, judged, train, card.missing_axis, seed)


def hold_out(
    dataset: Dataset,
    presses: PressSet,
    estimator: str,
    *,
    seed: int,
    progress: Progress = lambda _: None,
) -> ErrorTable:
    """Fit an estimator to most presses of a dataset and measure it on the others.

    Raises:
        WedgeError: there are too few presses to split.
    """
    (split,) = splits(len(presses.presses), 1, seed)
    channels, missing = lit_channels(dataset)
    train = lesson_of(estimator, presses.presses, split.train, seed)
    fitted = fit_estimator(
        estimator, train, channels, seed, lambda share: progress(share / 2), effort=Effort.SLOPES
    )
    judged = _judge(
        fitted,
        dataset,
        presses,
        judged=split.test,
        missing=missing,
        lights_deg=dataset.card.lights_deg,
        seed=seed,
        progress=lambda share: progress((1 + share) / 2),
    )
    return _table(fitted, dataset, presses, judged, len(split.train), missing, seed)


def held_out_metrics(table: ErrorTable, fitted_presses: int) -> dict[str, int | float]:
    """What ``unit.toml`` keeps of a table with one configuration."""
    metrics: dict[str, int | float] = {
        "fitted_presses": fitted_presses,
        "held_out_presses": table.test,
    }
    for row in table.rows:
        name = "contact" if row.pixels == "contact" else "contact_and_5_percent"
        metrics |= {f"{name}_{key}": value for key, value in row.errors.values.items()}
        metrics[f"{name}_mean_abs_gradient"] = row.errors.mean_abs_gradient
        if row.pixels == "contact":  # those that a certificate shows
            # No metric but a bias may be negative, and a hollow is as far from a ball as a plane.
            metrics["contact_curvature"] = max(row.errors.curvature, 0.0)
            for key in ("theta_x_deg", "theta_y_deg"):
                metrics |= _ends(f"contact_{key}", row.errors.ci95[key])
    for errors in table.depth.values():
        metrics["depth_rmse_mm"] = fmean(error.rmse_mm for error in errors)
        metrics["depth_bias_mm"] = fmean(error.bias_mm for error in errors)
        metrics["depth_peak_truth_mm"] = fmean(error.peak_truth_mm for error in errors)
        metrics |= _ends("depth_rmse_mm", rmse_interval_mm(errors, table.seed))
    return metrics


def _ends(name: str, interval: Interval | None) -> dict[str, float]:
    """The ends of a 95 % interval as ``kept_interval`` finds them; nothing of none."""
    return {} if interval is None else {f"{name}_low": interval[0], f"{name}_high": interval[1]}


def kept_interval(card: UnitCard, name: str) -> Interval | None:
    """The 95 % interval of a metric, where the unit keeps one."""
    low, high = (card.metrics.get(f"{name}_{end}") for end in ("low", "high"))
    return None if low is None or high is None else (float(low), float(high))


def _judge(
    estimator: GradientEstimator,
    dataset: Dataset,
    presses: PressSet,
    *,
    judged: Sequence[int],
    missing: MissingAxis,
    lights_deg: Mapping[str, float] | None,
    seed: int,
    progress: Progress,
) -> Judged:
    per_press: list[tuple[PressErrors, ...]] = []
    depth: list[DepthErrors] = []
    for done, index in enumerate(judged, start=1):
        press = presses.presses[index]
        pixels = label_pixels(press, index, seed)
        found = reconstruct_press(press, estimator, missing, lights_deg)
        per_press.append(errors_in(found, estimator, press.file, pixels))
        depth.append(depth_errors(found.depth_mm, press, dataset.folder))
        progress(done / len(judged))
    return Judged(per_press=tuple(per_press), depth=tuple(depth))


def _table(
    estimator: GradientEstimator,
    dataset: Dataset,
    presses: PressSet,
    judged: Judged,
    train: int,
    missing: MissingAxis,
    seed: int,
) -> ErrorTable:
    return ErrorTable(
        dataset=dataset.card.name,
        licence=dataset.card.licence,
        ball_radii_mm=dataset.ball_radii_mm,
        train=train,
        test=len(judged.depth),
        folds=1,
        seed=seed,
        rows=tuple(
            Row(
                configuration=estimator.channels,
                missing_axis=missing,
                estimator=estimator.name,
                pixels=name,
                errors=mean_errors([row[column] for row in judged.per_press], seed),
            )
            for column, name in enumerate(PIXEL_SETS)
        ),
        depth={estimator.name: judged.depth},
        left_out=presses.left_out,
        folds_fitted={},
        contact={},
    )
