# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Units over data sets and dates: in tables, as a page, and for machines."""

import math
from collections.abc import Mapping, Sequence
from decimal import Decimal
from typing import Any

from validation.acceptance.limits import limit_called
from validation.drift import ERRORS, Evaluation, Move, Number, Pairing, compared
from validation.evaluation import ELSEWHERE_DEG
from validation.figures.drift import drift_figure
from validation.figures.png import plot_bytes
from validation.intervals import enough, remark
from validation.report.page import Picture, Section, bullets, figure_html, paragraph, table_html
from validation.table_text import table_document

HEADLINES = ("theta_x_deg", "theta_y_deg", "depth_rmse_mm", "depth_bias_mm", "noise")
"""Numbers in the short table."""
DECIMALS = 6
"""Shown at most: of a millimetre the last is a nanometre."""


def summary(evaluations: Sequence[Evaluation]) -> tuple[list[str], list[list[str]]]:
    """Headings and rows of a short table: a line for each unit on each data set."""
    titles = {name: title for name, title in _titles(evaluations).items() if name in HEADLINES}
    rows = [
        [
            item.unit + ("" if item.held_out else "*"),
            item.dataset,
            str(item.errors.test),
            *(value(item.numbers.get(name)) for name in titles),
        ]
        for item in evaluations
    ]
    return ["unit", "data", "presses", *titles.values()], rows


def sentences(moved: Sequence[Move]) -> list[str]:
    """What changed, in words."""
    return [
        f"{move.unit}: {move.title} changed from {plain(move.before)} ({move.since}) to "
        f"{plain(move.now)} {move.measure} ({move.dataset}); 99 % interval of the difference "
        f"{plain(move.ci99[0], '+')} to {plain(move.ci99[1], '+')}."
        for move in moved
    ]


def pictures_moved(evaluations: Sequence[Pairing]) -> list[str]:
    """Where the camera has moved since the calibration, of which errors say nothing."""
    limit = limit_called("moved_px")
    said = []
    for item in evaluations:
        if item.moved_px is not None and item.moved_px > limit.grade_a:
            how = (
                f"has moved by {plain(item.moved_px)} px since the calibration"
                if math.isfinite(item.moved_px)
                else "cannot be recognised from the calibration's"
            )
            said.append(
                f"{item.unit} on {item.dataset}: the blank gel's picture {how}, which the "
                "errors do not show: they use the set's own corners and circles."
            )
    return said


def lit_otherwise(evaluations: Sequence[Pairing]) -> list[str]:
    """Which data sets are of other lights than the unit, by what they say of themselves."""
    return [
        f"{item.unit} on {item.dataset}: by lights_deg, the data set has no light of "
        f"{' and '.join(item.lit_otherwise)}, or has it more than {ELSEWHERE_DEG:.0f}° from where "
        "the unit's is: its errors are those of other light."
        for item in evaluations
        if item.lit_otherwise
    ]


def verdict(evaluations: Sequence[Evaluation], moved: Sequence[Move]) -> list[str]:
    """What changed, in words, or that nothing did, and where too few presses were judged."""
    pairs = compared(evaluations)
    beside = [*pictures_moved(evaluations), *lit_otherwise(evaluations)]
    if not pairs:
        return ["There is one data set per unit: nothing to compare over time.", *beside]
    few = [
        pair for pair in pairs if not enough(min(x.errors.test for x in (pair.since, pair.later)))
    ]
    said = [*sentences(moved), *beside]
    if not said and len(few) < len(pairs):
        said = ["Nothing changed."]
    if few:
        named = dict.fromkeys(f"{pair.later.unit} on {pair.later.dataset}" for pair in few)
        said.append(f"Too few presses, there or in the first set, to tell: {', '.join(named)}.")
    said += [
        f"{pair.later.unit} on {pair.later.dataset}: depth errors were not compared with those on "
        f"{pair.since.dataset}, as some presses were judged against a truth file, others against "
        "the ball's cap, which begins at the rim of the contact."
        for pair in pairs
        if pair.but_depth
    ]
    judged = {pair.later.unit for pair in pairs if pair.names[0] in ERRORS}
    said += [
        f"{unit}: its errors were not compared, as that needs two data sets that it was not "
        "calibrated on."
        for unit in dict.fromkeys(pair.later.unit for pair in pairs)
        if unit not in judged
    ]
    return said


