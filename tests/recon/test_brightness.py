# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""By how much the light over a blank gel has changed, where it is known."""

import numpy as np
import pytest

from recon.brightness import MARGIN, brightness_change, inner
from recon.markers.tracking import marker_tracker
from tests.dotted import dotted, grid_px

SHAPE = (90, 120, 3)


def test_a_light_of_another_strength_differs_by_its_share_and_only_lit_colours_are_named():
    gel = np.full(SHAPE, 0.2, np.float32)
    gel[..., 0] = np.linspace(0.2, 0.8, 120)[None]
    for before in (2 * gel, gel / 1.5):
        change = brightness_change(before, gel, "RB")
        assert change == pytest.approx({"R": 0.5, "B": 0.5}, rel=1e-3)


@pytest.mark.parametrize("share", [0.0, 0.2])
def test_dots_are_no_light_wherever_they_are(share):
    light = np.full((120, 160, 3), 0.5)
    places = grid_px(16.0, size=(160, 120))
    before = dotted(places, 2.5, light).astype(np.float32)
    now = dotted(places + 5.0, 2.5, (1 - share) * light, seed=1).astype(np.float32)
    assert marker_tracker(before) is not None and marker_tracker(now) is not None
    change = brightness_change(before, now, "RGB")
    assert change == pytest.approx(dict.fromkeys("RGB", share), abs=0.02)


def test_light_that_changed_in_one_place_is_no_matter_of_the_mean():
    before = np.full(SHAPE, 0.4, np.float32)
    part, tilted = before.copy(), before.copy()
    part[:, :30, 1] *= 0.5  # of a row of lights one
    tilted *= np.linspace(0.6, 1.4, 120, dtype=np.float32)[None, :, None]
    assert brightness_change(before, part, "RGB") == pytest.approx(
        {"R": 0, "G": 0.5, "B": 0}, abs=0.02
    )
    assert tilted.mean() == pytest.approx(0.4, rel=1e-3)
    assert min(brightness_change(before, tilted, "RGB").values()) > 0.3
    part = before.copy()
    part[:10, :10] = 0  # a speck is wear
    assert max(brightness_change(before, part, "RGB").values()) < 0.1


def test_the_margin_is_left_out_on_all_sides():
    left = np.ones((100, 200))[inner((100, 200))]
    assert left.shape == (100 - 2 * round(100 * MARGIN), 200 - 2 * round(200 * MARGIN))


def test_two_gray_levels_in_a_dark_corner_are_no_change_of_the_lights():
    before = np.full(SHAPE, 102 / 255, np.float32)
    before[:, :20] = 1 / 255  # a sixth of the pad is hardly lit
    now = before.copy()
    now[:, :20] = 3 / 255
    assert max(brightness_change(before, now, "RGB").values()) < 0.15
