# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Circles that were drawn off their balls are told from balls that were misread."""

import shutil
from dataclasses import replace

import numpy as np
import pytest

from recon.pixels import label_pixels
from recon.presses import read_presses
from sensor.dataset import write_labels
from tests.synthetic import make_dataset
from validation import label_noise


@pytest.fixture(scope="module")
def dataset(tmp_path_factory):
    return make_dataset(tmp_path_factory.mktemp("noise") / "set", presses=12)


def test_the_shift_is_found_that_slopes_were_moved_by(dataset):
    press = read_presses(dataset).presses[0]
    pixels = label_pixels(press, 0, 0)
    assert np.allclose(
        label_noise.moved_slopes(pixels, press, (0.0, 0.0)), pixels.gradient, atol=1e-6
    )
    moved = label_noise.moved_slopes(pixels, press, (1.5, -0.7))
    assert not moved[~pixels.contact].any()
    assert label_noise.shift_read_in(moved, pixels, press) == pytest.approx((1.5, -0.7), abs=0.02)


def test_circles_that_lie_off_are_told_from_balls_that_are_misread(dataset, tmp_path, monkeypatch):
    monkeypatch.setattr(label_noise, "FOLDS", 3)
    folder = tmp_path / "set"
    shutil.copytree(dataset.folder, folder)
    off_px = np.random.default_rng(3).normal(0, 2, (len(dataset.labels), 2))
    off = [
        replace(label, center_x_px=label.center_x_px + x, center_y_px=label.center_y_px + y)
        for label, (x, y) in zip(dataset.labels, off_px, strict=True)
    ]
    write_labels(folder / "labels.csv", off)
    rows = label_noise.label_noise(str(folder), ("table", "mlp"))
    for row in rows:
        assert row["presses"] == 12
        labelled, read = (row[f"contact, {how} theta_deg"] for how in label_noise.HOW)
        assert read < 0.9 * labelled
    for estimator in ("table", "mlp"):
        reads = label_noise.read_held_out(str(folder), estimator)
        left_px = np.array([read.shift_px for read in reads]) + off_px
        assert np.sqrt(np.mean(left_px**2)) < 0.6 * np.sqrt(np.mean(off_px**2))


def test_the_collar_is_what_lies_between_contact_and_flat_gel(dataset):
    press = read_presses(dataset).presses[0]
    pixels = label_pixels(press, 0, 0)
    read = label_noise.Read(press=press, pixels=pixels, slopes=pixels.gradient, shift_px=(0.0, 0.0))
    judged = label_noise._judged(read, label_noise.WITHOUT_COLLAR)
    row, column = np.divmod(pixels.place, press.size_px[0])
    off_px = np.hypot(column - press.center_px[0], row - press.center_px[1])
    radii = off_px / press.contact_radius_px  # the synthetic frame's pixels are square
    assert judged[pixels.contact].all()
    collar = ~pixels.contact & (radii < 2.8)
    assert collar.any() and not judged[collar].any()
    assert judged[radii > 2.8].all() and (radii > 2.8).any()
