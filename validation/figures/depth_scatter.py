# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Reconstructed depth against the truth, press by press."""

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.figure import Figure

from validation.depth import DepthErrors
from validation.figures.style import HALF_IN, INK, SERIES, SOFT, card, styled

HEIGHT_IN = 3.5


@styled
def peak_figure(errors: Mapping[str, Sequence[DepthErrors]]) -> Figure:
    """Depth at the contact's centre against the truth, a point a press, by estimator."""
    figure = card(HALF_IN, HEIGHT_IN)
    axes = figure.add_subplot()
    everything = [
        depth
        for presses in errors.values()
        for error in presses
        for depth in (error.peak_mm, error.peak_truth_mm)
    ]
    room = 0.08 * (max(everything) - min(everything)) + 0.02 * max(everything)
    ends = (min(everything) - room, max(everything) + room)
    axes.plot(ends, ends, color=SOFT, lw=1, ls=(0, (4, 2)), label="exact")
    for number, (estimator, presses) in enumerate(errors.items()):
        axes.plot(
            [error.peak_truth_mm for error in presses],
            [error.peak_mm for error in presses],
            "os^"[number % 3],
            ms=4.5,
            color=SERIES[number % len(SERIES)],
            alpha=0.75,
            mec="none",
            label=estimator,
        )
    axes.set(xlim=ends, ylim=ends)
    axes.set_xlabel("true depth at the centre [mm]")
    axes.set_ylabel("reconstructed [mm]")
    axes.grid()
    axes.legend(loc="upper left")
    return figure


@styled
def rmse_figure(errors: Mapping[str, Sequence[DepthErrors]]) -> Figure:
    """Share of presses whose depth RMSE in the contact is below a value, by estimator."""
    figure = card(HALF_IN, HEIGHT_IN)
    axes = figure.add_subplot()
    end_mm = 1.05 * max(error.rmse_mm for presses in errors.values() for error in presses)
    for number, (estimator, presses) in enumerate(errors.items()):
        values = np.sort([error.rmse_mm for error in presses])
        median = float(np.median(values))
        axes.step(
            [0.0, *values, end_mm],
            100 * np.array([*range(len(values) + 1), len(values)]) / len(values),
            where="post",
            color=SERIES[number % len(SERIES)],
            ls=("-", (0, (5, 1.5)), ":")[number % 3],
            label=f"{estimator}, median {median:.3f} mm",
        )
    axes.axhline(50, color=INK, lw=0.8, ls=":")
    axes.set_xlabel("depth RMSE in the contact [mm]")
    axes.set_ylabel("presses below this value [%]")
    axes.set(ylim=(0, 102), yticks=range(0, 101, 25))
    axes.set_xlim(0, end_mm)
    axes.grid()
    axes.legend()
    return figure
