# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Errors are means over pixels; intervals draw presses."""

import numpy as np
import pytest

from validation.metrics import METRICS, fitted_curvature, mean_errors, press_errors


def errors_of(rng, scale, pixels=200):
    truth = rng.normal(size=(pixels, 2)).astype(np.float32)
    estimated = truth + scale * rng.choice([-1, 1], size=(pixels, 2)).astype(np.float32)
    return press_errors("press", estimated.astype(np.float32), truth, np.ones(pixels, bool))


def test_a_perfect_estimate_has_no_error():
    rng = np.random.default_rng(0)
    errors = mean_errors([errors_of(rng, 0.0) for _ in range(4)], seed=0)
    assert set(errors.values.values()) == {0.0}
    assert set(errors.ci95.values()) == {(0.0, 0.0)}


def test_a_constant_error_is_found_with_no_spread():
    rng = np.random.default_rng(0)
    errors = mean_errors([errors_of(rng, 0.25, n) for n in (10, 300, 70)], seed=0)
    for name in ("gx_mae", "gy_mae"):
        assert errors.values[name] == pytest.approx(0.25, abs=1e-6)
        assert errors.ci95[name] == pytest.approx((0.25, 0.25), abs=1e-6)
    assert errors.n_pixels == 380


def test_angles_are_those_of_the_slopes():
    truth = np.zeros((1, 2), np.float32)
    estimated = np.array([[1.0, np.tan(np.radians(30))]], np.float32)
    errors = mean_errors([press_errors("press", estimated, truth, np.ones(1, bool))], seed=0)
    assert errors.values["theta_x_deg"] == pytest.approx(45, abs=1e-4)
    assert errors.values["theta_y_deg"] == pytest.approx(30, abs=1e-4)


def ball_slopes(offset_mm, radius_mm):
    return -offset_mm / np.sqrt(radius_mm**2 - (offset_mm**2).sum(1, keepdims=True))


@pytest.mark.parametrize("share", [0.8, 1.0, 1.25, -1.25])
@pytest.mark.parametrize("tilt", [0.0, 0.02])
def test_slopes_of_another_ball_have_its_curvature_wherever_the_press_was_cut(share, tilt):
    offset_mm = np.random.default_rng(0).uniform((-1, -1), (1, 0.2), (400, 2))
    found = ball_slopes(offset_mm, share * 4.0) if share > 0 else -ball_slopes(offset_mm, 5.0)
    truth = ball_slopes(offset_mm, 4.0)
    assert fitted_curvature(found + tilt, truth) == pytest.approx(1 / share, abs=5e-3)
    assert fitted_curvature(np.full_like(truth, tilt), truth) == pytest.approx(0, abs=1e-9)


def test_the_median_press_s_curvature_counts():
    truth = ball_slopes(np.random.default_rng(0).uniform(-1, 1, (50, 2)), 4.0).astype(np.float32)
    presses = [press_errors("press", k * truth, truth, np.ones(50, bool)) for k in (0, 0.5, 1)]
    assert mean_errors(presses, seed=0).curvature == pytest.approx(0.5, abs=0.02)


def test_only_the_chosen_pixels_count():
    truth = np.zeros((2, 2), np.float32)
    estimated = np.array([[0.5, 0.5], [9.0, 9.0]], np.float32)
    kept = press_errors("press", estimated, truth, np.array([True, False]))
    assert kept.n_pixels == 1
    assert kept.absolute[0] == pytest.approx(0.5)


def test_intervals_cover_the_spread_between_presses_not_pixels():
    """Presses of one error each: more pixels per press must not narrow the interval."""

    def width(pixels):
        rng = np.random.default_rng(1)
        presses = [errors_of(rng, scale, pixels) for scale in np.linspace(0.1, 0.5, 10)]
        low, high = mean_errors(presses, seed=0).ci95["gx_mae"]
        return high - low

    assert width(5000) == pytest.approx(width(50), rel=0.05)
    assert width(50) > 0.1


def test_intervals_cover_the_truth_nineteen_times_of_twenty():
    """Of five presses that scatter by a quarter."""
    rng = np.random.default_rng(2)
    covered = 0
    for trial in range(200):
        presses = [errors_of(rng, scale, 20) for scale in rng.normal(0.2, 0.05, size=5)]
        low, high = mean_errors(presses, seed=trial).ci95["gx_mae"]
        covered += low <= 0.2 <= high
    assert 0.91 <= covered / 200 <= 0.99


def test_few_presses_do_not_tell_how_presses_scatter():
    rng = np.random.default_rng(0)
    found = [mean_errors([errors_of(rng, 0.1) for _ in range(count)], 0) for count in (1, 2, 3)]
    assert found[0].ci95 == found[1].ci95 == dict.fromkeys(METRICS)
    assert all(low < high for low, high in found[2].ci95.values())


def test_the_gradient_s_mean_is_over_pixels_and_both_axes():
    truth = np.array([[0.2, -0.4], [0.0, 0.6]], np.float32)
    errors = mean_errors([press_errors("press", truth, truth, np.ones(2, bool))], seed=0)
    assert errors.mean_abs_gradient == pytest.approx(0.3)


def test_names_are_the_tables():
    rng = np.random.default_rng(0)
    assert tuple(mean_errors([errors_of(rng, 0.1)], seed=0).values) == METRICS


def test_a_press_of_few_pixels_says_little():
    rng = np.random.default_rng(0)
    presses = [*(errors_of(rng, 0.1, 1000) for _ in range(6)), errors_of(rng, 5.0, 1)]
    errors = mean_errors(presses, seed=0)
    assert errors.values["gx_mae"] == pytest.approx(0.1 + 4.9 / 6001)
    assert errors.ci95["gx_mae"] == pytest.approx((0.1, 0.1), abs=0.01)
