# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from recon.ball import ball_cap
from recon.missing_axis.moved import FLANK, MARGIN_PX, may_have_moved, widest_support

CAP = ball_cap((96, 80), (50.0, 38.0), 20.0, 26.0, (1.0, 1.0))
ALONG_Y = CAP.gradient[..., 1].astype(np.float32)


def halves(least):
    """What a light along y sees of the ball: an upper and a lower half."""
    return np.abs(ALONG_Y) > least


@pytest.mark.parametrize("least", [0.05, 0.2, 0.4])
def test_two_halves_of_a_ball_are_one_contact(least):
    disturbed = halves(least)
    assert cv2.connectedComponents(disturbed.astype(np.uint8))[0] == 3
    moved = may_have_moved(disturbed, ALONG_Y)
    inside = (CAP.depth_mm > 0) & disturbed.any(0)
    assert moved[inside].all() and moved[disturbed].all()


def test_two_balls_one_above_the_other_stay_apart():
    both = np.concatenate([ALONG_Y, ALONG_Y])
    disturbed = np.abs(both) > 0.05
    moved = may_have_moved(disturbed, both)
    between = np.s_[60 + MARGIN_PX : 97 - MARGIN_PX]  # rows of flat gel
    assert not moved[between].any() and moved[38].any() and moved[118].any()


def test_a_notch_in_a_patch_is_filled_along_the_lights_alone():
    disturbed = np.zeros((40, 40), bool)
    disturbed[10:30, 10:30] = True
    disturbed[14:26, 20:30] = False
    flat = np.zeros(disturbed.shape)
    assert may_have_moved(disturbed, flat)[20, 25]
    assert not may_have_moved(disturbed.T, flat).T[20, 27]


def test_nothing_disturbed_is_nothing_moved():
    nothing = np.zeros((20, 30), bool)
    assert not may_have_moved(nothing, np.ones((20, 30))).any()


def test_the_outline_of_disturbed_gel_has_a_margin():
    dot = np.zeros((90, 90), bool)
    dot[40, 40] = True
    moved = may_have_moved(dot, np.zeros(dot.shape))
    across_px = MARGIN_PX + round(FLANK * 90)
    assert moved[40, 40 + across_px] and not moved[40, 41 + across_px]
    assert moved[40 + MARGIN_PX, 40] and not moved[41 + MARGIN_PX, 40]


def test_flanks_that_tilt_across_the_lights_count_as_moved():
    shown = halves(0.8)
    with_margin = cv2.dilate(shown.astype(np.uint8), np.ones((1, 2 * MARGIN_PX + 1)))
    assert not with_margin.any(0)[30:71].all()  # of the columns from rim to rim
    assert may_have_moved(shown, ALONG_Y)[38, 30:71].all()


@given(seed=st.integers(0, 10_000), patches=st.integers(0, 4), steepness=st.floats(0.1, 3))
def test_no_slopes_make_more_move_than_the_widest_support(seed, patches, steepness):
    rng = np.random.default_rng(seed)
    disturbed = np.zeros((60, 70), bool)
    for top, left, height, width in rng.integers(0, 30, (patches, 4)):
        disturbed[2 * top : 2 * top + height, 2 * left : 2 * left + width] = True
    slopes = steepness * cv2.GaussianBlur(rng.standard_normal(disturbed.shape), (0, 0), 3)
    widest = widest_support(disturbed, "x")
    assert widest[may_have_moved(disturbed, slopes)].all()
    across = widest_support(disturbed, "y")
    assert across[may_have_moved(disturbed.T, slopes.T).T].all()
    assert widest.any() == disturbed.any()
    columns = np.flatnonzero(disturbed.any(0))
    beyond = np.ones(disturbed.shape[1], bool)
    reach = MARGIN_PX + round(FLANK * min(disturbed.shape))
    for column in columns:
        beyond[max(0, column - reach) : column + reach + 1] = False
    assert not widest[:, beyond].any()
