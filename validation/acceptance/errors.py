# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Errors on balls: of slope per axis and per light configuration, of depth, of the radius."""

from collections.abc import Mapping, Sequence
from concurrent.futures import Future
from functools import partial
from statistics import fmean

import numpy as np

from recon.estimators import fit_estimator, lesson_of
from recon.estimators.effort import Effort
from recon.labels.ball_size import WIDEST
from recon.lights import Axis, sits_like_wedge, unseen_axis
from recon.pixels import BallPress, Pixels, label_pixels
from sensor.unit import UnitCard
from validation.acceptance.limits import Parts
from validation.depth import rmse_interval_mm
from validation.error_table import ErrorTable, measure_press
from validation.evaluation import kept_interval
from validation.fits import Fits, Progress
from validation.intervals import Interval
from validation.metrics import PIXEL_SETS, Errors, PressErrors, mean_errors
from validation.splits import splits

FLATTEST = 1e-3
"""Of the ball's curvature; slopes that are flatter, or a hollow's, fit no ball."""
LEAST_DEPTH_MM = 1e-6
"""That a depth error is divided by, whatever a unit's file says."""
FEWER = ("RG", "RB", "R")
"""The paper's light configurations beside all lights; others' lights were not set for them."""
AXES: tuple[Axis, ...] = ("x", "y")


def error_values(errors: ErrorTable | None, card: UnitCard) -> dict[str, Parts]:
    """Errors of slope and depth on presses that the unit has not learnt from.

    Args:
        errors: the unit's on such presses; ``None`` for those that its calibration measured.
        card: the unit's.
    """
    if errors is not None:
        (depth,) = errors.depth.values()
        found: Mapping[str, float] = _on_contact(errors).values
        rmse_mm = fmean(error.rmse_mm for error in depth)
    else:
        found = {key: _kept(card, f"contact_{key}") for key in ("theta_x_deg", "theta_y_deg")}
        rmse_mm = _kept(card, "depth_rmse_mm")
    deepest_mm = _deepest_mm(errors, card)
    values: dict[str, Parts] = {"depth_rmse_share": {"": rmse_mm / deepest_mm}}
    for axis in AXES:
        values[_angle_limit(card, axis)] = {"": found[f"theta_{axis}_deg"]}
    return values


def error_intervals(errors: ErrorTable | None, card: UnitCard) -> dict[str, Interval]:
    """95 % intervals of ``error_values``, of those that have one."""
    if errors is not None:
        (depth,) = errors.depth.values()
        angles = _on_contact(errors).ci95
        rmse_mm = rmse_interval_mm(depth, errors.seed)
    else:
        angles = {
            name: kept_interval(card, f"contact_{name}") for name in ("theta_x_deg", "theta_y_deg")
        }
        rmse_mm = kept_interval(card, "depth_rmse_mm")
    found = {_angle_limit(card, axis): angles[f"theta_{axis}_deg"] for axis in AXES}
    if rmse_mm is not None:
        deepest_mm = _deepest_mm(errors, card)
        found["depth_rmse_share"] = (rmse_mm[0] / deepest_mm, rmse_mm[1] / deepest_mm)
    return {name: interval for name, interval in found.items() if interval is not None}


def mean_abs_gradient(errors: ErrorTable | None, card: UnitCard) -> float:
    """Mean |G| on the contacts that ``error_values`` rest on; NaN where the unit does not say."""
    if errors is not None:
        return _on_contact(errors).mean_abs_gradient
    return _kept(card, "contact_mean_abs_gradient")


def steepest_values(presses: Sequence[BallPress]) -> dict[str, Parts]:
    """The steepest slope of the presses, at the rim of their widest contacts."""
    sines = [press.contact_radius_mm / press.ball_radius_mm for press in presses]
    widest = min(float(np.quantile(sines, WIDEST)), 1.0)
    return {"steepest_deg": {"": float(np.degrees(np.arcsin(widest)))}}


def held_out_presses(errors: ErrorTable | None, card: UnitCard) -> int | None:
    """How many presses ``error_values`` rest on; ``None`` where the unit does not say."""
    if errors is not None:
        return errors.test
    kept = card.metrics.get("held_out_presses")
    return None if kept is None else int(kept)


