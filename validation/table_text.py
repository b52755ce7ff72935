# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""The error table as JSON, Markdown and HTML."""

import html
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict
from statistics import fmean
from typing import Any

from sensor.unit import MissingAxis
from validation.depth import DepthErrors
from validation.error_table import ErrorTable, Row
from validation.intervals import counted, remark
from validation.metrics import METRICS, PIXEL_SETS, Errors

HEADINGS = {
    "gx_mae": "Gx",
    "gy_mae": "Gy",
    "theta_x_deg": "θx [°]",
    "theta_y_deg": "θy [°]",
}
DIGITS = {"gx_mae": 3, "gy_mae": 3, "theta_x_deg": 2, "theta_y_deg": 2}


def table_document(table: ErrorTable) -> dict[str, Any]:
    """The table as plain values for JSON; ``None`` for intervals of too few presses."""
    return {
        "dataset": table.dataset,
        "presses": {"train": table.train, "test": table.test},
        "folds": table.folds,
        "seed": table.seed,
        "mean_abs_gradient": {
            pixels: row.errors.mean_abs_gradient
            for pixels in PIXEL_SETS
            for row in table.rows
            if row.pixels == pixels
        },
        "rows": [
            {
                "configuration": row.configuration,
                "missing_axis": row.missing_axis,
                "estimator": row.estimator,
                "pixels": row.pixels,
                **row.errors.values,
                "mean_abs_gradient": row.errors.mean_abs_gradient,
                "n_pixels": row.errors.n_pixels,
                "n_presses": row.errors.n_presses,
                "ci95": {
                    name: interval and list(interval) for name, interval in row.errors.ci95.items()
                },
            }
            for row in table.rows
        ],
        "depth": [
            {"estimator": estimator, **depth_document(errors)}
            for estimator, errors in table.depth.items()
            if errors
        ],
        "left_out": [asdict(press) for press in table.left_out],
    }


def depth_document(errors: Sequence[DepthErrors]) -> dict[str, Any]:
    """Depth errors of some presses as plain values, means over presses first."""
    return {
        "truth": " and ".join(sorted({error.truth for error in errors})),
        "n_presses": len(errors),
        "rmse_mm": fmean(error.rmse_mm for error in errors),
        "bias_mm": fmean(error.bias_mm for error in errors),
        "peak_mm": fmean(error.peak_mm for error in errors),
        "peak_truth_mm": fmean(error.peak_truth_mm for error in errors),
        "presses": [
            {
                "file": error.file,
                "rmse_mm": error.rmse_mm,
                "bias_mm": error.bias_mm,
                "peak_mm": error.peak_mm,
                "peak_truth_mm": error.peak_truth_mm,
            }
            for error in errors
        ],
    }


def caption(table: ErrorTable) -> str:
    """One sentence that says what the numbers of a table are."""
    split = split_words(table.train, table.test, table.folds)
    brackets = remark("In brackets: the press-level bootstrap 95 % interval", table.test)
    zero = any(row.missing_axis == "zero" for row in table.rows)
    return (
        f"Mean absolute gradient errors on {table.dataset} (ball radius {table.balls}; "
        f"{split}; seed {table.seed}). Contact pixels lie inside the labelled circle less one "
        "pixel and inside 0.9 of the ball's radius, so slopes stay below 2.07; contact+5% adds "
        f"5 % of the pixels beyond 1.3 contact radii. {brackets}"
        + "; w/o network sets the unseen axis to zero" * zero
        + "."
    )


def split_words(train: int, test: int, folds: int) -> str:
    """How presses were parted, in words."""
    trained = f"{folds}-fold by press" if folds > 1 else f"trained on {counted(train)}"
    return f"{trained}, tested on {counted(test)}"


def depth_sentence(estimator: str, depth: Mapping[str, Any]) -> str:
    """One sentence on an estimator's ``depth_document``."""
    return (
        f"Depth in the contact, {estimator}, all lights, mean over {counted(depth['n_presses'])} "
        f"against the {depth['truth']}: RMSE {depth['rmse_mm']:.3f} mm, bias "
        f"{depth['bias_mm']:+.3f} mm (peaks {depth['peak_mm']:.2f} of "
        f"{depth['peak_truth_mm']:.2f} mm)."
    )


def line_name(configuration: str, missing_axis: MissingAxis) -> str:
    """A configuration as tables and figures name it."""
    stands_in = {"none": "", "zero": " (w/o network)", "network": " + network"}
    return configuration + stands_in[missing_axis]


def row_cells(row: Row) -> list[str]:
    """The text of a row's cells: lights, estimator, pixels, the errors, mean |G|, n."""
    errors = row.errors
    return [
        line_name(row.configuration, row.missing_axis),
        row.estimator,
        row.pixels,
        *(value_cell(errors, name) for name in METRICS),
        f"{errors.mean_abs_gradient:.3f}",
        f"{errors.n_pixels}",
    ]


def value_cell(errors: Errors, name: str) -> str:
    """A mean and, where there are presses enough, its interval."""
    digits = DIGITS[name]
    mean, interval = f"{errors.values[name]:.{digits}f}", errors.ci95[name]
    if interval is None:
        return mean
    return f"{mean} [{interval[0]:.{digits}f}, {interval[1]:.{digits}f}]"


def column_headings() -> list[str]:
    """Headings of ``row_cells``."""
    return ["lights", "estimator", "pixels", *HEADINGS.values(), "mean |G|", "n pixels"]


def table_markdown(table: ErrorTable) -> str:
    """The table and its caption as Markdown."""
    headings = [heading.replace("|", "\\|") for heading in column_headings()]
    lines = [_markdown_line(headings), _markdown_line(["---"] * len(headings))]
    lines += [_markdown_line(row_cells(row)) for row in table.rows]
    return "\n".join([*lines, "", caption(table), ""])


def error_table_html(table: ErrorTable) -> str:
    """The table and its caption as an HTML ``table`` element."""
    head = "".join(f'<th scope="col">{html.escape(text)}</th>' for text in column_headings())
    body = "\n".join(f"<tr>{_html_cells(row_cells(row))}</tr>" for row in table.rows)
    return (
        f"<table>\n<caption>{html.escape(caption(table))}</caption>\n"
        f"<thead><tr>{head}</tr></thead>\n<tbody>\n{body}\n</tbody>\n</table>\n"
    )


def _markdown_line(cells: Iterable[str]) -> str:
    return "| " + " | ".join(cells) + " |"


def _html_cells(cells: Sequence[str]) -> str:
    first, *rest = (html.escape(cell) for cell in cells)
    return f'<th scope="row">{first}</th>' + "".join(f"<td>{cell}</td>" for cell in rest)
