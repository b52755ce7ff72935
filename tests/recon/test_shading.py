# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""The shading model of few numbers, and the pixels that it moves."""

import numpy as np
import pytest

from recon.estimators.default import normal_of
from recon.estimators.shading import (
    FEW_PRESSES,
    Taught,
    blank_colors,
    fit_light,
    fit_shading,
    moved,
)

AZIMUTHS = np.radians([90.0, 180.0, -90.0])
LIGHTS = np.stack([np.cos(AZIMUTHS), np.sin(AZIMUTHS)])


def blank_at(position):
    """Three lights, each brighter on its own side."""
    return (0.5 + 0.1 * position @ LIGHTS).astype(np.float32)


def color_at(slopes, position):
    """A matt gel: the change is linear in the normal, and stronger where the blank is bright."""
    return (0.8 * normal_of(slopes) @ LIGHTS * blank_at(position)).astype(np.float32)


def balls(presses, per_press=200, noise=0.0, seed=0):
    """Contacts here and there, all their pixels within a tenth of the frame."""
    rng = np.random.default_rng(seed)
    press = np.repeat(np.arange(presses, dtype=np.int32), per_press)
    middle = rng.uniform(-0.9, 0.9, (presses, 2))[press]
    slopes = rng.uniform(-0.8, 0.8, (len(press), 2)).astype(np.float32)
    slopes[::4] = 0  # flat gel
    position = (middle + 0.1 * slopes).astype(np.float32)
    color = color_at(slopes, position) + noise * rng.standard_normal((len(press), 3))
    return Taught(color=color.astype(np.float32), position=position, slopes=slopes, press=press)


def light_of(taught):
    return fit_light(taught.position, blank_at(taught.position))


def test_a_smooth_light_is_found_again():
    taught = balls(12)
    probe = np.random.default_rng(1).uniform(-0.8, 0.8, (50, 2)).astype(np.float32)
    np.testing.assert_allclose(
        blank_colors(light_of(taught), probe), blank_at(probe), rtol=0, atol=2e-3
    )


def test_a_few_presses_tell_the_colours_of_places_between_them():
    taught = balls(10, noise=0.005)
    rng = np.random.default_rng(1)
    slopes, probe = (rng.uniform(-0.7, 0.7, (200, 2)).astype(np.float32) for _ in range(2))
    found = fit_shading(taught, light_of(taught)).colors(slopes, probe)
    missed = np.abs(found - color_at(slopes, probe)).mean()
    assert missed < 0.05 * np.abs(color_at(slopes, probe)).mean()


def test_flat_gel_keeps_its_colour_and_none_leaves_the_scale():
    taught = balls(10)
    model = fit_shading(taught, light_of(taught))
    probe = np.random.default_rng(1).uniform(-1, 1, (100, 2)).astype(np.float32)
    assert not model.colors(np.zeros_like(probe), probe).any()
    steep = model.colors(np.full_like(probe, 30), probe) + blank_colors(model.light, probe)
    assert steep.min() >= -1e-6 and steep.max() <= 1 + 1e-6


def test_moved_pixels_fit_the_same_gel_and_are_as_steep():
    taught = balls(FEW_PRESSES)
    elsewhere = moved(taught, light_of(taught), seed=0)
    assert len(elsewhere.press) == len(taught.press)
    np.testing.assert_allclose(
        np.linalg.norm(elsewhere.slopes, axis=1), np.linalg.norm(taught.slopes, axis=1), atol=1e-6
    )
    assert np.abs(elsewhere.position.mean(0)).max() < 0.1
    inside = np.abs(elsewhere.position).max(1) < 0.7
    true = color_at(elsewhere.slopes, elsewhere.position)
    assert np.abs(elsewhere.color - true)[inside].mean() < 0.05 * np.abs(true).mean()


def test_noise_is_moved_with_its_pixel_and_grows_by_half():
    quiet, noisy = (moved(balls(10, 800, noise=n), light_of(balls(10, 800)), 0) for n in (0, 0.02))
    flat = ~noisy.slopes.any(1)
    assert noisy.color[flat].std() == pytest.approx(1.5 * 0.02, rel=0.1)
    assert quiet.color[flat].std() == 0


def test_the_more_presses_the_less_is_moved():
    counts = [len(moved(balls(n), light_of(balls(n)), 0).press) for n in (5, 10, 20, 40)]
    assert counts == [5 * 200, 10 * 200, 20 * 200 / 4, 40 * 200 / 16]


def test_one_press_is_enough_to_go_on():
    taught = balls(1)
    assert np.isfinite(moved(taught, light_of(taught), 0).color).all()
