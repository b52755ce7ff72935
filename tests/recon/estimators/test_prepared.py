# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Colours as the default estimator prepares them, and the normals that it answers with."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from recon.estimators.default import (
    LARGEST_DRIFT,
    STEEPEST_SLOPE,
    normal_of,
    settled,
    slopes_of,
)


def test_drift_of_the_whole_frame_is_taken_off_but_a_contacts_colour_is_not():
    difference = np.zeros((140, 160, 3), np.float32)
    difference[40:90, 50:100] = np.float32([0.1, -0.2, 0.15])
    drift = np.float32([0.03, -0.02, 0.01])
    np.testing.assert_allclose(settled(difference + drift), settled(difference), atol=1e-6)
    flooded = np.full_like(difference, 3 * LARGEST_DRIFT)
    np.testing.assert_allclose(settled(flooded), 2 * LARGEST_DRIFT, atol=1e-6)


@pytest.mark.parametrize("size_px", [(320, 240), (640, 480), (200, 150)])
def test_what_fills_most_of_the_frame_does_not_pass_for_drift(size_px):
    width, height = size_px
    x, y = np.meshgrid(np.linspace(-1, 1, width), np.linspace(-1, 1, height))
    bumps = 0.03 * (np.sin(9 * x) ** 2 + np.sin(7 * y) ** 2) * (np.maximum(abs(x), abs(y)) < 0.8)
    noise = np.random.default_rng(0).normal(0, 0.002, (height, width, 3))
    difference = np.float32(noise - bumps[..., None])
    assert np.median(difference) < -0.015
    np.testing.assert_allclose(settled(difference)[bumps == 0].mean(0), 0, atol=0.002)


@pytest.mark.parametrize("black", [0, 0.2, 0.4])
def test_what_is_black_does_not_hide_the_drift(black):
    difference = np.random.default_rng(0).normal(0.02, 0.004, (240, 320, 3)).astype(np.float32)
    difference[:, : round(black * 320)] = 0
    np.testing.assert_allclose(settled(difference)[:, 200:].mean((0, 1)), 0, atol=0.003)


@given(st.floats(0, 0.99 * STEEPEST_SLOPE), st.floats(0, 6.3))
def test_normals_and_slopes_are_each_others_inverse(steepness, azimuth):
    slopes = np.float32([[steepness * np.cos(azimuth), steepness * np.sin(azimuth)]])
    np.testing.assert_allclose(slopes_of(normal_of(slopes)), slopes, rtol=1e-4, atol=1e-6)


def test_no_slope_is_steeper_than_the_bound():
    wild = np.random.default_rng(0).normal(size=(100, 2)).astype(np.float32) * 3
    assert np.linalg.norm(slopes_of(wild), axis=1).max() <= STEEPEST_SLOPE * (1 + 1e-6)
