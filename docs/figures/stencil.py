# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Draw what the integrator solves: midpoint slopes, and the two borders."""

from itertools import product

from matplotlib.axes import Axes
from matplotlib.patches import Rectangle
from style import BLUE, BROWN, FAINT, INK, ORANGE, SOFT, arrow, bare, figure, save

ROWS, COLUMNS = 3, 4


def draw_pixels(axes: Axes) -> None:
    """Pixels of the frame with their centres."""
    for row, column in product(range(ROWS), range(COLUMNS)):
        axes.add_patch(Rectangle((column - 0.5, row - 0.5), 1, 1, fc="white", ec=FAINT, lw=1))
        axes.plot(column, row, "o", color=INK, ms=5)


def draw_midpoints(axes: Axes) -> None:
    """The slopes between neighbours."""
    for row, column in product(range(ROWS), range(COLUMNS - 1)):
        axes.plot(column + 0.5, row, ">", color=ORANGE, ms=5)
    for row, column in product(range(ROWS - 1), range(COLUMNS)):
        axes.plot(column, row + 0.5, "v", color=ORANGE, ms=5)


def draw_dirichlet(axes: Axes) -> None:
    """The zero ring just outside the frame."""
    axes.set_title("dirichlet: a ring of zeros outside")
    axes.add_patch(Rectangle((-1.5, -1.5), COLUMNS + 2, ROWS + 2, fc=FAINT, ec="none", zorder=0))
    draw_pixels(axes)
    draw_midpoints(axes)
    for column in range(COLUMNS):
        for row, mark in ((-1, -0.5), (ROWS, ROWS - 0.5)):
            axes.text(column, row, "0", ha="center", va="center", color=BLUE, weight="bold")
            axes.plot(column, mark, "v", color=ORANGE, ms=5)
    for row in range(ROWS):
        for column, mark in ((-1, -0.5), (COLUMNS, COLUMNS - 0.5)):
            axes.text(column, row, "0", ha="center", va="center", color=BLUE, weight="bold")
            axes.plot(mark, row, ">", color=ORANGE, ms=5)


def draw_neumann(axes: Axes) -> None:
    """No condition crosses the border."""
    axes.set_title("neumann: nothing crosses the border")
    draw_pixels(axes)
    draw_midpoints(axes)
    axes.add_patch(Rectangle((-0.5, -0.5), COLUMNS, ROWS, fc="none", ec=BLUE, lw=2))


def draw_stencil(axes: Axes) -> None:
    """One depth difference and the slope that it must match."""
    axes.set_title("One equation per pair of neighbours")
    for x, name in ((0, "j"), (2, "j+1")):
        axes.add_patch(Rectangle((x - 1, -1), 2, 2, fc="white", ec=SOFT, lw=1))
        axes.plot(x, 0, "o", color=INK, ms=7)
        axes.text(x, 0.36, f"$z_{{{name}}}$", ha="center", va="center", fontsize=11)
        axes.text(x, -0.4, f"$G_{{{name}}}$", ha="center", va="center", fontsize=11)
    axes.plot(1, 0, ">", color=ORANGE, ms=10, zorder=3)
    axes.text(
        4.0,
        0.34,
        r"$z_{j+1} - z_j \;=\; h \cdot \frac{G_j + G_{j+1}}{2}$",
        va="center",
        fontsize=14,
    )
    axes.text(
        4.0, -0.62, "▶ the slope halfway, the mean of two pixel centres", va="center", color=BROWN
    )
    arrow(axes, (0.0, -1.35), (2.0, -1.35), INK)
    arrow(axes, (2.0, -1.35), (0.0, -1.35), INK)
    axes.text(1.0, -1.62, "$h$ = mm per pixel", ha="center", va="center")
    axes.set_xlim(-1.2, 11)
    axes.set_ylim(-1.85, 1.1)


drawing = figure(7.4, 4.9)
grid = drawing.add_gridspec(2, 2, height_ratios=[1, 1.5])
draw_stencil(bare(drawing.add_subplot(grid[0, :])))
for place, draw in ((grid[1, 0], draw_dirichlet), (grid[1, 1], draw_neumann)):
    axes = bare(drawing.add_subplot(place))
    draw(axes)
    axes.set_xlim(-1.6, COLUMNS + 0.6)
    axes.set_ylim(ROWS + 0.6, -1.6)
save(drawing, __file__)
