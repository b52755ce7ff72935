# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""The shading model of few numbers."""

from dataclasses import replace

import numpy as np
import pytest

from recon.estimators.default import normal_of
from recon.estimators.shading import (
    Taught,
    blank_colors,
    color_changes,
    fit_light,
    fit_shading,
    tilt_terms,
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
    return Taught(
        color=color.astype(np.float32),
        position=position,
        slopes=slopes,
        cap=np.zeros(len(press), np.float32),
        press=press,
    )


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
    shading = fit_shading(taught, light_of(taught))
    found = color_changes(shading, slopes, probe) * blank_at(probe)
    missed = np.abs(found - color_at(slopes, probe)).mean()
    assert missed < 0.05 * np.abs(color_at(slopes, probe)).mean()


@pytest.mark.parametrize("seed", [0, 1])
def test_presses_that_differ_do_not_bend_the_model_between_them(seed):
    """Few presses whose answers differ by a tenth: it errs by less, as whole presses judge it."""
    taught = balls(6, noise=0.005, seed=seed)
    answers = 1 + 0.1 * np.random.default_rng(9 + seed).standard_normal((6, 3))
    odd = replace(taught, color=(taught.color * answers[taught.press]).astype(np.float32))
    rng = np.random.default_rng(1)
    slopes, probe = (rng.uniform(-0.7, 0.7, (200, 2)).astype(np.float32) for _ in range(2))
    found = color_changes(fit_shading(odd, light_of(odd)), slopes, probe) * blank_at(probe)
    true = color_at(slopes, probe)
    assert np.abs(found - true).mean() < 0.1 * np.abs(true).mean()


def test_flat_gel_keeps_its_colour():
    taught = balls(10)
    probe = np.random.default_rng(1).uniform(-1, 1, (100, 2)).astype(np.float32)
    assert not color_changes(
        fit_shading(taught, light_of(taught)), np.zeros_like(probe), probe
    ).any()


@pytest.mark.parametrize(("terms", "folds"), [((0, 1, 5, 6), 1), ((3, 4), 2), ((7, 8), 3)])
def test_terms_turn_with_the_tilt_as_often_as_their_order(terms, folds):
    """Turned by a circle's share they are the same, and by half of that the opposite."""
    slopes = np.random.default_rng(2).normal(0, 0.5, (100, 2)).astype(np.float32)

    def turned(share):
        angle = 2 * np.pi * share
        turn = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
        return tilt_terms((slopes @ turn).astype(np.float32))[:, terms]

    np.testing.assert_allclose(turned(1 / folds), turned(0), atol=1e-5)
    np.testing.assert_allclose(turned(0.5 / folds), -turned(0), atol=1e-5)


def test_light_beyond_what_was_seen_stays_within_full_scale():
    position = np.random.default_rng(0).uniform(-0.5, 0.5, (400, 2)).astype(np.float32)
    blank = np.repeat(0.5 + 0.9 * position[:, :1], 3, 1).astype(np.float32)
    ends = np.array([[-1, 0], [1, 0]], np.float32)
    found = blank_colors(fit_light(position, blank), ends)
    np.testing.assert_allclose(found, [[0, 0, 0], [1, 1, 1]], atol=1e-6)
