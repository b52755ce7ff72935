# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""A ball fitted to colours: what its model makes is found again, and its derivatives are true."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from recon.labels.ball_fit import (
    Near,
    _normal,
    _rest_and_change,
    _terms,
    fit_ball,
    unexplained,
)

BALL_PX = 30.0
LOWEST, HIGHEST = np.array([30.0, 20.0, 4.0, -0.7]), np.array([50.0, 40.0, 28.0, 3.0])
OFF_GRID = np.array([0.1237, 0.3141, 0.0517, 0.0])
EVERYWHERE = np.mgrid[0:60, 0:80].reshape(2, -1)[::-1].astype(np.float64)


def near_of(parameters: np.ndarray, seed: int, noise: float = 0.0) -> Near:
    """Pixels whose colours are some mix of the model's terms, and noise."""
    rng = np.random.default_rng(seed)
    x_px, y_px = EVERYWHERE
    blank = Near(x_px=x_px, y_px=y_px, color=np.zeros((3, len(x_px))))
    terms = _terms(*_normal(parameters, blank, BALL_PX))
    color = rng.normal(size=(3, 7)) @ terms + noise * rng.normal(size=(3, len(x_px)))
    return Near(x_px=x_px, y_px=y_px, color=color)


@pytest.mark.parametrize("seed", range(4))
def test_a_contact_that_the_model_made_is_found_again(seed: int) -> None:
    rng = np.random.default_rng([seed, 1])
    true = np.array([*rng.uniform((36, 26), (44, 34)), rng.uniform(10, 20), rng.uniform(0.5, 2)])
    near, weight = near_of(true, seed), rng.uniform(0.2, 1, EVERYWHERE.shape[1])
    first = true + np.array([3.0, -2.0, 2.0, 0.4])
    found = fit_ball(near, weight, BALL_PX, first, (LOWEST, HIGHEST), 1e-9)
    assert found == pytest.approx(true, abs=1e-3)
    assert np.abs(unexplained(found, near, weight, BALL_PX)).max() < 1e-3
    assert np.abs(unexplained(first, near, weight, BALL_PX)).max() > 0.01


def test_a_contact_larger_than_allowed_is_as_large_as_allowed_and_otherwise_the_best() -> None:
    near, weight = near_of(np.array([41.0, 29.0, 14.0, 1.0]), 0), np.ones(EVERYWHERE.shape[1])
    highest = np.array([50.0, 40.0, 12.0, 3.0])
    first = np.array([44.0, 27.0, 11.0, 0.5])
    found = fit_ball(near, weight, BALL_PX, first, (LOWEST, highest), 1e-9)
    assert found[2] == 12 and (found >= LOWEST).all()
    rest, change = _rest_and_change(found, near, near.color * weight, weight, BALL_PX)
    gradient = change @ rest / np.linalg.norm(change, axis=1) / np.linalg.norm(rest)
    assert gradient[[0, 1, 3]] == pytest.approx(0, abs=1e-3) and gradient[2] < -0.01


@settings(max_examples=25)
@given(
    seed=st.integers(0, 1000),
    center=st.tuples(st.floats(32, 48), st.floats(22, 38)),
    radius=st.floats(5, 25),
    log_fade=st.floats(-0.5, 2.5),
)
def test_the_gradient_is_that_of_the_sum_of_squares(seed, center, radius, log_fade):
    # No pixel lies on the rim, where the slope bends.
    parameters = np.array([*center, radius, log_fade]) + OFF_GRID
    near = near_of(np.array([41.0, 29.0, 14.0, 1.0]), seed, noise=0.05)
    weight = np.random.default_rng(seed).uniform(0.2, 1, EVERYWHERE.shape[1])

    def half_squares(at: np.ndarray) -> float:
        return float((unexplained(at, near, weight, BALL_PX) ** 2).sum() / 2)

    rest, change = _rest_and_change(parameters, near, near.color * weight, weight, BALL_PX)
    assert rest == pytest.approx(unexplained(parameters, near, weight, BALL_PX).ravel(), abs=1e-9)
    steps = 1e-5 * np.eye(4)
    by_steps = [half_squares(parameters + d) - half_squares(parameters - d) for d in steps]
    assert change @ rest == pytest.approx(np.array(by_steps) / 2e-5, rel=1e-3, abs=1e-2)


def test_the_pixel_at_the_very_centre_tells_where_the_centre_is():
    """There the normal points nowhere, yet turns fastest with the centre."""
    parameters = np.array([40.0, 30.0, 14.0, 1.0])
    blank = Near(x_px=np.array([40.0]), y_px=np.array([30.0]), color=np.zeros((3, 1)))
    steps = 1e-5 * np.eye(4)[:2]
    for axis, step in enumerate(steps):
        more, less = (_normal(parameters + d, blank, BALL_PX)[axis] for d in (step, -step))
        assert (more - less) / 2e-5 == pytest.approx(1 / BALL_PX, rel=1e-6)