def _angle_limit(card: UnitCard, axis: Axis) -> str:
    """The limit of an axis's angle."""
    unseen = unseen_axis(card.lights_deg, card.channels)
    return "inferred_axis_deg" if axis == unseen else f"theta_{axis}_deg"


def _on_contact(errors: ErrorTable) -> Errors:
    """A unit's errors of slope within the contacts."""
    (row,) = [row for row in errors.rows if row.pixels == "contact"]
    return row.errors


def _kept(card: UnitCard, name: str) -> float:
    """What calibration measured; NaN where the unit does not say, which no limit lets pass."""
    return float(card.metrics.get(name, np.nan))


def _deepest_mm(errors: ErrorTable | None, card: UnitCard) -> float:
    """How deep the presses are on which depth was judged, on average."""
    if errors is None:  # what is no number stays none
        return max(_kept(card, "depth_peak_truth_mm"), LEAST_DEPTH_MM)
    (depth,) = errors.depth.values()
    return fmean(error.peak_truth_mm for error in depth)


def fewer_lights(card: UnitCard) -> list[str]:
    """The configurations of a unit's lights that leave one or more of them out, of a Wedge."""
    if not sits_like_wedge(card.lights_deg):
        return []
    return [channels for channels in FEWER if set(channels) < set(card.channels)]


def fit_fewer_lights(
    card: UnitCard, presses: Sequence[BallPress], fits: Fits, *, seed: int
) -> dict[str, Future[list[PressErrors]]]:
    """Begin to fit estimators to some of the lights, and to judge them on presses held out.

    Args:
        card: the unit's; its estimator is fitted again to most of the presses.
        presses: of the unit.
        fits: where they are begun.
        seed: of the split and the drawn pixels.

    Returns:
        What becomes known of each configuration; nothing of lights that do not sit as a Wedge's.
    """
    configurations = fewer_lights(card)
    if not configurations or len(presses) < 2:
        return {}
    (split,) = splits(len(presses), 1, seed)
    lesson = lesson_of(card.estimator, presses, split.train, seed)
    held_out = [(presses[index], label_pixels(presses[index], index, seed)) for index in split.test]
    return {
        channels: fits.begin(partial(_errors_by, card, channels, lesson, held_out, seed))
        for channels in configurations
    }


def _errors_by(
    card: UnitCard,
    channels: str,
    lesson: Pixels,
    held_out: Sequence[tuple[BallPress, Pixels]],
    seed: int,
    progress: Progress,
) -> list[PressErrors]:
    """On contact, of the unit's estimator once it is fitted to some of the lights."""
    fitted = fit_estimator(card.estimator, lesson, channels, seed, progress, effort=Effort.HASTY)
    errors = [
        measure_press(fitted, press, pixels, "none", card.lights_deg) for press, pixels in held_out
    ]
    return [of_press[PIXEL_SETS.index("contact")] for of_press in errors]


def fewer_lights_values(
    card: UnitCard, errors: Mapping[str, Future[list[PressErrors]]], seed: int
) -> dict[str, Parts]:
    """Angle errors on contact of what ``fit_fewer_lights`` began.

    Only the axes that these lights see are judged.
    """
    values: dict[str, dict[str, float]] = {}
    for channels, of_presses in errors.items():
        found = mean_errors(of_presses.result(), seed).values
        for axis in AXES:
            if axis != unseen_axis(card.lights_deg, channels):
                parts = values.setdefault(f"fewer_lights_{axis}_deg", {})
                parts[channels] = found[f"theta_{axis}_deg"]
    return dict(values)


def ball_radius_values(errors: ErrorTable | None, card: UnitCard) -> dict[str, Parts]:
    """How far the radius of the ball that slopes fit is from the ball's, on the median press.

    Infinite where the slopes fit no ball.
    """
    if unseen_axis(card.lights_deg, card.channels) is not None:
        return {}
    if errors is not None:
        curvature = _on_contact(errors).curvature
    else:
        curvature = _kept(card, "contact_curvature")
    return {"ball_radius_share": {"": np.inf if curvature <= FLATTEST else abs(1 / curvature - 1)}}