def drift_document(
    evaluations: Sequence[Evaluation],
    moved: Sequence[Move],
    left_out: Sequence[Mapping[str, str]] = (),
) -> dict[str, Any]:
    """All of it as plain values for JSON, with what could not be measured, and why."""
    return {
        "evaluations": [
            {
                "unit": item.unit,
                "held_out": item.held_out,
                "learnt_presses": item.learnt,
                "moved_px": item.moved_px,
                "lit_otherwise": list(item.lit_otherwise),
                **table_document(item.errors),
                "numbers": {
                    name: {
                        "title": number.title,
                        "unit": number.unit,
                        "mean": number.mean,
                        "ci95": number.ci95 and list(number.ci95),
                        "n_presses": len(number.sums),
                    }
                    for name, number in item.numbers.items()
                },
            }
            for item in evaluations
        ],
        "moved": [
            {
                "unit": move.unit,
                "number": move.name,
                "measure": move.measure,
                "since": move.since,
                "dataset": move.dataset,
                "before": move.before,
                "now": move.now,
                "ci99_of_difference": list(move.ci99),
            }
            for move in moved
        ],
        "left_out": list(left_out),
    }


def drift_sections(evaluations: Sequence[Evaluation], moved: Sequence[Move]) -> list[Section]:
    """A plot of every number, what changed, and all numbers in a table."""
    presses = _presses(evaluations)
    picture = Picture(
        content=plot_bytes(drift_figure(evaluations, moved)),
        alt="Each number over the data sets, with intervals; the table below lists the values",
        caption=f"Means over presses; {remark('bars are 95 % intervals', *presses)}."
        + " Filled: changed since the data set that it is compared with." * bool(moved),
        wide=True,
    )
    rule = paragraph(
        "A number has changed if the 99 % interval of its difference from the unit's first data "
        "set does not contain zero (Welch's t, from the scatter of the presses); errors are "
        "compared with the first data set that the unit was not calibrated on."
    )
    said = verdict(evaluations, moved)
    words = bullets(said) if len(said) > 1 else paragraph(said[0])
    seen = [item for item in evaluations if not item.held_out]
    note = (
        paragraph(
            "Units with a * were calibrated on presses of that data set: their errors there are "
            "too low, and are not compared over time."
        )
        if seen
        else ""
    )
    return [
        Section(
            title="What changed",
            html=rule * bool(compared(evaluations)) + words + figure_html(picture),
        ),
        Section(title="All numbers", html=note + _all_numbers(evaluations)),
    ]


def _all_numbers(evaluations: Sequence[Evaluation]) -> str:
    headings = [
        "number",
        *(f"{x.unit}{'' if x.held_out else '*'} on {x.dataset}" for x in evaluations),
    ]
    rows = [
        [title, *(value(item.numbers.get(name)) for item in evaluations)]
        for name, title in _titles(evaluations).items()
    ]
    intervals = remark("the 95 % interval below each", *_presses(evaluations))
    return table_html(f"Means over presses; {intervals}.", headings, rows)


def _titles(evaluations: Sequence[Evaluation]) -> dict[str, str]:
    """Of every number that some set has, with its unit of measure."""
    return {
        name: f"{number.title} [{number.unit}]"
        for item in evaluations
        for name, number in item.numbers.items()
    }


def _presses(evaluations: Sequence[Evaluation]) -> list[int]:
    return [len(number.sums) for item in evaluations for number in item.numbers.values()]


def value(number: Number | None) -> str:
    """A mean, its interval on a line of its own where there is one; a dash for no number."""
    if number is None:
        return "–"
    mean, interval = plain(number.mean), number.ci95
    return mean if interval is None else f"{mean}\n{plain(interval[0])} to {plain(interval[1])}"


def plain(value: float, sign: str = "") -> str:
    """Three digits that count, of six decimals, written out without an exponent."""
    rounded = round(value, DECIMALS) + 0.0  # no minus before a zero
    return f"{Decimal(f'{rounded:.3g}'):{sign}f}"
