# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Units over data sets and dates: in tables, as a page, and for machines."""

from collections.abc import Sequence
from typing import Any

from validation.drift import Evaluation, Move, Number
from validation.figures.drift import drift_figure
from validation.figures.png import plot_bytes
from validation.report.page import Picture, Section, bullets, figure_html, paragraph, table_html
from validation.table_text import table_document

HEADLINES = ("theta_x_deg", "theta_y_deg", "depth_rmse_mm", "depth_bias_mm", "noise")
"""Numbers in the short table."""


def summary(evaluations: Sequence[Evaluation]) -> tuple[list[str], list[list[str]]]:
    """Headings and rows of a short table: a line for each unit on each data set."""
    titles = [
        f"{item.title} [{item.unit}]"
        for name in HEADLINES
        if (item := evaluations[0].numbers.get(name)) is not None
    ]
    rows = [
        [
            item.unit + ("" if item.held_out else "*"),
            item.dataset,
            str(item.errors.test),
            *(value(item.numbers[name]) for name in HEADLINES if name in item.numbers),
        ]
        for item in evaluations
    ]
    return ["unit", "data", "presses", *titles], rows


def sentences(moved: Sequence[Move]) -> list[str]:
    """What moved, in words."""
    return [
        f"{move.unit}: {move.title} moved from {move.before:.3g} ({move.since}) to {move.now:.3g} "
        f"{move.measure} ({move.dataset}); 99 % interval of the difference "
        f"{move.ci99[0]:+.3g} to {move.ci99[1]:+.3g}."
        for move in moved
    ]


def drift_document(evaluations: Sequence[Evaluation], moved: Sequence[Move]) -> dict[str, Any]:
    """All of it as plain values for JSON."""
    return {
        "evaluations": [
            {
                "unit": item.unit,
                "held_out": item.held_out,
                "learnt_presses": item.learnt,
                **table_document(item.errors),
                "numbers": {
                    name: {
                        "title": number.title,
                        "unit": number.unit,
                        "mean": number.mean,
                        "ci95": list(number.ci95),
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
    }


def drift_sections(evaluations: Sequence[Evaluation], moved: Sequence[Move]) -> list[Section]:
    """A plot of every number, what moved, and all numbers in a table."""
    picture = Picture(
        content=plot_bytes(drift_figure(evaluations, moved)),
        alt="Each number over the data sets, with intervals; the table below has the values",
        caption="Means over presses with 95 % intervals. Filled: moved since the unit's first "
        "data set.",
        wide=True,
    )
    several = len({item.unit for item in evaluations}) < len(evaluations)
    said = sentences(moved)
    verdict = (
        paragraph(
            "A number has moved where the 99 % interval of its difference to the unit's first data "
            "set, by the scatter of presses (Welch's t), leaves out zero."
        )
        + (bullets(said) if said else paragraph("Nothing moved."))
        if several
        else paragraph("One data set of each unit: nothing to compare over time.")
    )
    seen = [item for item in evaluations if not item.held_out]
    note = (
        paragraph(
            "Units with a * have learnt from presses of that data set: their errors there are too "
            "low, and are not compared over time."
        )
        if seen
        else ""
    )
    return [
        Section(title="What moved", html=verdict + figure_html(picture)),
        Section(title="All numbers", html=note + _all_numbers(evaluations)),
    ]


def _all_numbers(evaluations: Sequence[Evaluation]) -> str:
    names = list(dict.fromkeys(name for item in evaluations for name in item.numbers))
    headings = [
        "number",
        *(f"{x.unit}{'' if x.held_out else '*'} on {x.dataset}" for x in evaluations),
    ]
    rows = []
    for name in names:
        some = next(item.numbers[name] for item in evaluations if name in item.numbers)
        cells = [value(item.numbers[name]) if name in item.numbers else "–" for item in evaluations]
        rows.append([f"{some.title} [{some.unit}]", *cells])
    return table_html("Means over presses; below each its 95 % interval.", headings, rows)


def value(number: Number) -> str:
    """A mean, and its interval on a line of its own, where there is one."""
    if len(number.sums) < 2:
        return f"{number.mean:.3g}"
    low, high = number.ci95
    return f"{number.mean:.3g}\n{low:.3g} to {high:.3g}"
