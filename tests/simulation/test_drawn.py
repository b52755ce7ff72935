# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""A drawn sensor's frames are the light that a matt skin reflects, with its labels and truth."""

from itertools import islice
from pathlib import Path

import numpy as np
import pytest

from benchmarks.drawn import AMBIENT, BRIGHT, ELEVATION_DEG, LIGHTS_DEG, draw, drawn, presses
from recon.presses import read_presses
from sensor.dataset import read_dataset
from validation.importers.lights import measure_lights_deg


def test_skin_is_as_bright_as_its_cosine_to_each_light() -> None:
    sine = np.sin(np.radians(ELEVATION_DEG))
    flat = drawn(np.zeros((41, 41)), 0.1)
    np.testing.assert_allclose(flat[20, 20], AMBIENT + BRIGHT * sine)
    x_mm = 0.1 * np.meshgrid(np.arange(41), np.arange(41))[0]
    toward = 1 / np.tan(np.radians(ELEVATION_DEG))  # of the slope that faces the red light
    facing, away = (drawn(slope * x_mm, 0.1)[20, 20, 0] for slope in (-toward, toward))
    assert facing == pytest.approx(AMBIENT + BRIGHT) and away == AMBIENT
    assert (flat[20, -1, 0], flat[20, 0, 0]) == pytest.approx(
        (AMBIENT + 1.25 * BRIGHT * sine, AMBIENT + 0.75 * BRIGHT * sine)
    )


def test_it_is_a_set_whose_lights_come_from_where_its_card_says(tmp_path: Path) -> None:
    *balls, tool = islice(presses(), 12, 15)
    draw(tmp_path, 80, [*balls, tool])
    dataset = read_dataset(tmp_path)
    assert [label.file for label in dataset.labels] == [f"{ball.name}.jpg" for ball in balls]
    found = measure_lights_deg(read_presses(dataset).presses)
    for color, azimuth_deg in LIGHTS_DEG.items():
        assert (found[color] - azimuth_deg + 180) % 360 - 180 == pytest.approx(0, abs=8)
    truth_mm = np.load(tmp_path / "truth" / f"{tool.name}.npy")
    assert truth_mm.max() == pytest.approx(tool.depth_mm, abs=0.02)
    label = dataset.labels[0]
    depth_mm = np.load(tmp_path / "truth" / f"{balls[0].name}.npy")
    row, column = np.unravel_index(depth_mm.argmax(), depth_mm.shape)
    assert np.hypot(row - label.center_y_px, column - label.center_x_px) < 1.5
