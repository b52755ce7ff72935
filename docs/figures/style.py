# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""What the drawings share: a white card, and colours that colour-blind readers tell apart.

Every other script in this folder draws the picture of the same name beside itself.
"""

from pathlib import Path

import matplotlib
from matplotlib.axes import Axes
from matplotlib.figure import Figure

# Okabe and Ito, Color Universal Design, 2008.
BLUE, ORANGE, GREEN, RED, SKY = "#0072B2", "#E69F00", "#009E73", "#D55E00", "#56B4E9"
BROWN = "#8a5f00"  # the orange, dark enough for words
INK, SOFT, FAINT = "#1b1f24", "#6b7280", "#e5e7eb"
GEL = "#dbe7ee"
LIGHTS = {"R": RED, "G": GREEN, "B": BLUE}

matplotlib.rcParams.update(
    {
        "font.family": "DejaVu Sans",
        "font.size": 9,
        "text.color": INK,
        "axes.labelcolor": INK,
        "axes.edgecolor": SOFT,
        "axes.titlesize": 10,
        "axes.titlelocation": "left",
        "xtick.color": SOFT,
        "ytick.color": SOFT,
        "mathtext.fontset": "dejavusans",
        "svg.hashsalt": "gelsight-wedge",  # the same drawing gives the same file
    }
)


def figure(width_in: float, height_in: float) -> Figure:
    """An empty white card."""
    return Figure(figsize=(width_in, height_in), facecolor="white", layout="constrained")


def bare(axes: Axes) -> Axes:
    """Axes for a drawing: no frame, no ticks."""
    axes.set_axis_off()
    axes.set_aspect("equal")
    return axes


def arrow(axes: Axes, tail: tuple[float, float], head: tuple[float, float], color: str) -> None:
    """A straight arrow."""
    style = {"arrowstyle": "-|>", "color": color, "lw": 1.6, "shrinkA": 0, "shrinkB": 0}
    axes.annotate("", xy=head, xytext=tail, arrowprops=style)


def measure(axes: Axes, tail: tuple[float, float], head: tuple[float, float]) -> None:
    """A dimension line."""
    style = {"arrowstyle": "<|-|>", "color": INK, "lw": 1, "shrinkA": 0, "shrinkB": 0}
    axes.annotate("", xy=head, xytext=tail, arrowprops=style)


def save(drawing: Figure, script: str) -> None:
    """Write the drawing as SVG beside its script."""
    drawing.savefig(Path(script).with_suffix(".svg"), metadata={"Date": None, "Creator": None})
