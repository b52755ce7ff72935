# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest

from recon.contact.disturbed import BORDER_PX
from recon.contact.patches import LEAST_PX, contact_patches, contact_word

ROWS, COLUMNS = np.indices((80, 121))


def disc(x, y, radius):
    return np.hypot(COLUMNS - x, ROWS - y) < radius


def test_patches_come_with_their_place_area_and_deepest_point():
    contact = disc(30, 40, 10) | disc(90, 40, 15)
    depth = 1.0 - 0.01 * np.hypot(COLUMNS - 32, ROWS - 43)
    large, small = contact_patches(contact, depth, (0.1, 0.2))
    assert large.area_mm2 == pytest.approx(np.pi * 15**2 * 0.02, rel=0.03)
    assert small.area_mm2 == pytest.approx(np.pi * 10**2 * 0.02, rel=0.03)
    assert small.center_mm == pytest.approx((-3.0, 0.1))
    assert small.deepest_at_mm == pytest.approx((-2.8, 0.7))
    assert small.deepest_mm == pytest.approx(1.0)
    assert large.deepest_mm == pytest.approx(depth[disc(90, 40, 15)].max())


def test_the_word_says_whether_how_many_and_whether_the_border_cuts():
    depth = np.ones(ROWS.shape)
    nothing = np.zeros(ROWS.shape, bool)
    words = {
        "no contact": nothing,
        "1 patch": disc(60, 40, 10),
        "2 patches": disc(30, 40, 10) | disc(90, 40, 10),
        "1 patch, cut by the border": disc(0, 40, 10),
        "2 patches, cut by the border": disc(30, 40, 10) | disc(90, 79, 10),
    }
    for word, mask in words.items():
        assert contact_word(contact_patches(mask, depth, (0.1, 0.1))) == word


def test_specks_are_no_patches():
    speck = disc(60, 40, 1)
    assert speck.any()
    assert not contact_patches(speck, np.ones(ROWS.shape), (0.1, 0.1))


@pytest.mark.parametrize(("away_px", "cut"), [(0, True), (BORDER_PX - 1, True), (BORDER_PX, False)])
@pytest.mark.parametrize("turn", range(4))
def test_what_comes_within_a_few_pixels_of_the_border_is_cut(away_px, cut, turn):
    contact = np.zeros(ROWS.shape, bool)
    contact[away_px : away_px + 9, 40:60] = True
    contact = np.rot90(contact, turn).copy()
    (patch,) = contact_patches(contact, np.ones(contact.shape), (0.1, 0.1))
    assert patch.at_border == cut


@pytest.mark.parametrize("area_px", range(1, LEAST_PX + 3))
def test_a_patch_has_at_least_so_many_pixels(area_px):
    contact = np.zeros(ROWS.shape, bool)
    contact[40, 60 : 60 + area_px] = True
    found = contact_patches(contact, np.ones(ROWS.shape), (0.1, 0.1))
    assert len(found) == (area_px >= LEAST_PX)


def test_a_patch_s_deepest_point_is_its_own_though_a_deeper_one_lies_in_its_box():
    corner = ((COLUMNS < 20) | (ROWS > 60)) & (COLUMNS < 90)  # an L
    within = disc(60, 30, 8)
    depth = 0.2 * (corner | within)
    depth[40, 6], depth[32, 62] = 0.3, 0.9
    large, small = contact_patches(corner | within, depth, (0.1, 0.2))
    assert (large.deepest_mm, small.deepest_mm) == (0.3, 0.9)
    assert large.deepest_at_mm == pytest.approx(((6 - 60) * 0.1, (40 - 39.5) * 0.2))


def test_pixels_that_touch_at_a_corner_are_of_one_patch():
    contact = np.zeros(ROWS.shape, bool)
    contact[30:40, 30:40] = contact[40:50, 40:50] = True
    assert len(contact_patches(contact, np.ones(ROWS.shape), (0.1, 0.1))) == 1
