# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Draws rim.png: slopes round the circles of real presses; fits for a minute or two."""

from pathlib import Path

from style import BLUE, ORANGE, SOFT, figure

from validation.rims import held_out_profile

profile = held_out_profile("taxim-gelsight", "default")
drawing = figure(6.4, 3.4)
axes = drawing.subplots()
axes.plot(profile.middles, profile.labelled, color=ORANGE, lw=2, label="the labels: the ball's")
axes.plot(profile.middles, profile.found, color=BLUE, lw=2, marker="o", ms=3, label="found")
axes.axvline(1, color=SOFT, lw=1, ls=":")
axes.annotate("labelled circle", (1.01, 1.9), color=SOFT)
axes.set_xlabel("distance from the centre [labelled contact radii]")
axes.set_ylabel("slope toward the centre [mm/mm]")
axes.set_title(f"taxim-gelsight, {profile.presses} presses held out, mean over the ring")
axes.set_ylim(0, None)
axes.legend(frameon=False)
axes.spines[["top", "right"]].set_visible(False)
drawing.savefig(Path(__file__).with_suffix(".png"), dpi=110, metadata={"Software": None})
