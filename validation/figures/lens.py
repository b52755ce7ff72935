# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""A lens and the chessboards that it was measured on."""

import numpy as np
from jaxtyping import Float64
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from recon.geometry.lens import Boards, Lens, Points, board_misses_px, seen_share
from validation.figures.style import BLUE, FULL_IN, INK, ORANGE, SERIES, SOFT, card, styled

ARROW_SIDE = 0.05
"""Length of the largest miss, as a share of the frame's width."""
LINES, POINTS = 9, 101
"""Of the straight grid: lines along each axis, points along each line."""


@styled
def lens_figure(boards: Boards, lens: Lens) -> Figure:
    """Where the boards' corners were seen and how far off the lens; what it does to straight lines.

    The right panel shows a square grid as the lens shows it, and how far out corners were seen.
    """
    width, height = boards.frame_size_px
    figure = card(FULL_IN, 0.46 * FULL_IN * height / width + 1.0)
    corners, grid = figure.subplots(1, 2)
    for axes in (corners, grid):
        axes.set(
            xlim=(-0.5, width - 0.5), ylim=(height - 0.5, -0.5), xlabel="x [px]", ylabel="y [px]"
        )
        axes.set_aspect("equal")
        axes.spines[["top", "right"]].set_visible(True)
    _draw_corners(corners, boards, lens)
    _draw_grid(grid, boards, lens)
    figure.legend(*grid.get_legend_handles_labels(), loc="outside lower center", ncols=3)
    return figure


def _draw_corners(axes: Axes, boards: Boards, lens: Lens) -> None:
    misses = board_misses_px(boards, lens)
    largest_px = max(np.linalg.norm(miss, axis=1).max() for miss in misses.values())
    times = ARROW_SIDE * boards.frame_size_px[0] / max(largest_px, 1e-9)
    for number, (name, miss) in enumerate(misses.items()):
        x, y = boards.corners_px[name].T
        color = SERIES[number % len(SERIES)]
        axes.plot(x, y, ".", color=color, markersize=2)
        axes.quiver(
            *(x, y, *(times * miss).T),
            angles="xy", scale_units="xy", scale=1, color=color, width=0.002,
        )  # fmt: skip
    axes.set_title(
        f"corners of {len(misses)} boards; misses, {times:.0f} times as long, up to "
        f"{largest_px:.2f} px"
    )


def _draw_grid(axes: Axes, boards: Boards, lens: Lens) -> None:
    width, height = boards.frame_size_px
    frame = np.array([(x, y) for x in (-0.5, width - 0.5) for y in (-0.5, height - 0.5)])
    lines = _square_grid(lens.undistort(frame))
    for number, line in enumerate(lines):
        name = "_" if number else ""  # one line of each kind in the legend
        axes.plot(*line.T, ":", color=SOFT, lw=0.7, label=name or "straight lines")
        axes.plot(*lens.distort(line).T, color=BLUE, lw=1, label=name or "as the lens shows them")
    angle = np.linspace(0, 2 * np.pi, POINTS)
    radius_px = seen_share(boards, lens) * np.linalg.norm(frame - lens.center_px, axis=1).max()
    circle = np.stack([np.cos(angle), np.sin(angle)], 1) * radius_px + lens.center_px
    axes.plot(*circle.T, "--", color=ORANGE, label="as far out as corners were seen")
    axes.plot(*lens.center_px, "+", color=INK, markersize=9)
    axes.set_title(f"the lens; the corners are {lens.rms_px:.2f} px off it (root mean square)")


def _square_grid(around: Points) -> Float64[np.ndarray, "lines points 2"]:
    """Lines along both axes that fill the rectangle around some points."""
    (left, top), (right, bottom) = around.min(0), around.max(0)
    columns, rows = np.linspace(left, right, LINES), np.linspace(top, bottom, LINES)
    x, y = np.linspace(left, right, POINTS), np.linspace(top, bottom, POINTS)
    upright = [np.stack([np.full(POINTS, column), y], 1) for column in columns]
    level = [np.stack([x, np.full(POINTS, row)], 1) for row in rows]
    return np.stack(upright + level)
