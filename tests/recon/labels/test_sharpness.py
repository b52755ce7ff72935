# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Blur is told by what a frame shares with the blank one, whatever the camera's noise."""

import cv2
import numpy as np
import pytest

from recon.images import read_frame
from recon.labels.capture import LEAST_DETAIL
from recon.labels.sharpness import detail_kept
from sensor.dataset import read_dataset
from validation.datasets import dataset_folder, on_this_machine

LENS_NOISE_LEVELS = 0.6
SETS = ("taxim-gelsight", "twin-standard", "twin-finger", "known-depth", "wedge-lab")


def frame(structure: np.ndarray, noise_levels: float, seed: int) -> np.ndarray:
    """A camera's frame: its noise comes after the lens."""
    noise = np.random.default_rng(seed).normal(0, noise_levels, structure.shape)
    return np.clip(np.round(structure + noise), 0, 255).astype(np.uint8)


def grainy(seed: int = 0) -> np.ndarray:
    """A gel whose film has grain, not much stronger than a camera's noise."""
    grain = np.random.default_rng(seed).normal(0, 3.0, (240, 320, 3))
    return 120 + cv2.GaussianBlur(grain, (0, 0), 0.8)


@pytest.mark.parametrize("noise_levels", [0.3, 1.0])
@pytest.mark.parametrize("kept", [0.2, 0.5, 0.8, 1.0])
def test_the_amplitude_is_found_whatever_the_noise(noise_levels: float, kept: float) -> None:
    structure = grainy()
    faint = 120 + kept * (structure - 120)
    found = detail_kept(frame(faint, noise_levels, 1), frame(structure, noise_levels, 2))
    assert abs(found - kept) < 0.15


def test_a_gel_without_structure_is_never_blurred() -> None:
    plain = np.full((240, 320, 3), 120.0)
    for seed in range(20):
        assert detail_kept(frame(plain, 1.0, seed), frame(plain, 1.0, 100 + seed)) > LEAST_DETAIL


@pytest.mark.parametrize("name", on_this_machine(SETS))
def test_presses_are_sharp_and_blurred_ones_are_not(name: str) -> None:
    dataset = read_dataset(dataset_folder(name))
    blank = read_frame(dataset.folder, dataset.card.background[0])
    for seed, label in enumerate(dataset.labels[::8]):
        press = read_frame(dataset.folder, label.file)
        assert detail_kept(press, blank) > LEAST_DETAIL
        for blur_px in (2.0, 8.0):
            blurred = cv2.GaussianBlur(press.astype(np.float32), (0, 0), blur_px)
            assert detail_kept(frame(blurred, LENS_NOISE_LEVELS, seed), blank) < LEAST_DETAIL
