# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""The error table as the paper prints it: configurations side by side."""

from validation.error_table import ErrorTable, Row, widest
from validation.figures.depth_scatter import rmse_figure
from validation.figures.error_bars import error_figure
from validation.figures.png import plot_bytes
from validation.intervals import counted, remark
from validation.metrics import PIXEL_SETS, PixelSet
from validation.paper import PAPER_PIXELS, paper_errors
from validation.report.page import Picture, Section, gallery_html, table_html
from validation.table_text import DIGITS, HEADINGS, line_name

PAPER = "paper"
PAPERS_MARKS = " Diamonds: the paper's values, from another sensor."


def error_tables(table: ErrorTable) -> list[str]:
    """As the paper's Table I: configurations side by side, all lights first, errors below.

    A narrow page shows the first columns; those of fewer lights are reached by scrolling.
    """
    return [_error_table(table, pixels) for pixels in reversed(PIXEL_SETS)]


def table_section(table: ErrorTable) -> Section:
    """A dataset's tables with their plots, as a section named like it."""
    intervals = remark(f"bars are 95 % intervals over {counted(table.test)}", table.test)
    pictures = error_pictures(table, intervals)
    if any(table.depth.values()):
        rmse = Picture(
            content=plot_bytes(rmse_figure(table.depth)),
            alt="Cumulative share of presses by depth RMSE, one curve per estimator",
            caption="Depth RMSE in the contact, all lights: share of presses below each value.",
        )
        pictures.append(rmse)
    return Section(title=table.dataset, html="".join(error_tables(table)) + gallery_html(pictures))


def error_pictures(table: ErrorTable, intervals: str) -> list[Picture]:
    """The tables' angle errors as plots, in the tables' order.

    Args:
        table: of one dataset.
        intervals: what the captions say of them.
    """
    return [
        Picture(
            content=plot_bytes(error_figure(table.rows, pixels)),
            alt=f"Errors of θx and θy per light configuration and estimator, pixels {pixels}; the "
            "table above lists the numbers",
            caption=f"Angle errors per light configuration, pixels {pixels}; {intervals}."
            + PAPERS_MARKS * (pixels == PAPER_PIXELS),
        )
        for pixels in reversed(PIXEL_SETS)
    ]


def _error_table(table: ErrorTable, pixels: PixelSet) -> str:
    chosen = {
        (row.estimator, row.configuration, row.missing_axis): row
        for row in table.rows
        if row.pixels == pixels
    }
    columns = widest([row for row in table.rows if row.pixels == pixels])
    columns.sort(key=lambda column: len(column[0]), reverse=True)
    estimators = list(dict.fromkeys(key[0] for key in chosen))
    rows, from_paper, papers = [], [], paper_errors(columns)
    for metric, heading in HEADINGS.items():
        rows += [
            [
                f"{heading} {name}",
                *(
                    number_cell(chosen[name, *column], metric) if (name, *column) in chosen else "–"
                    for column in columns
                ),
            ]
            for name in estimators
        ]
        if pixels == PAPER_PIXELS and papers:
            from_paper.append(f"{heading} {PAPER}")
            numbers = (
                f"{papers[column][metric]:.{DIGITS[metric]}f}" if column in papers else "–"
                for column in columns
            )
            rows.append([from_paper[-1], *numbers])
    some = next(iter(chosen.values())).errors
    which = (
        "Contact pixels: inside the labelled circle less one pixel and inside 0.9 of the ball's "
        "radius, so slopes stay below 2.07."
        if pixels == "contact"
        else "Contact pixels and 5 % of those beyond 1.3 contact radii, as in the paper."
    )
    beside = f" Rows named {PAPER}: its Table I, from another sensor." if from_paper else ""
    intervals = remark(
        "The press-level bootstrap 95 % interval is below each value", some.n_presses
    )
    return table_html(
        f"Mean absolute errors on {table.dataset}, pixels: {pixels}. {which} "
        f"{counted(some.n_presses)}, {some.n_pixels:,} pixels, mean |G| = (|Gx| + |Gy|) / 2 of "
        f"{some.mean_abs_gradient:.3f}. {intervals}.{beside}",
        ["error", *(line_name(*column) for column in columns)],
        rows,
        notes=from_paper,
    )


def number_cell(row: Row, metric: str) -> str:
    """A mean with its interval on a line of its own, where it has one."""
    mean, interval = f"{row.errors.values[metric]:.{DIGITS[metric]}f}", interval_text(row, metric)
    return f"{mean}\n{interval}" if interval else mean


def interval_text(row: Row, metric: str) -> str:
    """The 95 % interval of a mean; empty where it has none."""
    interval = row.errors.ci95[metric]
    return "–".join(f"{end:.{DIGITS[metric]}f}" for end in interval or ())
