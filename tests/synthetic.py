# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Ball presses seen by an ideal sensor: three far lights on a matt skin, truth in closed form.

A small dataset folder in one line, of any shape that the format allows::

    dataset = make_dataset(tmp_path / "set")
    dataset = make_dataset(tmp_path / "set", corners_px=KEYSTONE_PX)  # raw frames need unwarping
    dataset = make_dataset(tmp_path / "set", in_npz=True)  # frames.npz#0, #1, ...
    dataset = make_dataset(tmp_path / "set", lights_deg={"R": 90.0, "B": -90.0})  # x is unseen
    dataset = make_rendered_set(tmp_path / "set")  # with JPEGs and true depths
"""

import json
from collections.abc import Iterable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

from recon.ball import ball_cap
from recon.images import write_image
from sensor.dataset import BallLabel, Dataset, DatasetCard, read_dataset, write_card, write_labels
from validation.report.fabrication import LINKS

MM_PER_PX = (0.1, 0.1)
SIZE_PX = (120, 90)
BALL_RADIUS_MM = 4.0
LIGHTS_DEG = {"R": 90.0, "G": 180.0, "B": -90.0}
ELEVATION_DEG = 40.0
AMBIENT, GAIN = 0.15, 0.5

RAW_SIZE_PX = (160, 120)
KEYSTONE_PX = ((20.0, 10.0), (150.0, 18.0), (138.0, 108.0), (32.0, 100.0))
"""Corners of the pad in a raw frame of ``RAW_SIZE_PX``, seen askew."""


def make_dataset(
    folder: Path,
    *,
    presses: int = 12,
    seed: int = 0,
    noise_gray_levels: float = 0.5,
    lights_deg: Mapping[str, float] = LIGHTS_DEG,
    corners_px: tuple | None = None,
    in_npz: bool = False,
) -> Dataset:
    """Write a dataset folder of ball presses and read it back.

    The unwarped frames are ``SIZE_PX`` of ``MM_PER_PX``. Contacts have radii of 1 to 1.8 mm and
    lie wholly inside the frame, so slopes stay below 0.51 and no pixel is in shadow. A colour
    without a light stays at the ambient level.

    Args:
        folder: where to write; made where it is missing.
        presses: how many, of one ball of ``BALL_RADIUS_MM``.
        seed: of the places, the sizes and the noise.
        noise_gray_levels: standard deviation of white noise in every frame, of 255.
        lights_deg: azimuth that each colour comes from, in the gel frame.
        corners_px: top left, top right, bottom right, bottom left of the pad in raw frames of
            ``RAW_SIZE_PX``, such as ``KEYSTONE_PX``; by default frames show the gel plane.
        in_npz: keep the presses in ``frames.npz`` instead of one PNG each.
    """
    rng = np.random.default_rng(seed)
    places = random_places(rng, presses)

    def frame(place: tuple[float, float, float] | None) -> np.ndarray:
        light = shaded(gradient_of(place, corners_px), lights_deg)
        return digitized(light + noise_gray_levels / 255 * rng.standard_normal(light.shape))

    names = [f"frames.npz#{i}" if in_npz else f"press{i:02d}.png" for i in range(presses)]
    frames = [frame(place) for place in places]
    write_image(folder / "background.png", frame(None))
    if in_npz:
        np.savez_compressed(folder / "frames.npz", frames=np.stack(frames))
    else:
        for name, pixels in zip(names, frames, strict=True):
            write_image(folder / name, pixels)
    card = DatasetCard(
        name="synthetic",
        source="rendered in closed form by the tests",
        licence="CC-BY-4.0",
        mm_per_px=MM_PER_PX,
        ball_radius_mm=BALL_RADIUS_MM,
        background=("background.png",),
        corners_px=corners_px,
        pad_size_mm=pad_size_mm() if corners_px else None,
        lights_deg=lights_deg,
    )
    labels = [
        BallLabel(file=name, center_x_px=x, center_y_px=y, contact_radius_px=radius)
        for name, (x, y, radius) in zip(names, places, strict=True)
    ]
    write_card(folder / "dataset.toml", card)
    write_labels(folder / "labels.csv", labels)
    return read_dataset(folder)


def make_deeper_set(folder: Path, *, presses: int) -> Dataset:
    """Like ``make_dataset``; with circles that are said to be 1.3 times as wide as they are."""
    dataset = make_dataset(folder, presses=presses)
    wider = [replace(x, contact_radius_px=1.3 * x.contact_radius_px) for x in dataset.labels]
    write_labels(folder / "labels.csv", wider)
    return read_dataset(folder)


def make_rendered_set(folder: Path, **options: Any) -> Dataset:
    """Like ``make_dataset``; with JPEGs, depths in truth/, and where the balls touch in held/."""
    dataset = make_dataset(folder, **options)
    (folder / "truth").mkdir()
    (folder / "held").mkdir()
    for label in dataset.labels:
        name = Path(label.file).stem
        frame = Image.open(folder / label.file)
        frame.save(folder / f"{name}.jpg", quality=100, subsampling=0)
        depth_mm = true_depth_mm(label)
        np.save(folder / "truth" / f"{name}.npy", depth_mm)
        np.save(folder / "held" / f"{name}.npy", depth_mm > 0)
    return dataset


def pad_size_mm() -> tuple[float, float]:
    """Of the whole unwarped frame."""
    return SIZE_PX[0] * MM_PER_PX[0], SIZE_PX[1] * MM_PER_PX[1]


def random_places(rng: np.random.Generator, count: int) -> list[tuple[float, float, float]]:
    """Centre x, centre y and contact radius of presses wholly inside the frame, in pixels."""
    radii = rng.uniform(10, 18, count)
    return [
        (rng.uniform(radius, SIZE_PX[0] - radius), rng.uniform(radius, SIZE_PX[1] - radius), radius)
        for radius in radii
    ]


def gradient_of(
    place: tuple[float, float, float] | None, corners_px: tuple | None = None
) -> np.ndarray:
    """True gradient of a press, or of blank gel, at every pixel of a frame; zero off the pad."""
    if corners_px is None:
        columns, rows = np.meshgrid(*map(np.arange, SIZE_PX))
    else:
        columns, rows = gel_pixels_of_raw(corners_px)
    if place is None:
        return np.zeros((*columns.shape, 2))
    x, y, radius = place
    x_mm, y_mm = (columns - x) * MM_PER_PX[0], (rows - y) * MM_PER_PX[1]
    squared = x_mm**2 + y_mm**2
    touched = squared < (radius * MM_PER_PX[0]) ** 2
    height_mm = np.sqrt(np.where(touched, BALL_RADIUS_MM**2 - squared, 1.0))
    return np.where(touched[..., None], -np.stack([x_mm, y_mm], -1) / height_mm[..., None], 0.0)


def gel_pixels_of_raw(corners_px: tuple) -> tuple[np.ndarray, np.ndarray]:
    """Where each pixel of a raw frame lies in the unwarped frame, in its pixels.

    The homography is none of the code under test.
    """
    width, height = SIZE_PX
    edges = [(-0.5, -0.5), (width - 0.5, -0.5), (width - 0.5, height - 0.5), (-0.5, height - 0.5)]
    (a, b, c), (d, e, f), (g, h, _) = homography(corners_px, edges)
    x, y = np.meshgrid(*map(np.arange, RAW_SIZE_PX))
    w = g * x + h * y + 1
    return (a * x + b * y + c) / w, (d * x + e * y + f) / w


def homography(points: Iterable, images: Iterable) -> np.ndarray:
    """The map (3, 3) that takes four points to four others: its eight equations solved."""
    rows, values = [], []
    for (x, y), (u, v) in zip(points, images, strict=True):
        rows += [[x, y, 1, 0, 0, 0, -u * x, -u * y], [0, 0, 0, x, y, 1, -v * x, -v * y]]
        values += [u, v]
    return np.append(np.linalg.solve(rows, values), 1).reshape(3, 3)


def shaded(gradient: np.ndarray, lights_deg: Mapping[str, float] = LIGHTS_DEG) -> np.ndarray:
    """Lambert's law, 0 to 1: a skin of slope G shows ``l . (-Gx, -Gy, 1) / sqrt(1 + G^2)``."""
    light = np.full((*gradient.shape[:2], 3), AMBIENT)
    elevation = np.radians(ELEVATION_DEG)
    for channel, azimuth_deg in lights_deg.items():
        azimuth = np.radians(azimuth_deg)
        toward = gradient @ [np.cos(azimuth), np.sin(azimuth)]
        facing = np.sin(elevation) - np.cos(elevation) * toward
        steepness = np.sqrt(1 + np.sum(gradient**2, -1))
        light[..., "RGB".index(channel)] += GAIN * np.maximum(facing, 0) / steepness
    return light


