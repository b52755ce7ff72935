# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Frames turned and turned back, and depth by lights on lines in any direction."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from recon.ball import ball_cap
from recon.depth import depth_of
from recon.estimators.mlp import Mlp
from recon.missing_axis.turned import Turn
from tests.recon.fast.units import random_default, random_mlp

pitches = st.sampled_from([(0.1, 0.1), (0.08, 0.12), (0.12, 0.08)])
angles = st.floats(-45, 45)


@given(by_deg=angles, pitch_mm=pitches)
def test_a_plane_s_slope_turns_as_a_vector_and_comes_back(by_deg, pitch_mm):
    turn = Turn(size_px=(80, 60), mm_per_px=pitch_mm, by_deg=by_deg)
    tilt = np.array([0.3, -0.1], np.float32)
    turned = turn.slopes(np.broadcast_to(tilt, (60, 80, 2)))
    a = np.radians(by_deg)
    along = np.array([[np.cos(a), np.sin(a)], [-np.sin(a), np.cos(a)]]) @ tilt
    middle = tuple(length // 2 for length in turned.shape[:2])
    np.testing.assert_allclose(turned[middle], along, atol=1e-5)
    back = turn.slopes_back(turned)[20:40, 25:55]
    np.testing.assert_allclose(back, np.broadcast_to(tilt, back.shape), atol=1e-5)


@given(by_deg=angles, pitch_mm=pitches)
def test_all_of_a_frame_lies_in_the_turned_one_with_its_area(by_deg, pitch_mm):
    turn = Turn(size_px=(80, 60), mm_per_px=pitch_mm, by_deg=by_deg)
    inner = np.zeros((60, 80), bool)
    inner[1:-1, 1:-1] = True
    turned = turn.mask(inner)
    assert not turned[[0, -1]].any() and not turned[:, [0, -1]].any()
    assert turned.sum() == pytest.approx(inner.sum(), rel=0.03)


@given(by_deg=angles, pitch_mm=pitches)
def test_a_map_comes_back_to_its_place(by_deg, pitch_mm):
    turn = Turn(size_px=(80, 60), mm_per_px=pitch_mm, by_deg=by_deg)
    cap = ball_cap((80, 60), (50.0, 20.0), 1.2, 1.8, pitch_mm)
    there = turn.slopes(np.repeat(cap.depth_mm[..., None], 2, -1).astype(np.float32))
    back = turn.slopes_back(there)[..., 0]
    assert np.abs(back - cap.depth_mm).mean() < 0.02 * cap.depth_mm.max()
    assert np.abs(back - cap.depth_mm).max() < 0.25 * cap.depth_mm.max()  # at its rim


def seen(estimator, line_deg, pitch_mm):
    """Depth of a ball by lights on one line, which see the slope along it with some noise."""
    cap = ball_cap((160, 120), (75.0, 56.0), 2.2, 3.0, pitch_mm)
    along = np.array([np.cos(np.radians(line_deg)), np.sin(np.radians(line_deg))])
    noise = 0.02 * np.random.default_rng(0).standard_normal(cap.depth_mm.shape)
    gradient = ((cap.gradient @ along + noise)[..., None] * along).astype(np.float32)
    lights_deg = {"R": line_deg, "B": line_deg + 180}
    found = depth_of(
        gradient,
        cap.depth_mm > 0,
        estimator,
        missing="network",
        lights_deg=lights_deg,
        mm_per_px=pitch_mm,
    )
    return found, cap


@pytest.mark.parametrize("line_deg", [20.0, 45.0, 60.0, 110.0, 135.0, -140.0])
@pytest.mark.parametrize("pitch_mm", [(0.1, 0.1), (0.1, 0.13)])
def test_a_ball_is_as_deep_by_lights_on_any_line(line_deg, pitch_mm):
    found, cap = seen(random_mlp(channels="RB"), line_deg, pitch_mm)
    touched = cap.depth_mm > 0
    error = (found.depth_mm - cap.depth_mm)[touched]
    assert np.sqrt(np.mean(error**2)) < 0.05 * cap.depth_mm.max()
    assert (
        np.abs(found.gradient - cap.gradient)[touched].mean()
        < 0.2 * np.abs(cap.gradient[touched]).mean()
    )
    assert found.depth_mm.min() >= 0 and found.doubt is not None
    assert np.isfinite(found.doubt).all() and found.doubt.shape == touched.shape


@pytest.mark.parametrize("estimator", [random_mlp(channels="RB"), random_default(channels="RB")])
def test_a_line_beside_an_axis_gives_nearly_what_the_axis_gives(estimator):
    """Frames are turned from some degrees on: depth does not leap there."""
    on_axis, _ = seen(estimator, 94.9, (0.1, 0.1))
    turned, _ = seen(estimator, 95.1, (0.1, 0.1))
    assert np.abs(on_axis.depth_mm - turned.depth_mm).max() < 0.2 * on_axis.depth_mm.max()
    assert isinstance(estimator, Mlp) or estimator.looks_around
