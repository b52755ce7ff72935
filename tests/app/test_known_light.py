# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""A unit whose light is known, from its presses to its masks."""

import shutil

import numpy as np
import pytest

import recon.estimators.default_training as default_training
from recon.calibration import load_calibration
from recon.contact.known_light import MOST_UNLIKE
from recon.contact.mask import contact_mask
from recon.fast.reconstructor import FastReconstructor
from recon.images import read_frame
from recon.pipeline import Reconstructor
from sensor.dataset import read_dataset, write_labels
from tests.app.commands import run
from tests.synthetic import make_dataset
from validation.contact import iou
from validation.datasets import dataset_folder

SENTENCE = "lit as the rendered standard's"


@pytest.fixture(autouse=True)
def quick_training(monkeypatch):
    pytest.importorskip("torch")
    monkeypatch.setattr(default_training, "STEPS", 100)
    monkeypatch.setattr(default_training, "BATCH", 128)


def calibrated(folder, out, capsys):
    assert run("calibrate", folder, "--out", out) == 0
    return capsys.readouterr().out


def test_the_standards_unit_says_that_its_light_is_known_and_masks_by_it(tmp_path, capsys):
    folder = shutil.copytree(dataset_folder("twin-standard"), tmp_path / "set")
    write_labels(folder / "labels.csv", read_dataset(folder).labels[:12])
    assert SENTENCE in calibrated(folder, tmp_path / "unit", capsys)
    assert 0 < load_calibration(tmp_path / "unit").estimator.unlike < MOST_UNLIKE
    frame = read_frame(folder, "prism.jpg")
    exact = Reconstructor.load(tmp_path / "unit")(frame)
    by_slopes = contact_mask(exact.disturbed, exact.depth_mm, exact.gradient, exact.mm_per_px)
    assert exact.contact.any() and not np.array_equal(exact.contact, by_slopes)
    quick = FastReconstructor.load(tmp_path / "unit")(frame)
    assert iou(quick.contact, exact.contact) > 0.97


def test_a_unit_of_another_light_says_nothing_of_it(tmp_path, capsys):
    make_dataset(tmp_path / "set", presses=12, lights_deg={"R": 30.0, "G": 150.0, "B": -90.0})
    assert SENTENCE not in calibrated(tmp_path / "set", tmp_path / "unit", capsys)
    assert load_calibration(tmp_path / "unit").estimator.unlike > 3 * MOST_UNLIKE
