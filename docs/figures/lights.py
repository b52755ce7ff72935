# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Draw the paper's four light configurations and the gradients that each of them sees."""

from matplotlib.axes import Axes
from matplotlib.patches import Rectangle
from style import GEL, INK, LIGHTS, SOFT, bare, figure, save

from recon.lights import unseen_axis
from sensor.design import STANDARD

LENGTH, WIDTH = 4.0, 3.0
SIDES = {
    "R": ((0.3, 3.7), (WIDTH + 0.3, WIDTH + 0.3)),
    "G": ((-0.3, -0.3), (0.3, 2.7)),
    "B": ((0.3, 3.7), (-0.3, -0.3)),
}


def draw(axes: Axes, channels: str) -> None:
    """One pad with its lights, and a bar along each axis whose gradient is seen."""
    unseen = unseen_axis(STANDARD.lights.azimuths_deg, channels)
    axes.set_title(channels, loc="center", weight="bold")
    axes.add_patch(Rectangle((0, 0), LENGTH, WIDTH, fc=GEL, ec=INK, lw=1))
    for name, (x, y) in SIDES.items():
        lit = name in channels
        axes.plot(x, y, color=LIGHTS[name] if lit else "#d1d5db", lw=5 if lit else 2)
        if lit:
            far = 0.45 if name == "R" else -0.45
            place = (-0.75, WIDTH / 2) if name == "G" else (LENGTH / 2, y[0] + far)
            axes.text(*place, name, color=LIGHTS[name], weight="bold", ha="center", va="center")
    for axis, y, name in (("x", 1.1, "$G_x$"), ("y", 2.0, "$G_y$")):
        seen = unseen != axis
        text = f"{name}  seen" if seen else f"{name}  not seen"
        color = INK if seen else SOFT
        axes.text(LENGTH / 2, y, text, ha="center", va="center", color=color)
    axes.set_xlim(-1.2, LENGTH + 0.6)
    axes.set_ylim(WIDTH + 1.2, -1.2)


drawing = figure(7.4, 1.9)
for axes, channels in zip(drawing.subplots(1, 4), ("RGB", "RG", "RB", "R"), strict=True):
    draw(bare(axes), channels)
save(drawing, __file__)
