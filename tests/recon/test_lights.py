# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from recon.lights import (
    ALIGNED_DEG,
    LEAST_TURN_DEG,
    OBLIQUE_DEG,
    azimuth_deg,
    line_turn_deg,
    sits_like_wedge,
    unseen_axis,
)
from sensor.design import FINGER, STANDARD
from tests.synthetic import shaded

WEDGE = {"R": 90.0, "G": 180.0, "B": -90.0}
azimuths = st.floats(-720, 720)


@pytest.mark.parametrize(
    ("channels", "axis"),
    [("R", "x"), ("B", "x"), ("RB", "x"), ("G", "y"), ("RG", None), ("GB", None), ("RGB", None)],
)
def test_each_light_of_the_wedge_sees_its_own_axis(channels, axis):
    assert unseen_axis(WEDGE, channels) == axis


@pytest.mark.parametrize("channels", ["R", "G", "B", "RB", "RGB"])
def test_the_unseen_axis_is_the_one_that_leaves_no_trace_in_the_shading(channels):
    used = {channel: WEDGE[channel] for channel in channels}
    for axis, lost in (("x", 0), ("y", 1)):
        gradient = np.zeros((1, 2, 2))
        gradient[0, 1, lost] = 1e-3
        flat, tilted = shaded(gradient, used)[0]
        seen = np.abs(tilted - flat).max() > 1e-5  # a trace of first order, not of second
        assert seen == (unseen_axis(WEDGE, channels) != axis)


@given(st.integers(-720, 720), st.integers(-720, 720), st.integers(-2, 2))
def test_whole_turns_and_opposite_lights_change_nothing(one, two, turns):
    one, two = one + 0.25, two + 0.5  # never on a limit, where rounding decides
    for other in (one + 360 * turns, one + 180):
        lights, same = {"R": one, "B": two}, {"R": other, "B": two}
        assert unseen_axis(lights, "RB") == unseen_axis(same, "RB")
        assert line_turn_deg(lights, "RB") == pytest.approx(line_turn_deg(same, "RB"), abs=1e-6)


@given(azimuths)
def test_one_light_lies_on_its_own_line_beside_the_axis_that_it_sees(angle):
    lights = {"G": angle}
    along = np.radians((90 if unseen_axis(lights, "G") == "x" else 0) + line_turn_deg(lights, "G"))
    assert abs(np.sin(along - np.radians(angle))) < np.sin(np.radians(LEAST_TURN_DEG)) + 1e-6
    assert abs(line_turn_deg(lights, "G")) <= 45 + 1e-6


@given(st.integers(0, 179), st.integers(0, 89))
def test_two_lights_lie_on_one_line_if_they_are_near_an_axis_or_each_other(middle, half):
    middle, half = middle + 0.3, half + 0.4
    lights = {"R": middle - half, "B": middle + half + 180}
    apart = min(half, 90 - half)  # from their line, which may be the other bisector
    near = [
        max(abs((angle - axis + 90) % 180 - 90) for angle in lights.values()) < ALIGNED_DEG
        for axis in (0, 90)
    ]
    assert (unseen_axis(lights, "RB") is not None) == (apart < OBLIQUE_DEG or any(near))


def test_where_nobody_said_where_the_lights_sit_nothing_is_claimed():
    assert unseen_axis(None, "RB") is None
    assert unseen_axis({"R": 90.0}, "RB") is None
    assert not sits_like_wedge(None)


@pytest.mark.parametrize(
    ("angle", "same"), [(-180.0, 180.0), (540.0, 180.0), (-179.0, -179.0), (270.0, -90.0)]
)
def test_an_azimuth_lies_above_minus_180_and_up_to_180(angle, same):
    assert azimuth_deg(angle) == same


@pytest.mark.parametrize("design", [STANDARD, FINGER])
def test_our_designs_sit_like_the_wedge(design):
    assert sits_like_wedge(design.lights.azimuths_deg)


@given(st.floats(-25, 25))
def test_a_wedge_is_one_whichever_way_red_and_blue_face(off):
    assert sits_like_wedge({"R": 90 + off, "B": -90 + off, "G": 180.0})
    assert sits_like_wedge({"R": 270 + off, "B": 450 + off, "G": -360.0})


@pytest.mark.parametrize(
    "lights",
    [
        {"R": 90.0, "B": 90.0, "G": 180.0},
        {"R": 90.0, "B": -90.0, "G": 90.0},
        {"R": 0.0, "B": 180.0, "G": 90.0},
        {"R": 0.0, "G": 120.0, "B": 240.0},
        {"R": 90.0, "B": -90.0},
    ],
    ids=["same side", "green along y", "turned", "three around", "no green"],
)
def test_other_lights_do_not_sit_like_the_wedge(lights):
    assert not sits_like_wedge(lights)
