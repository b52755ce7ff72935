# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""The print that an object leaves in the gel is not the object."""

from dataclasses import replace

import pytest

from recon.pose.tracker import LEAST_DEPTH, REGISTRATIONS, Tracker
from tests.recon.pose.touched import bead_pairs


@pytest.mark.parametrize("name", REGISTRATIONS)
def test_a_print_as_wide_as_the_object_but_hardly_deep_is_said_to_be_lost(name):
    first, second, _ = bead_pairs()[0]
    track = Tracker(name)
    assert track(first).state == "tracking"
    share = LEAST_DEPTH / 2
    left = replace(second, depth_mm=second.depth_mm * share, gradient=second.gradient * share)
    found = track(left)
    assert found.state == "lost" and found.reason == "too little of the object touches"
    assert found.T_sensor_object is None
    assert track(second).state == "tracking"


def test_a_light_touch_alone_is_no_print():
    first, second, _ = bead_pairs()[0]
    share = LEAST_DEPTH / 2
    light = [
        replace(touch, depth_mm=touch.depth_mm * share, gradient=touch.gradient * share)
        for touch in (first, second)
    ]
    track = Tracker()
    for touch in light:
        assert "too little" not in track(touch).reason
