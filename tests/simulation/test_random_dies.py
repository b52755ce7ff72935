# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Random dies: flat faces that stand on zero, walls that are steeper than a ball's."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from benchmarks.rendered_presses import die_presses
from sensor.design import FINGER, STANDARD
from simulation.presses import skin_under
from simulation.random_dies import DEPTHS_MM, EDGES_MM, random_die
from simulation.skin import gel_view

WIDEST_MM = 8.0
PITCH_MM = 0.02
X_MM, Y_MM = np.meshgrid(*(np.arange(-6, 6, PITCH_MM),) * 2)
STEEPEST_OF_BALLS = 1.4
"""Slope of a ball that is pressed in by 0.42 of its radius, the deepest."""


@settings(max_examples=30, deadline=None)
@given(seed=st.integers(0, 2**32 - 1))
def test_a_die_is_flat_but_for_its_edge_and_no_wider_than_it_says(seed: int) -> None:
    die = random_die(np.random.default_rng(seed), WIDEST_MM)
    height = die.profile(X_MM, Y_MM)
    inside = np.isfinite(height)
    assert not np.isnan(height).any()
    assert (height[inside] >= 0).all() and (height[inside] <= EDGES_MM[1]).all()
    assert DEPTHS_MM[0] <= die.depth_mm <= DEPTHS_MM[1]
    assert max(die.size_mm) <= WIDEST_MM
    again = random_die(np.random.default_rng(seed), WIDEST_MM).profile(X_MM, Y_MM)
    np.testing.assert_array_equal(height, again)


def test_most_of_a_dies_underside_is_its_face() -> None:
    shares = []
    for seed in range(40):
        height = random_die(np.random.default_rng(seed), WIDEST_MM).profile(X_MM, Y_MM)
        shares.append((height[np.isfinite(height)] == 0).mean())
    assert np.median(shares) > 0.7


@pytest.mark.parametrize("design", [STANDARD, FINGER])
def test_dies_can_be_pressed_and_their_walls_are_steeper_than_balls(design) -> None:
    view = gel_view(design, 160)
    steepest = []
    for press in die_presses(design, 24, 5):
        depth_mm = skin_under(design, view, press).depth_mm
        assert depth_mm.max() <= press.depth_mm + 1e-3
        along = np.gradient(depth_mm, *view.mm_per_px[::-1])
        steepest.append(np.hypot(*along).max())
    assert np.mean(np.array(steepest) > 1) > 0.3
    assert design is not FINGER or max(steepest) > STEEPEST_OF_BALLS
