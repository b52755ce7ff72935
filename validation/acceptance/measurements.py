# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""What is measured of a unit: its errors on balls, its lights, its gel, its camera's place."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from statistics import median

import numpy as np

from recon.arrays import ContactMask, Unwarped
from recon.brightness import brightness_change, inner, without_dots
from recon.calibration import Calibration
from recon.labels.press_doubts import press_doubts
from recon.lights import unseen_axis
from recon.presses import LeftOut, PressSet, read_presses
from sensor.dataset import Dataset
from sensor.unit import UnitCard
from validation.acceptance.errors import (
    ball_radius_values,
    error_intervals,
    error_values,
    fewer_lights_values,
    fit_fewer_lights,
    held_out_presses,
    mean_abs_gradient,
    steepest_values,
)
from validation.acceptance.gel import (
    blank_values,
    covered_area,
    of_one_frame,
    saturation,
    stillness,
    usable_area,
)
from validation.acceptance.lights import light_response, light_values
from validation.acceptance.limits import LIMITS, Measured, Parts
from validation.acceptance.place import LEAST_FRAMES, picture_values, timing_values
from validation.acceptance.roundness import roundness
from validation.error_table import ErrorTable
from validation.evaluation import (
    judge_presses,
    learnt_presses,
    refuse_other_sensor,
    refuse_other_truths,
)
from validation.examples import Example, example
from validation.fits import concurrent_fits
from validation.intervals import Interval

LEAST_FRESH = 5
"""Presses that a unit has not learnt from, beside others that it has: so many judge it alone."""
OWN_LIGHTS = "no design says where its lights belong, and it has learnt from all these presses"
SINCE_CALIBRATION = ("brightness_change_share", "moved_px")
NO_NUMBERS = "the frames have no numbers; give the address of the sensor's own stream"
NO_TIMES = "a dataset's frames have no times; give a recording or a stream with --stream"


@dataclass(frozen=True, kw_only=True)
class Acceptance:
    """All that a certificate says."""

    values: Measured
    absent: Mapping[str, str]
    """Why a measurement was not made, by the names of ``limits.LIMITS``."""
    presses: int
    """How many could be used."""
    left_out: tuple[LeftOut, ...]
    """Those that could not."""
    learnt: int
    """How many of the presses the unit has learnt from."""
    errors: ErrorTable | None
    """On those that it has not; of too few, ``None``, and calibration's errors stand."""
    mean_abs_gradient: float
    """Mean \\|G\\| on the contacts that the errors rest on; NaN where the unit does not say."""
    doubts: tuple[str, ...]
    """Sentences on the presses: whether they are enough, and their ball's radius can be right."""
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
    times_ns: Sequence[int] = (),
    indices: Sequence[int] = (),
    progress: Callable[[float], None] = lambda _: None,
) -> Acceptance:
    """Measure a unit on a dataset of its presses.

    Where the unit has learnt from some of the presses, errors are those of the others; of fewer
    than ``LEAST_FRESH`` others, those that calibration measured on presses held out.

    Args:
        calibration: the unit.
        dataset: presses of it, best of another day.
        seed: of splits, drawn pixels and intervals.
        times_ns: when frames of the unit were taken, where that is known.
        indices: the numbers of those frames, where they bear some.
        progress: called with the share that is done.

    Raises:
        WedgeError: the dataset cannot be used, or comes from another sensor.
    """
    presses = read_presses(dataset, lambda share: progress(0.1 * share))
    refuse_other_sensor(calibration, dataset, presses)
    with concurrent_fits() as fits:  # beside what is measured here
        fewer = fit_fewer_lights(calibration.card, presses.presses, fits, seed=seed)
        found = _but_fewer_lights(calibration, dataset, presses, seed, times_ns, indices, progress)
        fits.wait(lambda share: progress(0.5 + 0.5 * share))
    values = {**found.values, **fewer_lights_values(calibration.card, fewer, seed)}
    absent = {**_reasons(values, len(times_ns), len(presses.presses)), **found.absent}
    return replace(found, values=_in_order(values), absent=absent)


