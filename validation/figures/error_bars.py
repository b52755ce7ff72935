# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Angle errors per light configuration, with intervals."""

from collections.abc import Mapping, Sequence

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from sensor.unit import MissingAxis
from validation.error_table import Row, widest
from validation.figures.style import FAINT, HALF_IN, INK, SERIES, card, styled
from validation.intervals import whiskers
from validation.metrics import PixelSet
from validation.paper import PAPER_PIXELS, paper_errors
from validation.table_text import line_name

ANGLES: Mapping[str, str] = {"theta_x_deg": "θx error [°]", "theta_y_deg": "θy error [°]"}
PAPER = "paper, another sensor"
LINE_IN = 0.36
"""Height of a configuration."""
SPREAD = 0.34
"""Of the estimators around their configuration's line."""


@styled
def error_figure(rows: Sequence[Row], pixels: PixelSet) -> Figure:
    """Mean absolute angle errors over one set of pixels, one line a configuration.

    Points are means, whiskers press-level bootstrap 95 % intervals, where there are presses enough.
    The paper's values, of another sensor, stand beside the configurations and pixels that it has.
    """
    chosen = [row for row in rows if row.pixels == pixels]
    lines = widest(chosen)
    estimators = list(dict.fromkeys(row.estimator for row in chosen))
    figure = card(HALF_IN, 1.35 + LINE_IN * len(lines))
    panels = figure.subplots(1, 2, sharex=True, sharey=True)
    for axes, (metric, label) in zip(panels, ANGLES.items(), strict=True):
        for number, estimator in enumerate(estimators):
            offset = SPREAD * (number - (len(estimators) - 1) / 2) / max(1, len(estimators) - 1)
            measured = [row for row in chosen if row.estimator == estimator]
            _points(axes, measured, lines, number, offset, metric)
        if pixels == PAPER_PIXELS:
            _paper(axes, lines, metric)
        axes.set_xlabel(label)
        axes.grid(axis="x")
        axes.tick_params(axis="y", length=0)
        axes.spines["left"].set_visible(False)
        for line in range(len(lines)):
            axes.axhline(line, color=FAINT, lw=0.8, zorder=0)
    shown = [_upper(row, metric) for row in chosen for metric in ANGLES]
    if pixels == PAPER_PIXELS:
        shown += [value for metric in ANGLES for _, value in _papers(lines, metric)]
    panels[0].set_xlim(0, 1.04 * max(shown))
    panels[0].set_yticks(range(len(lines)), [line_name(*line) for line in lines], color=INK)
    panels[0].set_ylim(len(lines) - 0.5, -0.5)
    named = dict(zip(*reversed(panels[0].get_legend_handles_labels()), strict=True))
    named |= {PAPER: named.pop(PAPER)} if PAPER in named else {}  # last
    figure.legend(
        named.values(), named.keys(), loc="outside upper left", ncols=3, columnspacing=1.4
    )
    return figure


def _points(
    axes: Axes,
    rows: Sequence[Row],
    lines: Sequence[tuple[str, MissingAxis]],
    number: int,
    offset: float,
    metric: str,
) -> None:
    means = [row.errors.values[metric] for row in rows]
    places = [lines.index((row.configuration, row.missing_axis)) + offset for row in rows]
    axes.errorbar(
        means,
        places,
        xerr=whiskers(means, [row.errors.ci95[metric] for row in rows]),
        fmt="os^"[number % 3],
        color=SERIES[number % len(SERIES)],
        markersize=4.5,
        elinewidth=1.4,
        label=rows[0].estimator,
    )


def _upper(row: Row, metric: str) -> float:
    """Where its mark ends."""
    interval = row.errors.ci95[metric]
    return row.errors.values[metric] if interval is None else interval[1]


def _papers(lines: Sequence[tuple[str, MissingAxis]], metric: str) -> list[tuple[int, float]]:
    """The number of a line and the paper's value, where it can be held against it."""
    return [(lines.index(key), values[metric]) for key, values in paper_errors(lines).items()]


def _paper(axes: Axes, lines: Sequence[tuple[str, MissingAxis]], metric: str) -> None:
    found = _papers(lines, metric)
    if found:
        places, values = zip(*found, strict=True)
        axes.plot(values, places, "D", ms=5, mfc="white", mec=INK, mew=1, label=PAPER)
