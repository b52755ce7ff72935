# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""The camera model: gains, noise, gamma and JPEG, each alone and all together."""

import io

import numpy as np
import pytest
from PIL import Image

from simulation.camera import CameraModel, amplified, developed, expose, jpeg, noisy, photograph

RAMP = np.linspace(0.002, 0.03, 40 * 60 * 3, dtype=np.float32).reshape(40, 60, 3)


def test_the_untouched_gel_becomes_middle_gray_in_every_channel() -> None:
    tinted = RAMP * np.array([1.0, 0.4, 2.5], np.float32)
    np.testing.assert_allclose(amplified(tinted, expose(tinted)).mean((0, 1)), 0.18, rtol=1e-4)


def test_gamma_is_undone_by_its_inverse() -> None:
    camera = CameraModel(gains=(1, 1, 1))
    signal = np.linspace(0, 1, 300).reshape(10, 10, 3)
    back = (developed(signal, camera) / 255) ** camera.gamma
    assert np.abs(back - signal).max() < 2.2 / 255


@pytest.mark.parametrize("level", [0.05, 0.2, 0.7])
def test_noise_is_that_of_electrons(level: float) -> None:
    camera = CameraModel(gains=(1, 1, 1))
    grain = noisy(np.full((200, 200, 3), level), camera, np.random.default_rng(0)) - level
    expected = np.sqrt(level * camera.electrons + camera.read_electrons**2) / camera.electrons
    assert grain.std() == pytest.approx(expected, rel=0.02)
    assert abs(grain.mean()) < expected / 100


@pytest.mark.parametrize("level", [-0.1, 0.0, 1.0])
def test_noise_stays_within_full_scale(level: float) -> None:
    camera = CameraModel(gains=(1, 1, 1))
    seen = noisy(np.full((50, 50, 3), level), camera, np.random.default_rng(0))
    assert 0 <= seen.min() and seen.max() <= 1


def test_too_much_light_clips() -> None:
    camera = CameraModel(gains=(1, 1, 1))
    assert (developed(np.full((2, 2, 3), 7.0), camera) == 255).all()


def test_jpeg_keeps_the_frame_to_some_levels() -> None:
    camera = expose(RAMP)
    frame = developed(amplified(RAMP, camera), camera)
    decoded = np.asarray(Image.open(io.BytesIO(jpeg(frame, camera)))).astype(int)
    assert np.abs(decoded - frame).mean() < 1.5


def test_jpeg_keeps_colours_that_change_from_pixel_to_pixel() -> None:
    frame = np.full((40, 60, 3), 120, np.uint8)
    frame[:, ::2] = (150, 110, 110)  # as bright, and redder
    camera = CameraModel(gains=(1, 1, 1), jpeg_quality=100)
    decoded = np.asarray(Image.open(io.BytesIO(jpeg(frame, camera)))).astype(int)
    assert np.abs(decoded - frame).max() <= 3


def test_one_seed_one_frame() -> None:
    camera = expose(RAMP)
    assert photograph(RAMP, camera, 1) == photograph(RAMP, camera, 1)
    assert photograph(RAMP, camera, 1) != photograph(RAMP, camera, 2)
