# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Integrate exact slopes of three balls with the faults that public solvers of the field have."""

import numpy as np
from matplotlib.axes import Axes
from scipy import fft
from style import INK, RED, SOFT, figure, save

from recon.ball import ball_cap
from recon.integration.poisson import integrate

HEIGHT, WIDTH = 240, 320
PLACES = ((60.0, 70.0, 30.0), (160.0, 150.0, 45.0), (255.0, 90.0, 36.0))
BALL_PX = 60.0
CUT_ROW = 150

Grid = np.ndarray


def three_caps() -> tuple[Grid, Grid]:
    """Depth and gradient, in pixels, sampled at pixel centres."""
    caps = [
        ball_cap((WIDTH, HEIGHT), (x, y), radius, BALL_PX, (1.0, 1.0)) for x, y, radius in PLACES
    ]
    return sum(cap.depth_mm for cap in caps), sum(cap.gradient for cap in caps)


def sine_mismatch(gradient: Grid) -> Grid:
    """A type-2 sine transform, divided by the eigenvalues of type 1; one-sided differences."""
    slope_x, slope_y = gradient[..., 0], gradient[..., 1]
    divergence = np.zeros((HEIGHT, WIDTH))
    divergence[:, 1:] += np.diff(slope_x, axis=1)
    divergence[1:] += np.diff(slope_y, axis=0)
    inner = divergence[1:-1, 1:-1]
    across = 2 * np.cos(np.pi * np.arange(1, WIDTH - 1) / (WIDTH - 1)) - 2
    down = 2 * np.cos(np.pi * np.arange(1, HEIGHT - 1) / (HEIGHT - 1)) - 2
    spectrum = fft.dstn(inner, type=2) / (down[:, None] + across[None, :])
    return np.pad(fft.idstn(spectrum, type=2), 1)


def cosine_from_one(gradient: Grid) -> Grid:
    """A cosine transform whose frequencies count from 1, not from 0."""
    between_x = np.pad((gradient[:, :-1, 0] + gradient[:, 1:, 0]) / 2, ((0, 0), (1, 1)))
    between_y = np.pad((gradient[:-1, :, 1] + gradient[1:, :, 1]) / 2, ((1, 1), (0, 0)))
    divergence = np.diff(between_x, axis=1) + np.diff(between_y, axis=0)
    across = 2 * np.cos(np.pi * np.arange(1, WIDTH + 1) / WIDTH) - 2
    down = 2 * np.cos(np.pi * np.arange(1, HEIGHT + 1) / HEIGHT) - 2
    spectrum = fft.dctn(divergence, type=2) / (down[:, None] + across[None, :])
    return fft.idctn(spectrum, type=2)


def lost_half(gradient: Grid) -> Grid:
    """A cosine transform as it should be, of a divergence that lost its factor."""
    return integrate(gradient, (1.0, 1.0), "neumann") / 2


SOLVERS = {
    "sine types 2 and 1 mixed,\none-sided differences": sine_mismatch,
    "cosine frequencies\nfrom 1": cosine_from_one,
    "a factor ½ lost": lost_half,
    "here": lambda gradient: integrate(gradient, (1.0, 1.0), "dirichlet"),
}


def errors(depth: Grid, truth: Grid) -> tuple[float, float]:
    """RMSE in percent of the greatest depth, and the scale that fits best, offset removed."""
    centered, true = depth - depth.mean(), truth - truth.mean()
    rmse = np.sqrt(np.mean((centered - true) ** 2)) / truth.max()
    return 100 * float(rmse), float((centered * true).sum() / (true**2).sum())


def draw(axes: Axes, name: str, depth: Grid, truth: Grid) -> None:
    """One solver's cut through the largest ball."""
    rmse, scale = errors(depth, truth)
    shown = depth - np.median(depth[truth == 0])
    axes.plot(truth[CUT_ROW], color=INK, lw=4, alpha=0.25)
    axes.plot(shown[CUT_ROW], color=RED if name != "here" else INK, lw=1.3)
    axes.set_title(name, fontsize=9)
    axes.set_xlabel(f"RMSE {rmse:.2f} %\nscale {scale:.3f}")
    axes.axhline(0, color=SOFT, lw=0.5)
    axes.set_xticks([])
    axes.spines[["top", "right", "bottom"]].set_visible(False)


if __name__ == "__main__":
    truth, gradient = three_caps()
    drawing = figure(7.4, 2.5)
    row = drawing.subplots(1, 4, sharey=True)
    for axes, (name, solve) in zip(row, SOLVERS.items(), strict=True):
        draw(axes, name, solve(gradient), truth)
    row[0].set_ylabel("depth  [px]")
    row[0].invert_yaxis()
    save(drawing, __file__)
