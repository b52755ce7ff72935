# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Gradient error against true slope: shows where an estimator is biased."""

import numpy as np
from jaxtyping import Float
from matplotlib.figure import Figure

from validation.figures.style import BLUE, HALF_IN, INK, card, styled

HEIGHT_IN = 3.1
BINS = 32
"""Of true values."""
LEAST_PIXELS = 50
"""A bin with fewer is left out."""
BANDS = ((5, 95, 0.18, "90 % of the pixels"), (25, 75, 0.38, "50 % of the pixels"))


@styled
def gradient_figure(estimated: Float[np.ndarray, "n 2"], truth: Float[np.ndarray, "n 2"]) -> Figure:
    """Signed error of Gx and Gy against the true value: median and bands of its quantiles."""
    figure = card(HALF_IN, HEIGHT_IN)
    panels = figure.subplots(1, 2, sharex=True, sharey=True)
    for axes, index in zip(panels, (0, 1), strict=True):
        centers, quantiles = _quantiles(truth[:, index], estimated[:, index])
        axes.axhline(0, color=INK, lw=0.8, ls=(0, (4, 2)))
        for low, high, alpha, label in BANDS:
            axes.fill_between(
                centers,
                quantiles[:, PERCENTS.index(low)],
                quantiles[:, PERCENTS.index(high)],
                color=BLUE,
                alpha=alpha,
                lw=0,
                label=label,
            )
        axes.plot(centers, quantiles[:, PERCENTS.index(50)], color=BLUE, label="median")
        axes.set_xlabel(f"true G{'xy'[index]} [mm/mm]")
        axes.grid()
    panels[0].set_ylabel("estimated − true [mm/mm]")
    handles, labels = panels[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper left", ncols=3, columnspacing=1.2)
    return figure


PERCENTS = (5, 25, 50, 75, 95)


def _quantiles(
    truth: Float[np.ndarray, " n"], estimated: Float[np.ndarray, " n"]
) -> tuple[Float[np.ndarray, " b"], Float[np.ndarray, "b 5"]]:
    """Centres of the filled bins and the error's percentiles in each."""
    reach = max(float(np.abs(truth).max(initial=0.0)), 1e-6)
    edges = np.linspace(-reach, reach, BINS + 1)
    place = np.clip(np.digitize(truth, edges) - 1, 0, BINS - 1)
    least = min(LEAST_PIXELS, len(truth) // BINS)
    filled = [b for b in range(BINS) if np.count_nonzero(place == b) > least]
    error = estimated - truth
    values = [np.percentile(error[place == b], PERCENTS) for b in filled]
    centers = (edges[:-1] + edges[1:]) / 2
    return centers[filled], np.array(values, dtype=float).reshape(len(filled), len(PERCENTS))
