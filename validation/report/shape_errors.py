# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Depth errors of units on shapes: in tables, as a page, and for machines."""

from collections.abc import Sequence
from dataclasses import asdict
from statistics import fmean
from typing import Any

from validation.drift import Number
from validation.intervals import counted, remark
from validation.report.drift import value
from validation.report.page import Section, table_html
from validation.shape_errors import ShapeErrors
from validation.shapes import TOUCHED
from validation.table_text import depth_document

HEADINGS = ["frame", "RMSE [mm]", "bias [mm]", "deepest, found [mm]", "true [mm]"]


def shape_rows(item: ShapeErrors) -> list[list[str]]:
    """A row for each shape, under ``HEADINGS``."""
    return [
        [
            error.file,
            f"{error.rmse_mm:.3f}",
            f"{error.bias_mm:+.3f}",
            f"{error.peak_mm:.3f}",
            f"{error.peak_truth_mm:.3f}",
        ]
        for error in item.depth
    ]


def shape_sentence(item: ShapeErrors) -> str:
    """What the numbers of a table of shapes are, and their mean."""
    found, true = (
        fmean(getattr(error, name) for error in item.depth) for name in ("peak_mm", "peak_truth_mm")
    )
    count = len(item.depth)
    return (
        f"Depth of frames without a circle, {item.unit} on {item.dataset}, {item.estimator}, all "
        f"lights, where the true skin is deeper than {100 * TOUCHED:g} % of its deepest, mean over "
        f"{counted(count)} against the truth file: RMSE {_mean(item.numbers['depth_rmse_mm'])}, "
        f"bias {_mean(item.numbers['depth_bias_mm'], '+')} (deepest {found:.2f} of {true:.2f} mm). "
        f"{remark('In brackets: the 95 % interval over presses', count)}; seed {item.seed}."
    )


def shape_summary(items: Sequence[ShapeErrors]) -> tuple[list[str], list[list[str]]]:
    """Headings and rows of a short table: a line for each unit on each data set."""
    titles = [f"{number.title} [{number.unit}]" for number in items[0].numbers.values()]
    rows = [
        [item.unit, item.dataset, str(len(item.depth)), *map(value, item.numbers.values())]
        for item in items
    ]
    return ["unit", "data", "shapes", *titles], rows


def shape_document(item: ShapeErrors) -> dict[str, Any]:
    """All of it as plain values for JSON."""
    rmse, bias = (item.numbers[f"depth_{name}"].ci95 for name in ("rmse_mm", "bias_mm"))
    return {
        "unit": item.unit,
        "dataset": item.dataset,
        "seed": item.seed,
        "estimator": item.estimator,
        **depth_document(item.depth),
        "ci95": {"rmse_mm": rmse and list(rmse), "bias_mm": bias and list(bias)},
        "moved_px": item.moved_px,
        "lit_otherwise": list(item.lit_otherwise),
        "left_out": [asdict(frame) for frame in item.left_out],
    }


def shape_section(items: Sequence[ShapeErrors]) -> Section:
    """A table for each unit on each data set."""
    tables = (table_html(shape_sentence(item), HEADINGS, shape_rows(item)) for item in items)
    return Section(title="Frames without a circle", html="".join(tables))


def _mean(number: Number, sign: str = "") -> str:
    """A mean in mm and, where there are presses enough, its interval."""
    mean, interval = f"{number.mean:{sign}.3f} mm", number.ci95
    if interval is None:
        return mean
    return f"{mean} [{interval[0]:{sign}.3f}, {interval[1]:{sign}.3f}]"
