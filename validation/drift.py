# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Numbers of units on data sets of several dates, press by press, and which of them have moved."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float64
from scipy import stats

from recon.calibration import Calibration
from recon.pixels import BallPress
from recon.presses import press_reader, read_presses
from sensor.dataset import Dataset
from validation.acceptance.gel import noise_of, of_one_frame, untouched
from validation.acceptance.moved import moved_px
from validation.depth import DepthErrors, rmse_interval_mm
from validation.error_table import ErrorTable
from validation.evaluation import (
    colors_lit_otherwise,
    judge_presses_singly,
    learnt_presses,
    refuse_other_sensor,
    table_of,
)
from validation.intervals import WITHIN, Interval, enough
from validation.lighting import GRAY_LEVELS, response_to_slope, seen_contact
from validation.metrics import METRICS, PIXEL_SETS

SURE = 0.99
"""Of a difference, before a number counts as moved: a dozen are compared at each date, and 95 %
would see one move at every other date where none has."""
DEPTH_ERRORS = ("depth_rmse_mm", "depth_bias_mm")
ERRORS = ("theta_x_deg", "theta_y_deg", *DEPTH_ERRORS)
"""The errors of a unit; the other numbers say what its sensor sees."""
LEAST_VARIANCE = 1e-24
"""Of a mean; presses that agree to the last digit still leave a test defined."""


@dataclass(frozen=True, kw_only=True)
class Number:
    """A mean over presses, with what each contributes."""

    title: str
    unit: str
    sums: Float64[np.ndarray, " n"]
    counts: Float64[np.ndarray, " n"]
    signed: bool = False
    """Whether it may be negative."""
    tabulated: Interval | None = None
    """Its interval in the error table, where it has one there."""

    @property
    def mean(self) -> float:
        """Over all that was counted."""
        return float(self.sums.sum() / self.counts.sum())

    @property
    def standard_error(self) -> float:
        """Of the mean, from the scatter of presses (linearised, as the mean is a ratio).

        Without end where there are too few of them to scatter.
        """
        count = len(self.sums)
        if not enough(count):
            return float("inf")
        off = (self.sums - self.mean * self.counts) / self.counts.mean()
        return float(np.sqrt((off**2).sum() / (count * (count - 1))))

    @property
    def ci95(self) -> Interval | None:
        """Interval of the mean over presses: the error table's, so that a number has but one.

        By Student's t, as far as such a mean can be, for what is in no table; ``None`` for too few
        presses.
        """
        if not enough(len(self.sums)):
            return None
        if self.tabulated is not None:
            return self.tabulated
        half = float(stats.t.ppf((1 + WITHIN) / 2, len(self.sums) - 1)) * self.standard_error
        low = self.mean - half
        return (low if self.signed else max(low, 0.0)), self.mean + half


def difference(now: Number, before: Number) -> Interval:
    """The 99 % interval of how much a mean differs (Welch's t)."""
    errors = np.array([now.standard_error, before.standard_error])
    counts = np.array([len(now.sums), len(before.sums)])
    if not np.isfinite(errors).all():
        return -np.inf, np.inf
    squared = errors**2
    total = max(float(squared.sum()), LEAST_VARIANCE)
    freedom = total**2 / max(float((squared**2 / (counts - 1)).sum()), LEAST_VARIANCE**2)
    half = float(stats.t.ppf((1 + SURE) / 2, freedom)) * float(np.sqrt(total))
    return now.mean - before.mean - half, now.mean - before.mean + half


@dataclass(frozen=True, kw_only=True)
class Pairing:
    """One unit on one data set, and what errors there do not show."""

    unit: str
    dataset: str
    """By which it is told from others: no two sets of one unit may share it."""
    moved_px: float | None
    """How far the blank gel's picture is from where it was at the calibration, as ``moved_px``
    tells; the set has its own corners, found again, so its errors do not show it."""
    lit_otherwise: str
    """The unit's colours that the set says to have no light, or one elsewhere, such as "RB"."""


@dataclass(frozen=True, kw_only=True)
class Evaluation(Pairing):
    """One unit on the labelled presses of one data set."""

    learnt: int
    """How many of these presses the unit has learnt from."""
    errors: ErrorTable
    numbers: Mapping[str, Number]
    """By name, such as ``theta_x_deg`` or ``brightness_R``."""

    @property
    def held_out(self) -> bool:
        """Whether the unit has learnt from none of these presses."""
        return self.learnt == 0

    @property
    def depth_truths(self) -> frozenset[str]:
        """What its depths were judged against: "ball cap", "truth file", or both."""
        return frozenset(error.truth for errors in self.errors.depth.values() for error in errors)


@dataclass(frozen=True, kw_only=True)
class Move:
    """A number that differs between two data sets of a unit beyond what presses scatter."""

    unit: str
    name: str
    title: str
    measure: str
    """Its unit of measure."""
    since: str
    dataset: str
    before: float
    now: float
    ci99: Interval
    """Of the difference."""


