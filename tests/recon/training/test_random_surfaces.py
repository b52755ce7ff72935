# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from multiprocessing import get_context

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from recon.training.contact_surfaces import SHAPES, STEEPEST_SLOPE, surface_gradient
from recon.training.random_surfaces import BLOCK, RECIPES, surface_set

seeds = st.integers(0, 2**32 - 1)
sides = st.integers(8, 80)
recipes = st.sampled_from(list(RECIPES))


@given(recipes, seeds, sides, sides)
@settings(max_examples=80, deadline=None)
def test_a_surface_is_pressed_in_and_no_steeper_than_gel_can_be(recipe, seed, height, width):
    depth = RECIPES[recipe](np.random.default_rng(seed), height, width)
    assert depth.shape == (height, width) and depth.dtype == np.float32
    assert np.isfinite(depth).all() and depth.min() >= 0
    slopes = np.linalg.norm(surface_gradient(depth), axis=-1)
    assert slopes.max() <= STEEPEST_SLOPE * (1 + 1e-5)
    if recipe == "paper":
        assert not depth[[0, -1]].any() and not depth[:, [0, -1]].any()


@pytest.mark.parametrize("recipe", RECIPES)
def test_the_same_seed_gives_the_same_surface_and_another_seed_another(recipe):
    first, again, other = (
        RECIPES[recipe](np.random.default_rng(seed), 48, 64) for seed in (7, 7, 8)
    )
    np.testing.assert_array_equal(first, again)
    assert not np.array_equal(first, other)


def test_a_set_does_not_depend_on_who_makes_it():
    count = BLOCK + 7
    shares = []
    with ThreadPoolExecutor(2) as threads:
        made = surface_set("contact", count, (24, 32), 5, threads, shares.append)
    with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as process:
        again = surface_set("contact", count, (24, 32), 5, process)
    np.testing.assert_array_equal(made, again)
    alone = RECIPES["contact"](np.random.default_rng([5, count - 1]), 24, 32)
    np.testing.assert_array_equal(made[-1], alone)
    assert shares == sorted(shares) and shares[-1] == 1


def test_contacts_are_some_empty_some_on_the_border_many_small_and_some_steep():
    surfaces = [RECIPES["contact"](np.random.default_rng([3, i]), 96, 128) for i in range(200)]
    touched = np.array([np.mean(depth > 0.05 * max(depth.max(), 1e-6)) for depth in surfaces])
    edges = [max(depth[[0, -1]].max(), depth[:, [0, -1]].max()) > 1 for depth in surfaces]
    steepest = [np.linalg.norm(surface_gradient(depth), axis=-1).max() for depth in surfaces]
    assert 0.01 < np.mean(touched == 0) < 0.15
    assert 0.02 < np.mean(edges) < 0.4
    assert np.mean((touched > 0) & (touched < 0.1)) > 0.2
    assert np.mean(touched > 0.2) > 0.05
    assert max(steepest) > 2.0


@pytest.mark.parametrize("shape", sorted(set(SHAPES), key=lambda make: make.__name__))
def test_every_shape_reaches_as_far_as_it_says_and_is_deepest_inside(shape):
    y, x = (np.mgrid[:121, :161] - np.array([60, 80])[:, None, None]).astype(np.float32)
    for seed in range(5):
        depth = shape(np.random.default_rng(seed), x, y, 20.0)
        away = np.hypot(x, y)
        assert depth.max() > 0.2
        assert depth[away > 2.6 * 20].max() <= 0  # a thread is longer than it is wide


def test_the_gradient_is_exact_on_a_quadric_with_x_along_columns():
    y, x = np.mgrid[:9, :11].astype(np.float32)
    gradient = surface_gradient(0.5 * x**2 - x * y + 3 * y)
    np.testing.assert_allclose(gradient[1:-1, 1:-1, 0], (x - y)[1:-1, 1:-1], atol=1e-5)
    np.testing.assert_allclose(gradient[1:-1, 1:-1, 1], (3 - x)[1:-1, 1:-1], atol=1e-5)


@pytest.mark.parametrize("axis", [0, 1])
def test_the_gradient_sums_to_zero_between_flat_borders(axis):
    depth = np.pad(RECIPES["paper"](np.random.default_rng(1), 60, 70), 1)
    along = surface_gradient(depth)[..., 1 - axis].sum(axis=axis)
    assert depth.max() > 0.3
    np.testing.assert_allclose(along, 0, atol=1e-3)
