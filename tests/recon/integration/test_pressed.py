# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""The convex fit, and the baselines that a network must beat."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from recon.ball import ball_cap, offsets_mm
from recon.integration.poisson import integrate
from recon.integration.pressed import SMOOTHNESS_PX, STEPS, nearest_pressed, pressed_depth
from recon.missing_axis.baselines import by_columns, by_convex_fit

PITCH = (1.0, 1.0)
CAP = ball_cap((96, 80), (50.0, 38.0), 20.0, 26.0, PITCH)
GRADIENT = CAP.gradient.astype(np.float32)
EVERYWHERE = np.ones((80, 96), bool)
AWAY = np.hypot(*offsets_mm((96, 80), (50.0, 38.0), PITCH))
JUDGED = (AWAY < 18) | (AWAY > 26)
"""The error table's pixels: a rim that is sharper than a pixel belongs to neither side."""


@pytest.mark.parametrize("both", [False, True])
@pytest.mark.parametrize(("coarseness", "most"), [(1, 0.05), (4, 0.1)])
def test_a_ball_has_its_depth(both, coarseness, most):
    found = pressed_depth(GRADIENT, EVERYWHERE, both=both, coarseness=coarseness, steps=60)
    assert np.sqrt(np.mean((found - CAP.depth_mm) ** 2)) < most * CAP.depth_mm.max()


@pytest.mark.parametrize("both", [False, True])
def test_fewer_pixels_have_the_depth_of_all(both):
    fine, coarse = (
        pressed_depth(GRADIENT, EVERYWHERE, both=both, coarseness=coarseness, steps=60)
        for coarseness in (1, 4)
    )
    assert np.sqrt(np.mean((coarse - fine) ** 2)) < 0.02 * fine.max()


@pytest.mark.parametrize("both", [False, True])
def test_a_dozen_steps_do_where_pixels_are_few(both):
    found, end = (
        pressed_depth(GRADIENT, EVERYWHERE, both=both, coarseness=4, steps=steps)
        for steps in (STEPS, 500)
    )
    assert np.sqrt(np.mean((found - end) ** 2)) < 0.003 * end.max()


def test_it_minimizes_its_energy_among_the_depths_that_are_allowed():
    """The conditions of Karush, Kuhn and Tucker, by finite differences of the energy."""
    rng = np.random.default_rng(0)
    noisy = GRADIENT + rng.normal(0, 0.1, GRADIENT.shape).astype(np.float32)
    support = CAP.depth_mm > -1
    support[:, 70:] = False
    found = pressed_depth(noisy, support, both=True, steps=4000).astype(float)
    known = noisy * 1.0

    def energy(depth):
        ring = np.pad(depth, 1)
        slopes = np.pad(known, ((1, 1), (1, 1), (0, 0)))
        along_y = (slopes[1:, 1:-1, 1] + slopes[:-1, 1:-1, 1]) / 2
        along_x = (slopes[1:-1, 1:, 0] + slopes[1:-1, :-1, 0]) / 2
        rest_y = np.diff(ring[:, 1:-1], axis=0) - along_y
        rest_x = np.diff(ring[1:-1], axis=1) - along_x
        return np.sum(rest_y**2) + np.sum(rest_x**2)

    assert found.min() >= 0 and not found[~support].any()
    for row, column in [(38, 50), (30, 44), (10, 10), (70, 30), (5, 60)]:
        step = np.zeros_like(found)
        step[row, column] = 0.01
        slope = (energy(found + step) - energy(found - step)) / 0.02
        if found[row, column] > 0.02:
            assert slope == pytest.approx(0, abs=0.02)
        else:
            assert slope > -0.02


def test_of_one_slope_it_minimizes_its_energy_the_other_s_changes_counting_along_both_axes():
    """|dz/dy - m|^2 + s^2 |grad dz/dx|^2, by finite differences where the gel is pressed in."""
    noisy = GRADIENT + np.random.default_rng(0).normal(0, 0.1, GRADIENT.shape).astype(np.float32)
    found = pressed_depth(noisy, EVERYWHERE, both=False, steps=4000).astype(float)
    known = np.pad(noisy[..., 1] * 1.0, ((1, 1), (0, 0)))

    def energy(depth):
        ring = np.pad(depth, 1)
        rest_y = np.diff(ring[:, 1:-1], axis=0) - (known[1:] + known[:-1]) / 2
        bend_x, bend_y = (np.diff(ring, 2, axis=axis) for axis in (1, 0))
        bend_x, bend_y = bend_x[1:-1], bend_y[:, 1:-1]
        return np.sum(rest_y**2) + SMOOTHNESS_PX**2 * np.sum(bend_x * (bend_x + bend_y))

    for row, column in [(38, 50), (30, 44), (45, 58), (40, 40)]:
        step = np.zeros_like(found)
        step[row, column] = 0.01
        assert found[row, column] > 0.02
        slope = (energy(found + step) - energy(found - step)) / 0.02
        assert slope == pytest.approx(0, abs=0.02)


def test_the_unmeasured_slope_is_not_looked_at():
    other = GRADIENT.copy()
    other[..., 0] = 7
    first, again = (pressed_depth(g, EVERYWHERE, both=False) for g in (GRADIENT, other))
    np.testing.assert_array_equal(first, again)


