# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""A design's field against what its twin predicts."""

import math
from collections.abc import Sequence

from matplotlib.figure import Figure

from validation.figures.style import BLUE, FULL_IN, INK, ORANGE, card, styled
from validation.intervals import whiskers
from validation.sweep import SweepPoint

ASIDE = 0.008
"""Of the range of values, that a mark stands beside its own."""
HEADROOM = 1.06
"""Above the highest mark, so that it is whole."""
CHARACTER = 0.022
"""Of the range of values: as wide as a character of a tick."""
AXES = {"gx_mae": ("Gx", "o", BLUE), "gy_mae": ("Gy", "s", ORANGE)}


@styled
def sweep_figure(field: str, points: Sequence[SweepPoint]) -> Figure:
    """Gradient errors in the contact with intervals, and the lit share of the pad.

    Values that are numbers stand at their place, others side by side.
    """
    figure = card(FULL_IN, 3.2)
    errors, area = figure.subplots(1, 2)
    places, names = _places([point.value for point in points])
    order = sorted(range(len(places)), key=places.__getitem__)  # as typed, lines might double back
    places, points = [places[index] for index in order], [points[index] for index in order]
    # Side by side, so that neither's interval hides the other's.
    aside = 0.06 if names is not None else ASIDE * (max(places) - min(places))
    for sign, (metric, (name, mark, color)) in zip((-1, 1), AXES.items(), strict=True):
        means = [point.contact.errors.values[metric] for point in points]
        errors.errorbar(
            [place + sign * aside for place in places],
            means,
            yerr=whiskers(means, [point.contact.errors.ci95[metric] for point in points]),
            fmt=f"{mark}-" if names is None else mark,
            color=color,
            markersize=5,
            elinewidth=1.2,
            capsize=3,
            label=name,
        )
    area.plot(places, [100 * point.lit_area for point in points],
              "o-" if names is None else "o", color=INK, markersize=5)  # fmt: skip
    errors.set(ylabel="error of the gradient [mm/mm]", xlabel=field)
    highest = max(
        max([point.contact.errors.values[metric], *(point.contact.errors.ci95[metric] or ())])
        for point in points
        for metric in AXES
    )
    errors.set_ylim(0, HEADROOM * highest)
    area.set(ylabel="lit share of the pad [%]", xlabel=field, ylim=(0, 103))
    errors.legend(loc="lower left", ncols=2)
    for axes in (errors, area):
        axes.grid(axis="y")
        axes.set_xticks(places, names or _ticks(places, [point.value for point in points]))
        if names is not None:
            axes.set_xlim(-0.5, len(names) - 0.5)
    return figure


def _ticks(places: Sequence[float], values: Sequence[str]) -> list[str]:
    """The values, without those that would be written over the one before."""
    ticks: list[str] = []
    last, width = -math.inf, max(places) - min(places)
    for place, value in zip(places, values, strict=True):
        room = CHARACTER * max(len(value), 2) * width
        ticks.append(value if place - last >= room else "")
        last = place if ticks[-1] else last
    return ticks


def _places(values: Sequence[str]) -> tuple[list[float], list[str] | None]:
    try:
        return [float(value) for value in values], None
    except ValueError:
        return [float(index) for index in range(len(values))], list(values)
