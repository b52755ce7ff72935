# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""What is measured of a unit: its errors on balls, its lights, its gel, its camera's place."""

from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from statistics import median

from recon.arrays import ContactMask, Unwarped
from recon.calibration import Calibration
from recon.lights import unseen_axis
from recon.markers.tracking import marker_tracker
from recon.presses import read_presses
from sensor.dataset import Dataset
from validation.acceptance.errors import (
    ball_radius_values,
    error_intervals,
    error_values,
    fewer_lights_values,
    fit_fewer_lights,
    held_out_presses,
)
from validation.acceptance.gel import (
    blank_values,
    covered_area,
    inner,
    saturation,
    stillness,
    usable_area,
    without_dots,
)
from validation.acceptance.lights import light_response, light_values
from validation.acceptance.limits import LIMITS, Measured, Parts
from validation.acceptance.place import LEAST_FRAMES, picture_values, timing_values
from validation.acceptance.roundness import roundness
from validation.error_table import ErrorTable
from validation.evaluation import judge_presses, learnt_presses, refuse_other_sensor
from validation.examples import Example, example
from validation.intervals import Interval

NO_TIMES = "a dataset's frames have no times; name a recording or a stream by --frames"


@dataclass(frozen=True, kw_only=True)
class Acceptance:
    """All that a certificate says."""

    values: Measured
    absent: Mapping[str, str]
    """Why a measurement was not made, by the names of ``limits.LIMITS``."""
    errors: ErrorTable
    learnt: int
    """How many of the presses the unit has learnt from; beside any, errors are calibration's."""
    held_out: int | None
    """How many presses the errors rest on, none of them learnt from; ``None`` where the unit does
    not say."""
    intervals: Mapping[str, Interval]
    """95 % intervals of the errors that have one, by the names of ``limits.LIMITS``."""
    blank: Unwarped
    gel: Unwarped
    """The blank frame without its dots."""
    covered: ContactMask
    usable: ContactMask
    press: Example
    """One of median size."""


def accept_unit(
    calibration: Calibration,
    dataset: Dataset,
    *,
    seed: int,
    executor: Executor,
    times_ns: Sequence[int] = (),
    indices: Sequence[int] = (),
    progress: Callable[[float], None] = lambda _: None,
) -> Acceptance:
    """Measure a unit on a dataset of its presses.

    Where the unit has learnt from any of the presses, the gradient and depth errors are those that
    calibration measured on presses held out.

    Args:
        calibration: the unit.
        dataset: presses of it, best of another day.
        seed: of splits, drawn pixels and intervals.
        executor: fits fewer lights side by side, while the rest is measured here.
        times_ns: when frames of the unit were taken, where that is known.
        indices: the numbers of those frames.
        progress: called with the share that is done.

    Raises:
        WedgeError: the dataset cannot be used, or comes from another sensor.
    """
    card, channels = calibration.card, calibration.card.channels
    presses = read_presses(dataset, lambda share: progress(0.1 * share))
    refuse_other_sensor(calibration, dataset, presses)
    fewer = fit_fewer_lights(card, dataset, len(presses.presses), seed=seed, executor=executor)
    errors = judge_presses(
        calibration, dataset, presses, seed=seed, progress=lambda x: progress(0.1 + 0.3 * x)
    )
    learnt = learnt_presses(card, dataset, presses)
    unseen = unseen_axis(card.lights_deg, channels)
    blank = presses.unwarp(presses.background)
    gel = without_dots(blank, presses.dots)
    calibrated = calibration.unwarp(calibration.background)
    covered, inside = covered_area(presses.presses), inner(blank.shape)
    response = light_response(presses.presses)
    still = stillness(presses.presses, channels)
    noise: Parts = still.get("noise_grey_levels", dict.fromkeys(channels, 0.0))
    axes = "xy" if unseen is None else "y" if unseen == "x" else "x"
    usable = usable_area(gel, response, noise, axes, channels)
    pictured, absent = picture_values(presses, calibrated, roundness(presses.presses, seed))
    progress(0.5)
    values: dict[str, Parts] = {
        **error_values(errors, card, learnt == 0),
        **ball_radius_values(calibration.estimator, presses.presses, unseen),
        **light_values(response, channels, card.lights_deg, unseen is None),
        **still,
        **blank_values(gel, without_dots(calibrated, marker_tracker(calibrated)), channels),
        "saturated_share": saturation(presses.presses, blank, channels),
        "covered_share": {"": float(covered[inside].mean())},
        "usable_share": {"": float(usable[inside].mean())},
        **pictured,
        **timing_values(times_ns, indices),
    }
    typical = median(press.contact_radius_px for press in presses.presses)
    shown = min(presses.presses, key=lambda press: abs(press.contact_radius_px - typical))
    pictured_press = example(calibration.estimator, card.missing_axis, dataset, presses, shown)
    values |= fewer_lights_values(card, fewer, seed, lambda share: progress(0.5 + 0.5 * share))
    return Acceptance(
        values={limit.name: values[limit.name] for limit in LIMITS if limit.name in values},
        absent={**_reasons(values, len(times_ns)), **absent},
        errors=errors,
        learnt=learnt,
        held_out=held_out_presses(errors, card, learnt == 0),
        intervals=error_intervals(errors, card, learnt == 0),
        blank=blank,
        gel=gel,
        covered=covered,
        usable=usable,
        press=pictured_press,
    )


def _reasons(values: Measured, frames: int) -> dict[str, str]:
    """Why limits without a value have none."""
    unsaid = "the unit does not say where its lights sit"
    few = "its lights do not sit as the Wedge's three, whose pairs the paper compares"
    times = NO_TIMES
    if frames:
        few_frames = f"only {frames} frames have times, {LEAST_FRAMES} are needed"
        times = few_frames if frames < LEAST_FRAMES else "the frames' times do not grow"
    why = {
        "swapped_lights": unsaid,
        "lights_turned_deg": unsaid,
        "cross_talk_share": unsaid,
        "fewer_lights_x_deg": few,
        "fewer_lights_y_deg": few,
        "noise_grey_levels": "every press reaches over the whole pad",
        "drift_grey_levels": "every press reaches over the whole pad",
        "axes_ratio": "its lights see one axis alone, as they were built",
        "color_balance_share": "it has one light",
        "ball_radius_share": "its lights see one axis alone, as they were built",
        "brightness_change_share": "the calibrated picture has another size",
        "frame_rate_hz": times,
        "jitter_ms": times,
        "lost_share": times,
    }
    return {name: reason for name, reason in why.items() if name not in values}
