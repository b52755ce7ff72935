# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Still gel is made flat, and nothing of a dent is lost with it."""

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from recon.integration.poisson import integrate
from recon.still import CLEAR_SLOPE, FARTHEST, LONG_COLLAR, REACH, reach_of, without_still


def dent(height, width, sigma):
    """Slopes of a bell in the middle, px/px, and where it is deeper than a fifth."""
    y, x = np.mgrid[:height, :width].astype(np.float32)
    depth = 0.8 * sigma * np.exp(-((x - width / 2) ** 2 + (y - height / 2) ** 2) / (2 * sigma**2))
    along_y, along_x = np.gradient(depth)
    return np.stack([along_x, along_y], -1).astype(np.float32), depth > 0.2 * depth.max(), depth


@pytest.mark.parametrize("shape", [(240, 320), (480, 640), (90, 120)])
def test_a_dent_keeps_its_depth_at_every_size_and_drift_far_away_goes(shape):
    height, width = shape
    clean, disturbed, depth = dent(height, width, height / 16)
    drift = np.random.default_rng(0).standard_normal((height, width, 2)).astype(np.float32)
    drift = cv2.GaussianBlur(drift, (0, 0), height / 20)
    found = without_still(clean + 0.01 * drift / drift.std(), disturbed)
    assert (found[0] == 0).all() and (found[:, -1] == 0).all()
    np.testing.assert_allclose(without_still(clean, disturbed), clean, atol=0.03)
    kept = integrate(without_still(clean, disturbed), (1.0, 1.0), "dirichlet")
    assert abs(kept.max() - depth.max()) < 0.02 * depth.max()


def test_a_flat_top_in_thick_gel_keeps_its_depth_though_its_collar_fades_slowly():
    """Depth of gel on springs beside a straight wall fades by exp(-x / s) (``simulation.skin``)."""
    y, x = np.mgrid[:240, :320]
    outside = np.maximum(np.hypot(x - 159.5, y - 119.5) - 50, 0)
    depth = 6.5 * np.exp(-outside / 9.5)  # 0.4 mm in 5 mm of gel, 0.06 mm/px
    clean = np.stack(np.gradient(depth)[::-1], -1).astype(np.float32)
    found = without_still(clean, outside == 0, reach_of(0.046))  # its collar, fitted beside balls
    kept = integrate(found, (1.0, 1.0), "dirichlet")
    assert abs(kept[120, 160] / 6.5 - 1) < 0.04


@given(collar=st.floats(0, 1), longer=st.floats(0, 1))
def test_gel_of_a_longer_collar_reaches_farther_within_bounds(collar, longer):
    near, far = reach_of(min(collar, longer)), reach_of(max(collar, longer))
    assert REACH <= near <= far <= FARTHEST
    assert reach_of(np.nan) == REACH


@pytest.mark.parametrize("times", [1.1, 1.3])
def test_the_reach_grows_as_the_cube_of_a_long_collar(times):
    assert reach_of(times * LONG_COLLAR) == pytest.approx(REACH * times**3)
    assert reach_of(LONG_COLLAR / times) == REACH


def test_steep_slopes_are_kept_where_the_colour_says_nothing():
    clean, _, _ = dent(120, 160, 8.0)
    nothing = np.zeros((120, 160), bool)
    found = without_still(clean, nothing)
    steep = np.linalg.norm(clean, axis=-1) > 0.3
    np.testing.assert_array_equal(found[steep], clean[steep])


def test_flat_gel_stays_flat_and_the_margin_is_as_wide_as_said():
    point = np.zeros((96, 96), bool)
    point[48, 48] = True
    found = without_still(np.full((96, 96, 2), 0.01, np.float32), point)
    assert (found[..., 0] > 0).sum() == (2 * round(REACH * 96) + 1) ** 2
    assert (without_still(np.zeros((96, 96, 2), np.float32), point) == 0).all()


def test_noise_is_no_contact_though_single_pixels_of_it_are_steep():
    noise = np.random.default_rng(0).normal(0, CLEAR_SLOPE, (240, 320, 2)).astype(np.float32)
    assert not without_still(noise, np.zeros((240, 320), bool)).any()
