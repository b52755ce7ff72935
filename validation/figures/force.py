# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Contact against the measured force."""

from collections.abc import Sequence

from matplotlib.figure import Figure

from validation.figures.style import FULL_IN, MARKS, SERIES, card, styled
from validation.force import ForceCurve


@styled
def force_figure(curves: Sequence[ForceCurve]) -> Figure:
    """Area and deepest point of each clip's frames over the force, joined in time."""
    figure = card(FULL_IN, 3.6)
    left, right = figure.subplots(1, 2)
    for number, curve in enumerate(curves):
        color, mark = SERIES[number % len(SERIES)], MARKS[number % len(MARKS)]
        name = curve.name.removeprefix("wedge-mit-").replace("-", " ")
        for axes, values in ((left, curve.area_mm2), (right, curve.deepest_mm)):
            axes.plot(curve.force_n, values, color=color, marker=mark, ms=3.5, lw=0.9, label=name)
    left.set(xlabel="measured force [N]", ylabel="disturbed skin [mm²]")
    right.set(xlabel="measured force [N]", ylabel="deepest point [mm], twin's calibration")
    for axes in (left, right):
        axes.grid()
        axes.set_xlim(left=min(-0.5, axes.get_xlim()[0]))
        axes.set_ylim(bottom=0)
    left.legend(loc="upper left")
    return figure
