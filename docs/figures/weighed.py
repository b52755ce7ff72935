# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Draws weighed.png: how wrong depth is where slopes count alike, and where they are weighted."""

from pathlib import Path

import numpy as np
from style import INK, bare, figure

from recon.calibration import unit_of_set
from recon.integration.poisson import integrate
from recon.pipeline import reconstruct
from sensor.dataset import read_dataset
from validation.datasets import dataset_folder
from validation.shapes import measure_shapes, name_in_words

SHAPES = ("cube_corner", "m2_screw", "prism")
MOST_MM = 0.08
SCALE_MM = 2.0

folder = dataset_folder("twin-finger")
unit = unit_of_set(read_dataset(folder), "default")
shapes = {shape.name: shape for shape in measure_shapes(folder, unit)}
drawing = figure(7.4, 5.4)
rows = drawing.subplots(len(SHAPES), 3)
for row, name in zip(rows, SHAPES, strict=True):
    shape = shapes[name]
    pitch = shape.mm_per_px
    found = reconstruct(
        shape.difference, unit.estimator, missing="none", lights_deg=None, mm_per_px=pitch
    )
    alike = integrate(found.gradient, pitch, found.boundary)
    touched = shape.truth_mm[shape.touched]
    for axes, (title, depth_mm) in zip(
        row[1:], (("slopes count alike", alike), ("weighted", found.depth_mm)), strict=True
    ):
        error_mm = depth_mm - shape.truth_mm
        errors = bare(axes).imshow(error_mm, cmap="PuOr", vmin=-MOST_MM, vmax=MOST_MM)
        rmse_mm = np.sqrt(np.mean((depth_mm[shape.touched] - touched) ** 2))
        axes.set_title(f"{title}: {rmse_mm:.3f} mm")
    depths = bare(row[0]).imshow(shape.truth_mm, cmap="viridis", vmin=0)
    row[0].set_title(f"{name_in_words(name)}, {touched.max():.2f} mm deep")
    left, low = 12, 0.93 * len(shape.truth_mm)
    row[0].plot([left, left + SCALE_MM / pitch[0]], [low, low], color="white", lw=2)
    row[0].text(left, low - 8, f"{SCALE_MM:g} mm", color="white")
bar = drawing.colorbar(errors, ax=rows[:, 1:], shrink=0.5, pad=0.02)
bar.set_label("depth found less true depth [mm]", color=INK)
drawing.savefig(Path(__file__).with_suffix(".png"), dpi=100, metadata={"Software": None})
