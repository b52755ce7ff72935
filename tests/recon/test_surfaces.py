# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from recon.surfaces import STEEPEST_SLOPE, random_surface, surface_gradient

seeds = st.integers(0, 2**32 - 1)
sides = st.integers(8, 80)


@given(seeds, sides, sides)
@settings(max_examples=60, deadline=None)
def test_a_surface_is_pressed_in_and_flat_on_its_border(seed, height, width):
    depth = random_surface(np.random.default_rng(seed), height, width)
    assert depth.shape == (height, width)
    assert np.isfinite(depth).all() and depth.min() >= 0
    assert not depth[[0, -1]].any() and not depth[:, [0, -1]].any()
    slopes = np.linalg.norm(surface_gradient(depth), axis=-1)
    assert slopes.max() <= STEEPEST_SLOPE * (1 + 1e-5)


def test_the_same_seed_gives_the_same_surface_and_another_seed_another():
    first, again, other = (
        random_surface(np.random.default_rng(seed), 48, 64) for seed in (7, 7, 8)
    )
    np.testing.assert_array_equal(first, again)
    assert not np.array_equal(first, other)


def test_surfaces_cover_empty_frames_single_contacts_and_steep_rims():
    surfaces = [random_surface(np.random.default_rng([3, i]), 96, 128) for i in range(200)]
    touched = np.array([np.mean(depth > 0) for depth in surfaces])
    steepest = [np.linalg.norm(surface_gradient(depth), axis=-1).max() for depth in surfaces]
    assert 0.01 < np.mean(touched == 0) < 0.15
    assert np.mean((touched > 0) & (touched < 0.1)) > 0.2
    assert np.mean(touched > 0.3) > 0.05
    assert max(steepest) > 2.0


def test_the_gradient_is_exact_on_a_quadric_with_x_along_columns():
    y, x = np.mgrid[:9, :11].astype(np.float32)
    gradient = surface_gradient(0.5 * x**2 - x * y + 3 * y)
    np.testing.assert_allclose(gradient[1:-1, 1:-1, 0], (x - y)[1:-1, 1:-1], atol=1e-5)
    np.testing.assert_allclose(gradient[1:-1, 1:-1, 1], (3 - x)[1:-1, 1:-1], atol=1e-5)


@pytest.mark.parametrize("axis", [0, 1])
def test_the_gradient_sums_to_zero_between_flat_borders(axis):
    depth = random_surface(np.random.default_rng(1), 60, 70)
    along = surface_gradient(depth)[..., 1 - axis].sum(axis=axis)
    assert depth.max() > 1
    np.testing.assert_allclose(along, 0, atol=1e-3)
