# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Draws parts.png: the skin under one random part of each kind, on the finger."""

from pathlib import Path

from style import INK, bare, figure

from benchmarks.rendered_presses import part_presses
from sensor.design_file import load_design
from simulation.presses import skin_under
from simulation.random_parts import KINDS
from simulation.skin import gel_view

SEED = 1
SCALE_MM = 2.0

design = load_design("finger")
view = gel_view(design, 320)
drawing = figure(8.2, 3.2)
rows = drawing.subplots(2, len(KINDS) // 2)
presses = part_presses(design, len(KINDS), SEED)
for axes, kind, press in zip(rows.flat, KINDS, presses, strict=True):
    skin = skin_under(design, view, press)
    deepest_mm = skin.depth_mm.max()
    depths = bare(axes).imshow(skin.depth_mm / deepest_mm, cmap="viridis", vmin=0, vmax=1)
    axes.set_title(f"{kind}, {deepest_mm:.2f} mm")
left, low = 12, 0.93 * view.size_px[1]
rows[0, 0].plot([left, left + SCALE_MM / view.mm_per_px[0]], [low, low], color="white", lw=2)
rows[0, 0].text(left, low - 10, f"{SCALE_MM:g} mm", color="white")
bar = drawing.colorbar(depths, ax=rows, shrink=0.8, pad=0.02)
bar.set_label("depth of the skin, of its deepest", color=INK)
drawing.savefig(Path(__file__).with_suffix(".png"), dpi=100, metadata={"Software": None})
