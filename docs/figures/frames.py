# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Draw the gel frame, the lights' azimuths, and the signs of depth and gradient."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Circle, Rectangle
from style import BROWN, FAINT, GEL, INK, LIGHTS, SOFT, arrow, bare, figure, measure, save

from recon.ball import ball_cap
from sensor.design import STANDARD

LENGTH, WIDTH = STANDARD.pad_size_mm


def draw_pad(axes: Axes) -> None:
    """The unwarped frame, with the gel frame and the lights around it."""
    axes.set_title("The pad as the unwarped frame shows it")
    axes.add_patch(Rectangle((-LENGTH / 2, -WIDTH / 2), LENGTH, WIDTH, fc=GEL, ec=INK, lw=1.2))
    for row in range(3):
        for column in range(3):
            corner = (-LENGTH / 2 + 1.6 * column, -WIDTH / 2 + 1.6 * row)
            axes.add_patch(Rectangle(corner, 1.6, 1.6, fc="white", ec=SOFT, lw=0.6))
    axes.plot(-LENGTH / 2 + 0.8, -WIDTH / 2 + 0.8, "o", color=INK, ms=3)
    axes.text(-LENGTH / 2 + 5.4, -WIDTH / 2 + 4.0, "pixel (0, 0)", va="center", fontsize=8)
    arrow(axes, (0, 0), (9, 0), INK)
    arrow(axes, (0, 0), (0, 8), INK)
    axes.text(9.5, 0, "$x$, to the tip", va="center")
    axes.text(0.9, 7.6, "$y$, down the rows", va="center")
    axes.add_patch(Circle((0, 0), 1.15, fc="white", ec=INK, lw=1.2, zorder=3))
    for sign in (-1, 1):
        axes.plot([-0.8, 0.8], [-0.8 * sign, 0.8 * sign], color=INK, lw=1.2, zorder=4)
    axes.text(-1.9, -0.6, "$z$, away from the camera,\ntoward the object", ha="right", va="center")
    for name, azimuth_deg in STANDARD.lights.azimuths_deg.items():
        along = np.array([np.cos(np.radians(azimuth_deg)), np.sin(np.radians(azimuth_deg))])
        edge = along * (LENGTH / 2, WIDTH / 2)
        across = np.array([along[1], -along[0]])
        half = (0.42 * WIDTH if abs(along[0]) > 0.5 else 0.42 * LENGTH) * across
        ends = np.stack([edge + 1.3 * along - half, edge + 1.3 * along + half])
        axes.plot(*ends.T, color=LIGHTS[name], lw=5, solid_capstyle="butt")
        for shift in (-0.75, 0.75):
            tail = edge + shift * half
            arrow(axes, tuple(tail + 0.6 * along), tuple(tail - 3.2 * along), LIGHTS[name])
        label = edge + along * (4.6 if abs(along[0]) > 0.5 else 3.0)
        axes.text(
            *label,
            f"{name}  {azimuth_deg:.0f}°".replace("-", "−"),
            color=LIGHTS[name],
            weight="bold",
            ha="center",
            va="center",
            rotation=90 if abs(along[0]) > 0.5 else 0,
        )
    axes.text(-LENGTH / 2 - 6.6, 0, "base", rotation=90, ha="center", va="center", color=SOFT)
    axes.text(
        LENGTH / 2 + 1.8, 0, "tip: no light", rotation=90, ha="center", va="center", color=SOFT
    )
    axes.set_xlim(-LENGTH / 2 - 8, LENGTH / 2 + 3)
    axes.set_ylim(WIDTH / 2 + 5, -WIDTH / 2 - 5)  # rows grow downward


def draw_section(axes: Axes) -> None:
    """A cut along x: the ball, the skin, and which signs depth and gradient have."""
    axes.set_title("A cut through a pressed ball, $y$ into the page")
    ball_mm, contact_mm, pitch_mm = 4.5, 4.2, 0.05
    cap = ball_cap((441, 1), (220.0, 0.0), contact_mm, ball_mm, (pitch_mm, pitch_mm))
    x_mm = (np.arange(441) - 220) * pitch_mm
    skin_mm = -cap.depth_mm[0]
    axes.fill_between(x_mm, skin_mm, -5.4, color=GEL, lw=0)
    axes.plot(x_mm, skin_mm, color=INK, lw=1.4)
    center_mm = np.sqrt(ball_mm**2 - contact_mm**2)
    axes.add_patch(Circle((0, center_mm), ball_mm, fc=FAINT, ec=SOFT, lw=1.2, zorder=0))
    axes.text(0, center_mm + 0.9, "object", ha="center", color=SOFT)
    axes.plot([-11, 11], [0, 0], color=SOFT, lw=0.8, ls=(0, (4, 3)))
    peak_mm = float(cap.depth_mm.max())
    measure(axes, (0, 0.02), (0, -peak_mm))
    axes.text(0.25, -1.25, "depth > 0", va="center", fontsize=8)
    axes.annotate(
        "∂depth/∂x > 0",
        (-2.9, -0.69 * peak_mm),
        (-10.6, -3.4),
        color=BROWN,
        weight="bold",
        arrowprops={"arrowstyle": "-", "color": BROWN},
    )
    axes.annotate(
        "∂depth/∂x < 0",
        (2.9, -0.69 * peak_mm),
        (5.9, -3.4),
        color=BROWN,
        weight="bold",
        arrowprops={"arrowstyle": "-", "color": BROWN},
    )
    arrow(axes, (-9.5, 0), (-9.5, 3.2), INK)
    arrow(axes, (-9.5, 0), (-6.3, 0), INK)
    axes.text(-9.5, 3.6, "$z$", ha="center")
    axes.text(-6.0, 0.35, "$x$")
    axes.text(9.9, 0.35, "$z = 0$", ha="right", fontsize=8, color=SOFT)
    axes.text(0, -4.6, "gel; the camera looks from below", ha="center", va="center", color=SOFT)
    axes.set_xlim(-11, 11)
    axes.set_ylim(-5.4, 6.6)


if __name__ == "__main__":
    drawing = figure(7.4, 7.4)
    above, below = drawing.subplots(2, 1, height_ratios=[1.5, 1])
    draw_pad(bare(above))
    draw_section(bare(below))
    save(drawing, __file__)