@given(st.integers(1, 40), st.integers(1, 40), st.booleans(), st.sampled_from([1, 4]))
@settings(max_examples=30, deadline=None)
def test_any_size_is_pressed_in_only(height, width, both, coarseness):
    measured = np.random.default_rng(height).normal(0, 0.3, (height, width, 2)).astype(np.float32)
    support = np.ones((height, width), bool)
    found = pressed_depth(measured, support, both=both, coarseness=coarseness)
    assert found.shape == (height, width) and np.isfinite(found).all()
    if coarseness == 1:
        assert found.min() >= 0


@pytest.mark.parametrize("boundary", ["dirichlet", "neumann"])
@pytest.mark.parametrize("pitch", [(0.1, 0.1), (0.1, 0.13)])
def test_a_free_depth_loses_what_is_negative_and_comes_nearer_to_the_truth(boundary, pitch):
    rng = np.random.default_rng(3)
    cap = ball_cap((96, 80), (50.0, 38.0), 2.0, 2.6, pitch)
    wrong = cap.gradient + 0.05 * rng.normal(size=cap.gradient.shape)
    wrong[:, :50, 0] *= 0.5  # of one side too little is seen
    free = integrate(wrong.astype(np.float32), pitch, boundary)
    free = free - np.median(free[cap.depth_mm == 0]) if boundary == "neumann" else free
    support = np.hypot(*offsets_mm((96, 80), (50.0, 38.0), pitch)) < 2.4
    found = nearest_pressed(free, support, pitch, boundary)
    assert free.min() < -0.05 * cap.depth_mm.max() and found.min() >= 0
    assert not found[~support].any() and found.shape == free.shape
    errors = [np.sqrt(np.mean((depth - cap.depth_mm) ** 2)) for depth in (found, free)]
    assert errors[0] < 0.9 * errors[1], errors


@pytest.mark.parametrize("boundary", ["dirichlet", "neumann"])
def test_a_depth_that_is_allowed_already_is_left_alone(boundary):
    depth = CAP.depth_mm.astype(np.float32)
    found = nearest_pressed(depth, EVERYWHERE, PITCH, boundary)
    np.testing.assert_allclose(found, depth, atol=0.02 * depth.max())


@pytest.mark.parametrize("boundary", ["dirichlet", "neumann"])
@pytest.mark.parametrize("pitch", [(0.1, 0.1), (0.1, 0.13)])
def test_a_depth_beyond_the_support_is_pressed_back_and_not_cut_off(boundary, pitch):
    """The slopes then differ less than those of a dent whose rim falls off like a cliff."""
    cap = ball_cap((96, 80), (50.0, 38.0), 2.0, 2.6, pitch)
    free = cap.depth_mm.astype(np.float32)
    support = np.hypot(*offsets_mm((96, 80), (50.0, 38.0), pitch)) < 1.6

    def differ(depth):
        along_y, along_x = np.gradient(depth - free, pitch[1], pitch[0])
        return np.sum(along_x**2 + along_y**2)

    found = differ(nearest_pressed(free, support, pitch, boundary))
    assert found < 0.75 * differ(free * support)
    if pitch[0] != pitch[1]:
        assert found < differ(nearest_pressed(free, support, pitch[::-1], boundary))


@given(st.integers(1, 40), st.integers(1, 40), st.sampled_from(["dirichlet", "neumann"]))
@settings(max_examples=20, deadline=None)
def test_the_nearest_depth_of_any_size_is_pressed_in_only(height, width, boundary):
    free = np.random.default_rng(height).normal(0, 0.3, (height, width)).astype(np.float32)
    found = nearest_pressed(free, np.ones((height, width), bool), (0.1, 0.1), boundary)
    assert found.shape == free.shape and found.dtype == free.dtype
    assert np.isfinite(found).all() and found.min() >= 0


def test_gel_that_may_have_moved_is_pressed_where_it_is_narrower_than_the_solver_s_pixels():
    line = np.zeros_like(EVERYWHERE)
    line[:, 50] = True  # of each pixel of the solver the least part
    for found in (
        pressed_depth(GRADIENT, line, both=True, coarseness=4),
        nearest_pressed(CAP.depth_mm.astype(np.float32), line, PITCH, "dirichlet"),
    ):
        assert found[line].max() > 0.1 * CAP.depth_mm.max()


@pytest.mark.parametrize("answer", [by_columns, by_convex_fit])
@pytest.mark.parametrize("axis", ["x", "y"])
def test_baselines_beat_zero_keep_what_is_known_and_know_their_axes(answer, axis):
    lost, known = (0, 1) if axis == "x" else (1, 0)
    found = answer(GRADIENT[..., known], axis, PITCH)
    np.testing.assert_allclose(found[..., known], GRADIENT[..., known], atol=1e-6)
    error = np.abs(found[..., lost] - GRADIENT[..., lost])[JUDGED].sum()
    assert error < 0.5 * np.abs(GRADIENT[..., lost])[JUDGED].sum()


def test_the_convex_fit_bears_noise_that_columns_do_not():
    noisy = GRADIENT[..., 1] + np.random.default_rng(1).normal(0, 0.04, EVERYWHERE.shape)
    columns, fitted = (
        np.abs(answer(noisy, "x", PITCH)[..., 0] - GRADIENT[..., 0])[JUDGED].sum()
        for answer in (by_columns, by_convex_fit)
    )
    assert fitted < 0.5 * columns
