# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
from dataclasses import replace

import numpy as np
import pytest

from recon.pose.estimate import PoseEstimate
from recon.pose.rest import rest_at
from recon.pose.rigid import applied, motion
from sensor.design import STANDARD
from tests.recon.pose.touched import bead_pair
from validation.figures.png import png_bytes
from validation.figures.tracking import (
    LIGHT,
    anchor_on,
    overlay,
    pose_figure,
    pose_picture,
    roll_figure,
    series,
)

LOST = PoseEstimate(state="lost", reason="nothing touches")


def turned(angle_deg: float) -> PoseEstimate:
    twist = np.array([0, 0, np.radians(angle_deg), 0, 0, 0])
    return PoseEstimate(
        state="tracking", T_sensor_object=motion(twist), covariance=1e-4 * np.eye(6)
    )


def test_a_turn_beyond_half_a_circle_has_no_jump():
    turn, shift, spread = series([turned(angle) for angle in (0, 90, 170, 190, 270, 350)])
    np.testing.assert_allclose(turn[:, 2], [0, 90, 170, 190, 270, 350], atol=1e-6)
    np.testing.assert_allclose(shift, 0, atol=1e-12)
    np.testing.assert_allclose(spread[0], [*3 * [np.degrees(0.01)], *3 * [0.01]])


def test_after_a_whole_turn_an_error_is_not_blown_up():
    """At half a turn an error of the axis weighs pi / 2, and whole turns about it weigh double."""
    wrong = motion(np.array([np.radians(1), 0, 0, 0, 0, 0]))
    found = [turned(angle) for angle in range(0, 361, 10)]
    found = [replace(item, T_sensor_object=item.T_sensor_object @ wrong) for item in found]
    turn, _, _ = series(found)
    np.testing.assert_allclose(turn[:, 2], np.arange(0, 361, 10), atol=0.1)
    assert np.abs(turn[:, :2]).max() < 1.001 * np.pi


def test_what_is_lost_is_a_gap():
    turn, shift, spread = series([LOST, turned(5), LOST])
    assert np.isnan(turn[[0, 2]]).all() and np.isnan(shift[[0, 2]]).all()
    assert np.isfinite(spread[1]).all()


def test_figures_are_drawn_even_of_nothing():
    for found in ([LOST], [LOST, turned(3), LOST]):
        picture = png_bytes(pose_figure([0.1 * i for i in range(len(found))], found, "clip"), 40)
        assert picture[:4] == b"\x89PNG"
    assert png_bytes(roll_figure([0.0, 90.0], {"joint": [0.1, 0.2]}, "roll"), 40)[:4] == b"\x89PNG"


def test_curves_are_told_apart_without_their_colours_and_a_lone_pose_is_seen():
    found = [turned(1), turned(2), LOST, turned(3), LOST]
    roll = roll_figure([0.0, 90.0], {name: [0.1, 0.2] for name in "abcd"}, "roll")
    for axes in (*pose_figure([0.1 * i for i in range(5)], found, "clip").axes, *roll.axes):
        named = [line for line in axes.lines if not line.get_label().startswith("_")]
        assert len(named) in (3, 4)
        assert len({line.get_linestyle() for line in named}) == len(named)
    axes = pose_figure([0.1 * i for i in range(5)], found, "clip").axes[0]
    dots = [line.get_xdata() for line in axes.lines if line.get_marker() == "."]
    assert len(dots) == 3 and all(list(x) == [pytest.approx(0.3)] for x in dots)


@pytest.mark.filterwarnings("error")
def test_a_name_that_the_font_lacks_is_drawn_without_a_warning():
    figure = pose_figure([0.0, 0.1], [LOST, turned(3)], "Prüf ström 指")
    assert png_bytes(figure, 40)[:4] == b"\x89PNG"
    assert figure.axes[0].get_title(loc="left") == "Prüf ström ?"


def test_axes_are_drawn_from_a_point_of_the_skin_on_the_gel_of_the_pose():
    touch, _, pose = bead_pair(3)
    aside = {name: np.roll(getattr(touch, name), 30, 1) for name in ("depth_mm", "contact")}
    touch = replace(touch, **aside)
    on_flat, on_curve = (applied(pose, anchor_on(touch, pose, gel)) for gel in (None, STANDARD.gel))
    assert on_flat[2] == pytest.approx(-touch.depth_mm.max(), abs=1e-6)
    rest_mm, _ = rest_at(STANDARD.gel, on_curve[:1], on_curve[1:2])
    assert rest_mm > 0.04
    column, row = (on_curve[:2] / touch.mm_per_px + np.array([79.5, 59.5])).round().astype(int)
    assert on_curve[2] == pytest.approx(-touch.depth_mm[row, column] - rest_mm[0], abs=1e-5)


def test_axes_stand_where_the_object_is():
    image = np.zeros((90, 120, 3), np.float32)
    contact = np.zeros((90, 120), bool)
    seen = (image, contact, (0.1, 0.1))
    drawn = pose_picture(*seen, turned(0), np.array([2.0, 1.0, 0.0]))
    assert drawn.shape == (480, 640, 3)
    rows, columns = np.nonzero((drawn == 255).all(-1))
    scale = 640 / 120
    assert abs(columns.mean() / scale - (59.5 + 20 + 0.5)) < 0.5
    assert abs(rows.mean() / scale - (44.5 + 10 + 0.5)) < 0.5
    inked = np.argwhere((drawn == LIGHT).all(-1))[:, ::-1] - [427, 293]
    x, y = inked.T
    for past_its_end in (x > 165, y > 165, (x < -5) & (y < -5)):  # the letters of x, y and z
        assert past_its_end.sum() > 20
    assert not pose_picture(*seen, LOST, None).any()
    with_words = overlay(*seen, LOST, None)
    assert with_words[480:].any() and not with_words[:480].any()
