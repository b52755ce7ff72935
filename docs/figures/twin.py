# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Draws twin.jpg and prints the numbers of the page on the twin's figures; takes some minutes.

The gel under filters and shapes of gel as the paper shows them, and gloves by the threads that they
let through.
"""

import io
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from functools import partial
from multiprocessing import get_context
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from sensor.design import FINGER, STANDARD, Wedge
from sensor.documents import json_bytes
from simulation.camera import expose, photograph
from simulation.dataset import Recipe, bands, dent_of, set_in, trace_part, trace_press
from simulation.engine import best_engine
from simulation.indenters import calibration_ball
from simulation.presses import Press
from simulation.render import smoothed
from validation.lighting import contrast, lit_area, unevenness
from validation.resolution import repetition

HERE = Path(__file__).resolve().parent
PITCHES_MM = (0.2, 0.3, 0.4, 0.5, 0.6, 0.8, 1.0, 1.2)
GLOVES_MM = {"bare": 0.0, "medical tape, 0.05 mm": 0.05, "fabric, 0.3 mm": 0.3}
PLACES_MM = ((-10.0, -10.5), (0.0, -5.0), (10.0, 0.0), (0.0, 5.0), (-10.0, 10.5))
BALL = calibration_ball()


def changed(**lights: object) -> Wedge:
    """The standard design under other films."""
    return replace(STANDARD, lights=replace(STANDARD.lights, **lights))


VARIANTS = {
    "as designed": STANDARD,
    "no gray filter": changed(gray_filter_transmission=1.0),
    "no diffuser": changed(diffuser=False),
    "flat gel": replace(STANDARD, gel=replace(STANDARD.gel, curved=False)),
}


def main() -> None:
    """Render, measure, draw, print."""
    engine = best_engine()
    with ProcessPoolExecutor(2, mp_context=get_context("spawn")) as pool:
        seen = {name: lit(engine, design, pool) for name, design in VARIANTS.items()}
        gloves = [
            pool.submit(
                repetition,
                Recipe(engine=engine, design=FINGER, samples=100, cover_mm=thickness),
                pitch,
            )
            for thickness in GLOVES_MM.values()
            for pitch in PITCHES_MM
        ]
        found = [future.result() for future in gloves]
    draw({name: picture for name, (picture, _) in seen.items()})
    numbers = {
        "lighting": {name: figures for name, (_, figures) in seen.items()},
        "threads": [
            {
                "cover_mm": item.cover_mm,
                "pitch_mm": item.pitch_mm,
                "relief_mm": round(item.relief_mm, 4),
                "levels": round(item.levels, 2),
                "beside": round(item.beside, 2),
                "resolved": item.resolved,
            }
            for item in found
        ],
    }
    print(json_bytes(numbers).decode(), end="")


def lit(engine, design: Wedge, pool) -> tuple[np.ndarray, dict[str, float]]:
    """The gel with five balls, above its difference image; the numbers that go with it."""
    recipe = Recipe(engine=engine, design=design, width_px=240, samples=100)
    rest = np.zeros(recipe.view.size_px[::-1])
    presses = [
        Press(name=f"{x}", indenter=BALL, center_mm=(x, y), depth_mm=0.45) for x, y in PLACES_MM
    ]
    strips = [pool.submit(trace_part, recipe, rest, window, 1) for window in bands(recipe.view)]
    dents = [pool.submit(trace_press, recipe, press) for press in presses]
    blank = np.concatenate([strip.result() for strip in strips])
    untouched = smoothed(blank, recipe.view.mm_per_px[0], rest, None)
    camera = expose(untouched)
    shoot = partial(photograph, camera=camera)
    background = pixels(shoot(untouched, seed=0))
    difference, contrasts = np.zeros_like(background), []
    for index, (press, future) in enumerate(zip(presses, dents, strict=True), start=1):
        dent = dent_of(recipe, press)
        frame = pixels(shoot(set_in(blank, recipe, dent, future.result()), seed=index))
        columns, rows = dent.window
        difference[rows, columns] = (frame - background)[rows, columns]
        contrasts.append(contrast(frame - background, dent.depth_mm > 0.05))
    picture = np.vstack([background + difference, 0.5 + 3 * difference])
    return np.clip(picture, 0, 1), {
        "contrast_levels": round(float(np.mean(contrasts)), 1),
        "weakest_contrast_levels": round(float(np.min(contrasts)), 1),
        "unevenness": round(unevenness(background), 3),
        "lit_area": round(lit_area(background), 3),
    }


def pixels(jpeg: bytes) -> np.ndarray:
    """A frame in full scale."""
    return np.asarray(Image.open(io.BytesIO(jpeg)), np.float32) / 255


def draw(pictures: dict[str, np.ndarray]) -> None:
    """The variants side by side, named."""
    height, width = next(iter(pictures.values())).shape[:2]
    sheet = Image.new("RGB", (len(pictures) * (width + 6) - 6, height + 22), "white")
    pen = ImageDraw.Draw(sheet)
    font = ImageFont.load_default(14)
    for index, (name, picture) in enumerate(pictures.items()):
        left = index * (width + 6)
        sheet.paste(Image.fromarray((255 * picture).round().astype(np.uint8)), (left, 22))
        pen.text((left + 2, 2), name, fill="black", font=font)
    sheet.save(HERE / "twin.jpg", quality=90, subsampling=0)


if __name__ == "__main__":
    main()
