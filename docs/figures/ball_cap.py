# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Draw the ball cap's radii, its slope, and which pixels the error table takes."""

import numpy as np
from matplotlib.patches import Circle
from style import BLUE, BROWN, FAINT, GEL, GREEN, INK, ORANGE, SOFT, bare, figure, measure, save

from recon.ball import ball_cap
from recon.pixels import CLEAR_OF_COLLAR, RIM_PX, STEEPEST

BALL_MM, CONTACT_MM, PITCH_MM = 4.0, 3.4, 0.02
HALF_PX = 310
X_MM = (np.arange(2 * HALF_PX + 1) - HALF_PX) * PITCH_MM
CAP = ball_cap((len(X_MM), 1), (float(HALF_PX), 0.0), CONTACT_MM, BALL_MM, (PITCH_MM, PITCH_MM))
D_MM = 1.7

drawing = figure(7.4, 5.4)
section, slope = drawing.subplots(2, 1, height_ratios=[1.35, 1])

bare(section)
depth = CAP.depth_mm[0]
wide_mm = np.array([-10.5, *X_MM, 10.5])
wide = -np.array([0, *depth, 0])
section.fill_between(wide_mm, wide, -2.9, color=GEL, lw=0)
section.plot(wide_mm, wide, color=INK, lw=1.5)
center = float(np.sqrt(BALL_MM**2 - CONTACT_MM**2))
section.add_patch(Circle((0, center), BALL_MM, fc=FAINT, ec=SOFT, lw=1, zorder=0))
section.plot([0, 0], [center, -depth.max()], color=SOFT, lw=0.8, ls=(0, (4, 3)))
section.plot(0, center, "o", color=INK, ms=3)
section.plot([0, CONTACT_MM], [center, 0], color=INK, lw=1)
section.text(0.55, 1.15, "$R$", fontsize=11)
section.text(0, center + 1.8, "ball", ha="center", color=SOFT)
measure(section, (-CONTACT_MM, 0.25), (0, 0.25))
section.text(-CONTACT_MM / 2, 0.4, "$a$", ha="center", fontsize=11)
section.plot([-CONTACT_MM, CONTACT_MM], [0, 0], color=SOFT, lw=0.8, ls=(0, (4, 3)))
at_d = float(np.interp(D_MM, X_MM, depth))
measure(section, (0, -2.45), (D_MM, -2.45))
section.plot([D_MM, D_MM], [0, -2.6], color=SOFT, lw=0.6)
section.text(D_MM / 2, -2.42, "$d$", ha="center", va="bottom")
measure(section, (D_MM, 0), (D_MM, -at_d))
section.text(D_MM - 0.12, -0.62, "depth", va="center", ha="right")
section.text(-10.4, 2.6, r"depth $= \sqrt{R^2 - d^2} - \sqrt{R^2 - a^2}$")
section.text(
    4.4,
    4.9,
    "$R$  the ball's radius\n$a$  the contact circle's radius\n$d$  distance from its centre",
    va="center",
)
section.set_xlim(-10.5, 10.5)
section.set_ylim(-2.9, 6.4)

gradient = CAP.gradient[0, :, 0]
inside = CONTACT_MM - 0.1 * RIM_PX  # a pixel of 0.1 mm, so that it shows
inside = min(inside, STEEPEST * BALL_MM)
slope.plot(X_MM, gradient, color=INK, lw=1.4)
slope.axvspan(-inside, inside, color=GREEN, alpha=0.16, lw=0)
for side in (-1, 1):
    slope.axvspan(side * CLEAR_OF_COLLAR * CONTACT_MM, side * 6.2, color=BLUE, alpha=0.12, lw=0)
    slope.axvspan(
        side * inside, side * CLEAR_OF_COLLAR * CONTACT_MM, color=ORANGE, alpha=0.14, lw=0
    )
slope.text(0, 1.55, "contact pixels", ha="center", color=GREEN, weight="bold")
slope.text(-3.87, 1.7, "left out", ha="center", color=BROWN, weight="bold", fontsize=8)
slope.text(5.3, 1.55, "5 % of these", ha="center", color=BLUE, weight="bold")
slope.text(5.3, -0.45, "gradient = 0", ha="center", color=BLUE, fontsize=8)
slope.text(-2.6, -1.45, r"$G_x = -\,(x - c_x)\;/\;\sqrt{R^2 - d^2}$", va="center")
slope.set_ylabel("∂depth/∂x  [mm/mm]")
slope.set_xlabel("$x - c_x$, through the contact's centre  [mm]")
slope.set_ylim(-2, 2)
slope.set_xlim(-6.2, 6.2)
slope.spines[["top", "right"]].set_visible(False)
save(drawing, __file__)
