# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Estimators side by side: where on the ball they err, how with the slope, and their intervals."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from validation.figures import maps
from validation.figures.style import FULL_IN, INK, MARKS, SERIES, SOFT, styled
from validation.side_by_side import LEAST_PIXELS, Unseen, by_steepness, covered, error_map_deg

FINEST, COARSEST, SLOPE_BINS = 45, 7, 16
PIXELS_A_BIN = 2 * LEAST_PIXELS
"""On average over a map."""
MARGIN, GAP, AXIS_IN = 0.1, 0.25, 0.5
MAP_IN, PLOT_IN = 2.0, 2.0
SHOWN_SHARE = 0.995
"""Of the pixels, the steepest left out, that the axes reach."""
NOMINAL = 0.9
NO_INTERVAL = "none of these estimators reports an interval"


@styled
def side_by_side_figure(unseen: Sequence[Unseen]) -> Figure:
    """A map an estimator, then error and coverage against the slope."""
    columns = len(unseen)
    figure = maps.blank(FULL_IN, MARGIN + maps.TITLE_IN + MAP_IN + 0.45 + PLOT_IN + AXIS_IN)
    steepest = float(np.quantile(unseen[0].steepness, SHOWN_SHARE))
    reach = steepest / np.sqrt(1 + steepest**2)
    pixels = min(len(item.truth) for item in unseen)
    bins = int(np.clip(np.sqrt(pixels / PIXELS_A_BIN), COARSEST, FINEST))
    found = [error_map_deg(item, bins, reach) for item in unseen]
    shown = np.concatenate([values[np.isfinite(values)] for values in found])
    worst = float(np.quantile(shown, 0.98)) if len(shown) else 1.0
    side = min(
        MAP_IN, (FULL_IN - 2 * MARGIN - maps.BAR_LABELS_IN - (columns - 1) * GAP) / columns - 0.1
    )
    for index, (item, values) in enumerate(zip(unseen, found, strict=True)):
        left = MARGIN + index * (side + GAP)
        box = maps.Box(left=left, top=MARGIN + maps.TITLE_IN, width=side, height=side)
        mean = item.error_deg.mean()
        image = maps.show_map(
            figure,
            box,
            values,
            (1.0, 1.0),
            f"{item.estimator}: {mean:.2f}°",
            colors="cividis",
            limits=(0.0, worst),
        )
    maps.color_bar(figure, image, "angle error [°]")
    top = MARGIN + maps.TITLE_IN + side + 0.45
    width = (FULL_IN - 2 * (MARGIN + AXIS_IN + GAP)) / 2
    plots = [
        maps.Box(
            left=MARGIN + AXIS_IN + index * (width + AXIS_IN + GAP),
            top=top,
            width=width,
            height=PLOT_IN,
        ).axes(figure)
        for index in range(2)
    ]
    edges = np.linspace(0, steepest, SLOPE_BINS + 1)
    middles = (edges[:-1] + edges[1:]) / 2
    for index, item in enumerate(unseen):
        look: dict[str, Any] = {
            "color": SERIES[index % len(SERIES)],
            "marker": MARKS[index % len(MARKS)],
            "ms": 4,
        }
        error_deg = by_steepness(item, item.error_deg, edges)
        plots[0].plot(middles, error_deg, **look, label=item.estimator)
        inside = covered(item)
        if inside is not None:
            label = f"{item.estimator}: {100 * inside.mean():.0f} % of all"
            coverage = 100 * by_steepness(item, inside, edges)
            plots[1].plot(middles, coverage, **look, label=label)
    plots[0].set_ylim(bottom=0)
    if not plots[1].lines:
        middle = plots[1].transAxes
        plots[1].text(0.5, 0.5, NO_INTERVAL, color=SOFT, transform=middle, ha="center", va="center")
    plots[1].axhline(100 * NOMINAL, color=INK, lw=0.9, ls=(0, (4, 2)), label="90 %")
    lowest = float(plots[1].get_ylim()[0])
    plots[1].set_ylim(np.clip(lowest, 0, 50), 100)  # with what covers less than half
    titles = ("mean angle error [°]", "truths inside the 90 % interval [%]")
    for axes, title in zip(plots, titles, strict=True):
        axes.set_title(title)
        axes.set_xlabel("true slope [mm/mm]")
        axes.grid()
        axes.legend()
    return figure
