# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Integrate what each border is good at and what it is not: computed, not drawn by hand."""

import numpy as np
from matplotlib.axes import Axes
from style import BLUE, INK, RED, SOFT, figure, save

from recon.ball import ball_cap
from recon.integration.poisson import Boundary, integrate

SIZE_PX, PITCH_MM, BALL_MM, CONTACT_MM = (320, 240), 0.05, 3.0, 2.2
BIAS = 0.025
COLORS: dict[Boundary, str] = {"dirichlet": BLUE, "neumann": RED}


def draw(axes: Axes, title: str, center_x_px: float, bias: float) -> None:
    """One cut through a cap: the truth and both borders' depth."""
    center_px = (center_x_px, 120.0)
    cap = ball_cap(SIZE_PX, center_px, CONTACT_MM, BALL_MM, (PITCH_MM, PITCH_MM))
    biased = cap.gradient + np.array([bias, 0.0])
    x_mm = np.arange(SIZE_PX[0]) * PITCH_MM
    axes.plot(x_mm, cap.depth_mm[120], color=INK, lw=4, alpha=0.25, label="truth")
    for boundary, color in COLORS.items():
        depth = integrate(biased, (PITCH_MM, PITCH_MM), boundary)
        if boundary == "neumann":
            depth = depth - np.median(depth[~cap.contact])
        style = "-" if boundary == "dirichlet" else "--"
        axes.plot(x_mm, depth[120], style, color=color, lw=1.4, label=boundary)
    axes.set_title(title)
    axes.set_xlabel("x  [mm]")
    axes.spines[["top", "right"]].set_visible(False)
    axes.axhline(0, color=SOFT, lw=0.5)


drawing = figure(7.4, 2.7)
left, right = drawing.subplots(1, 2, sharey=True)
draw(left, "A contact that the frame's edge cuts", 12.0, 0.0)
draw(right, f"A slope bias of {BIAS} mm/mm along x", 160.0, BIAS)
left.set_ylabel("depth  [mm]")
left.invert_yaxis()  # the skin goes down where it is pressed; both share the axis
left.legend(frameon=False, loc="lower right")
save(drawing, __file__)