def _but_fewer_lights(
    calibration: Calibration,
    dataset: Dataset,
    presses: PressSet,
    seed: int,
    times_ns: Sequence[int],
    indices: Sequence[int],
    progress: Callable[[float], None],
) -> Acceptance:
    """All that ``accept_unit`` measures but the errors by fewer lights."""
    card, channels = calibration.card, calibration.card.channels
    learnt = learnt_presses(card, dataset, presses)
    fresh = _fresh(card, presses, learnt)
    errors = None
    if fresh is not None:
        errors = judge_presses(
            calibration, dataset, fresh, seed=seed, progress=lambda x: progress(0.1 + 0.3 * x)
        )
    unseen = unseen_axis(card.lights_deg, channels)
    blank = presses.unwarp(presses.background)
    gel = without_dots(blank, presses.dots)
    before, now = map(calibration.unwarp, (calibration.background, presses.background))
    covered, inside = covered_area(presses.presses), inner(blank.shape)
    response, design = light_response(presses.presses), calibration.design
    designed_deg = None
    if design is not None:
        designed_deg = {str(color): at for color, at in design.lights.azimuths_deg.items()}
    blanks = len(dataset.card.background)
    still = stillness(presses.presses, channels, blanks)
    of_frames: Parts = still.get("noise_gray_levels", dict.fromkeys(channels, 0.0))
    noise = {color: level / of_one_frame(blanks) for color, level in of_frames.items()}
    axes = "xy" if unseen is None else "y" if unseen == "x" else "x"
    usable = usable_area(gel, response, noise, axes, channels)
    pictured, absent = picture_values(presses, before, now, roundness(presses.presses, seed))
    progress(0.5)
    values: dict[str, Parts] = {
        **error_values(errors, card),
        **ball_radius_values(errors, card),
        **steepest_values((fresh or presses).presses),
        "usable_presses": {"": float(len(presses.presses))},
        **light_values(response, channels, card.lights_deg, unseen is None, designed_deg),
        **still,
        **blank_values(gel, channels),
        "brightness_change_share": brightness_change(before, now, channels),
        "saturated_share": saturation(presses.presses, blank, channels),
        "covered_share": {"": float(covered[inside].mean())},
        "usable_share": {"": float(usable[inside].mean())},
        **pictured,
        **timing_values(times_ns, indices),
    }
    is_own = design is None and learnt == len(presses.presses)
    if is_own and values.get("swapped_lights") == {"": 0}:  # lights are where they were seen
        absent["swapped_lights"] = OWN_LIGHTS
    typical = median(press.contact_radius_px for press in presses.presses)
    shown = min(presses.presses, key=lambda press: abs(press.contact_radius_px - typical))
    pictured_press = example(calibration.estimator, card.missing_axis, dataset, presses, shown)
    if np.array_equal(before, now):  # a picture held against itself has changed in nothing
        absent |= dict.fromkeys(SINCE_CALIBRATION, "the blank picture is the calibration's own")
    return Acceptance(
        values={name: parts for name, parts in values.items() if name not in absent},
        absent=absent,
        presses=len(presses.presses),
        left_out=presses.left_out,
        learnt=learnt,
        errors=errors,
        mean_abs_gradient=mean_abs_gradient(errors, card),
        doubts=press_doubts(presses, dataset.labels),
        held_out=held_out_presses(errors, card),
        intervals=error_intervals(errors, card),
        blank=blank,
        gel=gel,
        covered=covered,
        usable=usable,
        press=pictured_press,
    )


def _in_order(values: Measured) -> dict[str, Parts]:
    """As the limits are listed."""
    return {limit.name: values[limit.name] for limit in LIMITS if limit.name in values}


def _fresh(card: UnitCard, presses: PressSet, learnt: int) -> PressSet | None:
    """The presses that a unit has not learnt from, where they are enough to judge it."""
    if not learnt:
        return presses
    if card.learnt_frames is None:
        return None
    others = tuple(x for x in presses.presses if x.fingerprint not in card.learnt_frames)
    if len(others) >= LEAST_FRESH:
        return replace(presses, presses=others)
    refuse_other_truths(card, presses)
    return None


def _reasons(values: Measured, frames: int, presses: int) -> dict[str, str]:
    """Why limits without a value have none, of so many frames with times and usable presses."""
    unsaid = "the unit does not state where its lights are"
    few = "its lights are not placed like the Wedge's three, whose pairs the paper compares"
    if presses < 2:
        few = "one press cannot be split into training and test presses"
    times = lost = NO_TIMES
    if frames:
        few_frames = f"only {frames} frames have times, {LEAST_FRAMES} are needed"
        times = few_frames if frames < LEAST_FRAMES else "the frames' times do not increase"
        lost = few_frames if frames < LEAST_FRAMES else NO_NUMBERS
    why = {
        "swapped_lights": unsaid,
        "lights_turned_deg": unsaid,
        "cross_talk_share": unsaid,
        "fewer_lights_x_deg": few,
        "fewer_lights_y_deg": few,
        "noise_gray_levels": "every press covers the whole pad",
        "drift_gray_levels": "every press covers the whole pad",
        "axes_ratio": "its lights are built to see only one axis",
        "color_balance_share": "it has one light",
        "ball_radius_share": "its lights are built to see only one axis",
        "frame_rate_hz": times,
        "jitter_ms": times,
        "longest_gap_ms": times,
        "backward_steps": times,
        "lost_share": lost,
    }
    return {name: reason for name, reason in why.items() if name not in values}
