# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Numbers of units over their data sets, one panel a number, with intervals."""

from collections.abc import Sequence
from textwrap import wrap

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from validation.drift import ERRORS, Evaluation, Move
from validation.figures.style import FULL_IN, SERIES, SOFT, card, styled
from validation.intervals import whiskers

ROWS = (
    ERRORS,
    ("brightness_R", "brightness_G", "brightness_B", "noise"),
    ("answer_R", "answer_G", "answer_B"),
)
"""Of panels, by the numbers' names."""
PANEL_IN, NAMES_IN, LEGEND_IN = 1.45, 0.4, 0.3
"""Height of a panel, of the data sets' names below the last row, of the legend."""
NAMES_LETTERS = 110
SIDEWAYS = 0.16
"""Between the units of one data set."""


@styled
def drift_figure(evaluations: Sequence[Evaluation], moved: Sequence[Move]) -> Figure:
    """Means and 95 % intervals over presses; what moved (``drift.moves``) is filled.

    Args:
        evaluations: in the order of their dates.
        moved: as found among them.
    """
    known = {name: number for item in evaluations for name, number in item.numbers.items()}
    rows = [row for names in ROWS if (row := [name for name in names if name in known])]
    columns = max(map(len, rows))
    figure = card(FULL_IN, PANEL_IN * len(rows) + NAMES_IN + LEGEND_IN)
    panels = figure.subplots(len(rows), columns, sharex=True, squeeze=False)
    units = list(dict.fromkeys(item.unit for item in evaluations))
    sets = list(dict.fromkeys(item.dataset for item in evaluations))
    for line, row in zip(panels, rows, strict=True):
        for axes, name in zip(line, row, strict=False):
            for number, unit in enumerate(units):
                _series(axes, [x for x in evaluations if x.unit == unit], name, sets, number, moved)
            axes.set(title=known[name].title, ylabel=f"[{known[name].unit}]")
            axes.grid(axis="y")
            axes.margins(x=0.12, y=0.15)
        for axes in line[len(row) :]:
            axes.set_visible(False)
    first = panels[0, 0]
    first.set_xticks(range(len(sets)), [str(number + 1) for number in range(len(sets))])
    for column in range(columns):
        lowest = [axes for axes in panels[:, column] if axes.get_visible()][-1]
        lowest.tick_params(axis="x", labelbottom=True)
    named = ",  ".join(f"{number}: {name}" for number, name in enumerate(sets, start=1))
    figure.supxlabel("\n".join(wrap(named, NAMES_LETTERS)), fontsize=8.5, color=SOFT)
    handles, labels = first.get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper left", ncols=4, columnspacing=1.4)
    return figure


def _series(
    axes: Axes,
    evaluations: Sequence[Evaluation],
    name: str,
    sets: Sequence[str],
    number: int,
    moved: Sequence[Move],
) -> None:
    shown = [item for item in evaluations if name in item.numbers]
    if not shown:  # a unit that lacks this light
        return
    places = [sets.index(item.dataset) + SIDEWAYS * number for item in shown]
    means = [item.numbers[name].mean for item in shown]
    color = SERIES[number % len(SERIES)]
    axes.plot(places, means, color=SOFT, lw=0.8, zorder=1)
    axes.errorbar(
        places,
        means,
        yerr=whiskers(means, [item.numbers[name].ci95 for item in shown]),
        fmt="os^"[number % 3],
        color=color,
        mfc="white",
        markersize=5,
        elinewidth=1.3,
        label=shown[0].unit,
    )
    of_unit = {(move.dataset, move.name) for move in moved if move.unit == shown[0].unit}
    filled = [
        (place, mean)
        for place, mean, item in zip(places, means, shown, strict=True)
        if (item.dataset, name) in of_unit
    ]
    if filled:
        axes.plot(
            *zip(*filled, strict=True), "os^"[number % 3], color=color, markersize=6, zorder=5
        )
