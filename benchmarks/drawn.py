# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""A sensor that is drawn, not rendered: its balls and plain tools as a data set with true depths.

    python -m benchmarks.drawn build/drawn
    python -m validation.generalization shapes build/drawn --estimator default

Three far lights shine on matt skin: no falloff but a straight one, no shadow, no light from skin to
skin, and azimuths that no design has. The skin is the twin's, on flat gel under the finger's pad.
Nothing of the kind was trained on, so this asks what an estimator and its uncertainty are worth on
a sensor that is lit otherwise than both designs.
"""

import argparse
from collections.abc import Iterable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Final

import cv2
import numpy as np
from jaxtyping import Float

from sensor.arguments import at_least, ending_in_a_sentence
from sensor.dataset import CARD_FILE, LABELS_FILE, DatasetCard, write_card, write_labels
from sensor.design import FINGER
from sensor.files import new_folder
from simulation.camera import CameraModel, jpeg
from simulation.dataset import label_of
from simulation.indenters import CALIBRATION_BALL_MM, calibration_ball
from simulation.presses import Press, ball_presses, contact_circle_px, placed_presses, skin_under
from simulation.skin import Map, gel_view
from simulation.tools import tools

DESIGN: Final = replace(FINGER, gel=replace(FINGER.gel, curved=False))
LIGHTS_DEG: Final = {"R": 0.0, "G": 120.0, "B": 240.0}
ELEVATION_DEG: Final = 35.0
BRIGHT: Final = 150.0
"""Grey levels that a light adds to skin that faces it in the middle of the pad."""
AMBIENT, NOISE = 15.0, 2.0
"""Grey levels of skin that turns away from a light, and of each pixel's noise."""
FALLOFF: Final = 0.25
"""Of a light, from the middle of the pad to its border."""
BALLS: Final = 14
CAMERA: Final = CameraModel(gains=(1.0, 1.0, 1.0))
FINER: Final = 2
"""Skin pixels to a pixel of the frame, along both axes."""


Pixels = Float[np.ndarray, "h w 3"]


def drawn(depth_mm: Map, mm_per_px: float) -> Pixels:
    """The skin in grey levels, without noise; matt, so by the cosine to each light."""
    height, width = depth_mm.shape
    across, along = np.meshgrid(np.linspace(-1, 1, width), np.linspace(-1, 1, height))
    slope_y, slope_x = np.gradient(depth_mm, mm_per_px)
    upright = 1 / np.sqrt(1 + slope_x**2 + slope_y**2)
    elevation = np.radians(ELEVATION_DEG)
    colors = []
    for azimuth in np.radians(list(LIGHTS_DEG.values())):
        toward = np.cos(azimuth) * slope_x + np.sin(azimuth) * slope_y
        # Depth grows away from the side that faces a light, so light is against the slope.
        cosine = (np.sin(elevation) - np.cos(elevation) * toward) * upright
        near = 1 + FALLOFF * (np.cos(azimuth) * across + np.sin(azimuth) * along)
        colors.append(AMBIENT + BRIGHT * near * np.maximum(cosine, 0))
    return np.stack(colors, -1)


def coarser(values: np.ndarray) -> np.ndarray:
    """Means over squares of ``FINER`` pixels."""
    height, width = (side // FINER for side in values.shape[:2])
    return cv2.resize(values, (width, height), interpolation=cv2.INTER_AREA)


def presses() -> Iterator[Press]:
    """Balls all over the pad, and every tool in its middle."""
    yield from ball_presses(DESIGN, calibration_ball(), BALLS, seed=0)
    for tool in tools(DESIGN.pad_size_mm).values():
        yield from placed_presses(DESIGN, tool)


def draw(folder: Path, width_px: int, pressed: Iterable[Press]) -> None:
    """Draw presses into an empty folder."""
    view, rng = gel_view(DESIGN, FINER * width_px), np.random.default_rng(0)
    coarse = gel_view(DESIGN, width_px)
    (folder / "truth").mkdir()

    def write(name: str, depth_mm: Map) -> None:
        light = coarser(drawn(depth_mm, view.mm_per_px[0]))
        noisy = light + NOISE * rng.standard_normal(light.shape)
        (folder / name).write_bytes(jpeg(np.clip(noisy, 0, 255).round().astype(np.uint8), CAMERA))

    write("background.jpg", np.zeros(view.size_px[::-1]))
    labels = []
    for press in pressed:
        skin = skin_under(DESIGN, view, press)
        write(f"{press.name}.jpg", skin.depth_mm)
        np.save(folder / "truth" / f"{press.name}.npy", coarser(skin.depth_mm).astype(np.float32))
        if press.indenter.round_mm:
            x_px, y_px, radius_px = contact_circle_px(skin)
            circle = ((x_px + 0.5) / FINER - 0.5, (y_px + 0.5) / FINER - 0.5, radius_px / FINER)
            labels.append(label_of(f"{press.name}.jpg", circle))
    write_labels(folder / LABELS_FILE, labels)
    card = DatasetCard(
        name="drawn",
        source="drawn by benchmarks.drawn",
        licence="CC-BY-4.0",
        mm_per_px=coarse.mm_per_px,
        ball_radius_mm=CALIBRATION_BALL_MM,
        background=("background.jpg",),
        lights_deg=LIGHTS_DEG,
    )
    write_card(folder / CARD_FILE, card)


def main() -> None:
    """Draw."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.drawn", description=__doc__)
    parser.add_argument("out", type=Path, help="the folder to write, new or empty")
    parser.add_argument("--width-px", type=at_least(64), default=320, help="of the frames (320)")
    asked = parser.parse_args()
    with ending_in_a_sentence(parser), new_folder(asked.out) as folder:
        draw(folder, asked.width_px, presses())


if __name__ == "__main__":
    main()
