# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Draws few_lights.jpg: touches of the twin with one light, two and three; takes two minutes."""

import io
from pathlib import Path

from PIL import Image

from validation.datasets import dataset_folder
from validation.few_lights import WAYS, measure_touches
from validation.figures.few_lights import few_lights_figure
from validation.figures.png import png_bytes

SHAPES = ("ball_array", "lego", "m2_screw", "screw_cap")
DPI = 100
QUALITY = 82

if __name__ == "__main__":
    touches = measure_touches(dataset_folder("twin-standard"), "default", SHAPES)
    for touch in touches:
        numbers = "  ".join(
            f"{way} {touch.rmse_mm[way]:.3f} mm ({100 * touch.lowest(way):.0f} %)"
            for way, _, _ in WAYS
        )
        print(f"{touch.name}: {numbers}")
    picture = Image.open(io.BytesIO(png_bytes(few_lights_figure(touches), DPI))).convert("RGB")
    picture.save(Path(__file__).with_suffix(".jpg"), quality=QUALITY, optimize=True)