def evaluate_on(
    calibration: Calibration,
    dataset: Dataset,
    *,
    seed: int,
    called: str | None = None,
    progress: Callable[[float], None] = lambda _: None,
) -> Evaluation:
    """Measure a unit on a data set, press by press.

    Args:
        calibration: the unit.
        dataset: whose presses are judged.
        seed: of the drawn pixels and the intervals.
        called: what to call the set; its own name unless given.
        progress: called with the share that is done.

    Raises:
        WedgeError: the data set cannot be used, or comes from another sensor.
    """
    card = calibration.card
    refuse_other_sensor(calibration, dataset, press_reader(dataset))  # before all is read
    presses = read_presses(dataset, lambda share: progress(0.5 * share))
    judged = judge_presses_singly(
        calibration, dataset, presses, seed=seed, progress=lambda x: progress(0.5 + 0.5 * x)
    )
    table = table_of(calibration, dataset, presses, judged, seed)
    table = replace(table, dataset=called or table.dataset)
    (ci95,) = (row.errors.ci95 for row in table.rows if row.pixels == "contact")
    contact = PIXEL_SETS.index("contact")
    errors = [entry[contact] for entry in judged.per_press]
    pixels = np.array([error.n_pixels for error in errors], float)
    numbers = {
        name: Number(
            title=f"error of {symbol}",
            unit="°",
            sums=np.array([error.absolute[METRICS.index(name)] for error in errors], float),
            counts=pixels,
            tabulated=ci95[name],
        )
        for name, symbol in (("theta_x_deg", "θx"), ("theta_y_deg", "θy"))
    }
    numbers |= depth_numbers(judged.depth, seed)
    numbers |= _of_light(presses.presses, card.channels, len(dataset.card.background))
    before, now = map(calibration.unwarp, (calibration.background, presses.background))
    return Evaluation(
        unit=card.serial,
        dataset=table.dataset,
        learnt=learnt_presses(card, dataset, presses),
        errors=table,
        numbers=numbers,
        moved_px=moved_px(before, now),
        lit_otherwise=colors_lit_otherwise(card, dataset.card),
    )


def depth_numbers(errors: Sequence[DepthErrors], seed: int) -> dict[str, Number]:
    """The numbers of ``DEPTH_ERRORS`` over some presses."""
    rmse = _number("depth RMSE", "mm", [error.rmse_mm for error in errors])
    bias = _number("depth bias", "mm", [error.bias_mm for error in errors])
    return {
        "depth_rmse_mm": replace(rmse, tabulated=rmse_interval_mm(errors, seed)),
        "depth_bias_mm": replace(bias, signed=True),
    }


def moves(evaluations: Sequence[Evaluation]) -> list[Move]:
    """What has moved on each later data set of a unit, in the order given (``compared``)."""
    found = []
    for pair in compared(evaluations):
        for name in pair.names:
            now, before = pair.later.numbers[name], pair.since.numbers[name]
            low, high = difference(now, before)
            if low > 0 or high < 0:
                found.append(
                    Move(
                        unit=pair.later.unit,
                        name=name,
                        title=now.title,
                        measure=now.unit,
                        since=pair.since.dataset,
                        dataset=pair.later.dataset,
                        before=before.mean,
                        now=now.mean,
                        ci99=(low, high),
                    )
                )
    return found


@dataclass(frozen=True, kw_only=True)
class Compared:
    """Two data sets of a unit, and the numbers that are compared between them."""

    since: Evaluation
    later: Evaluation
    names: tuple[str, ...]

    @property
    def but_depth(self) -> bool:
        """Whether errors are compared, but not those of depth."""
        return self.names[0] in ERRORS and not _judged_alike(self.since, self.later)


def compared(evaluations: Sequence[Evaluation]) -> list[Compared]:
    """What each later data set of a unit is compared with, in the order given.

    What a sensor sees is compared with the unit's first set. A unit has smaller errors on presses
    that it has learnt from: errors on presses that it has not are compared with those on the first
    such set of its own; those of depth only where the ball's cap is the truth of all presses of
    both sets, or files are, as a cap's rim is taken off first.
    """
    firsts: dict[str, Evaluation] = {}
    unlearnt: dict[str, Evaluation] = {}
    found = []
    for item in evaluations:
        first = firsts.setdefault(item.unit, item)
        unseen = unlearnt.setdefault(item.unit, item) if item.held_out else item
        for since, errs in ((unseen, True), (first, False)):
            left_out = () if _judged_alike(since, item) else DEPTH_ERRORS
            both = (name for name in item.numbers if name in since.numbers)
            names = tuple(
                name for name in both if (name in ERRORS) == errs and name not in left_out
            )
            if since is not item and names:
                found.append(Compared(since=since, later=item, names=names))
    return found


def _judged_alike(since: Evaluation, later: Evaluation) -> bool:
    """Whether all depths of two sets were judged against the same kind of truth."""
    return len(since.depth_truths | later.depth_truths) <= 1


def _of_light(presses: Sequence[BallPress], channels: str, blanks: int) -> dict[str, Number]:
    """Noise, brightness of untouched gel, and each colour's response to slope, of every press."""
    noise, brightness, answers = [], [], []
    for press in presses:
        flat = untouched(press)
        if flat.any() and press.blank is not None:
            noise.append(of_one_frame(blanks) * np.mean(noise_of(press, flat)))
            brightness.append(np.median((press.difference + press.blank)[flat], axis=0))
        answers.append(np.linalg.norm(response_to_slope(seen_contact(press)), axis=1))
    numbers = {}
    if noise:
        numbers["noise"] = _number("noise", "grey levels", GRAY_LEVELS * np.array(noise))
    for channel in channels:
        column = "RGB".index(channel)
        if brightness:
            numbers[f"brightness_{channel}"] = _number(
                f"brightness, {channel}",
                "grey levels",
                GRAY_LEVELS * np.array(brightness)[:, column],
            )
        numbers[f"answer_{channel}"] = _number(
            f"response to slope, {channel}",
            "grey levels",
            GRAY_LEVELS * np.array(answers)[:, column],
        )
    return numbers


def _number(title: str, unit: str, values: Sequence[float] | np.ndarray) -> Number:
    sums = np.asarray(values, float)
    return Number(title=title, unit=unit, sums=sums, counts=np.ones_like(sums))