def digitized(light: np.ndarray) -> np.ndarray:
    """Eight bits a channel."""
    return np.clip(np.round(255 * light), 0, 255).astype(np.uint8)


def true_depth_mm(label: BallLabel) -> np.ndarray:
    """Depth of a labelled press in the unwarped frame."""
    radius_mm = label.contact_radius_px * MM_PER_PX[0]
    return ball_cap(SIZE_PX, label.center_px, radius_mm, BALL_RADIUS_MM, MM_PER_PX).depth_mm


def make_fabrication(folder: Path, design: str, *, failed: int) -> dict[str, Any]:
    """What the page shows of a fabrication folder: three checks, a camera in the bill, pictures."""
    for name in ("bill", "electronics", "pictures", "step"):
        (folder / name).mkdir()
    for name in LINKS:
        (folder / name).write_text(design)
    for name in ("assembled_below", "section"):
        write_image(folder / "pictures" / f"{name}.png", np.zeros((4, 6, 3), np.uint8))
    checks = [
        {"check": "wall", "subject": f"part {number}", "passed": number > failed}
        for number in (1, 2, 3)
    ]
    manifest = {"design": design, "bill": {"camera": 1}, "checks": checks, "files": {}}
    (folder / "manifest.json").write_text(json.dumps(manifest))
    return manifest
