# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""What the live page says of an object's pose and of a gel's dots."""

import base64
from dataclasses import replace

import numpy as np
import pytest

from app.pages.following import APART, PoseView, pose_words
from recon.follower import Follower
from recon.pose.estimate import PoseEstimate
from recon.pose.rigid import motion
from recon.stream.jpeg import decode_jpeg
from tests.dotted import dotted, grid_px
from tests.recon.fast.units import make_unit
from tests.recon.pose.touched import MM_PER_PX, SIZE_PX, bead_pair, blank
from tests.synthetic import digitized


def test_dots_that_moved_are_counted_measured_and_drawn() -> None:
    places = grid_px(16.0, size=SIZE_PX)
    gel = np.full((*SIZE_PX[::-1], 3), 0.5)
    unit = make_unit(SIZE_PX)
    unit = replace(unit, background=digitized(dotted(places, 2.0, gel)))
    follow, view = Follower(unit), PoseView(apart=False)
    moved = digitized(dotted(places + np.array([2.0, 0]), 2.0, gel))
    shown = [view(follow(frame, blank(), 0.0)) for frame in (moved, unit.background)]
    assert shown[0].markers.startswith(f"{len(places)} of {len(places)} dots seen")
    assert shown[0].markers.endswith("but the unit was calibrated without: calibrate it anew")
    found_mm = float(shown[0].markers.split("moved ")[1].split()[0])
    assert found_mm == pytest.approx(2 * MM_PER_PX[0], abs=0.02)
    drawn = [decode_jpeg(base64.b64decode(item.picture.partition(",")[2])) for item in shown]
    assert drawn[0].std() > drawn[1].std()
    height, width = drawn[0].shape[:2]
    assert height / width == pytest.approx(SIZE_PX[1] / SIZE_PX[0], abs=0.01)  # words are beside it


def test_a_new_object_has_its_axes_where_it_touches() -> None:
    first, second, _ = bead_pair(0)
    unit, view = make_unit(SIZE_PX), PoseView(apart=False)
    follow = Follower(unit)
    felt = [follow(unit.background, touch, 0.0) for touch in (first, second)]
    shown = [view(item) for item in felt]
    assert shown[0].pose.startswith("turn +0.0 +0.0 +0.0°")
    assert (shown[0].state, shown[0].markers) == ("tracking", "none on this gel")
    assert shown[1].pose != shown[0].pose
    again = view(replace(felt[0], object_number=1, touch=felt[1].touch))
    assert again.picture != view(felt[0]).picture


def test_a_pose_is_told_with_its_doubt() -> None:
    pose = motion(np.array([0, 0, np.radians(5), 1.0, 0, 0]))
    doubt = np.diag([0, 0, np.radians(2) ** 2, 0.3**2, 0, 0])
    found = PoseEstimate(state="weak", reason="why", T_sensor_object=pose, covariance=doubt)
    assert "+5.0° ± 2.0°" in pose_words(found) and "mm ± 0.30 mm; why" in pose_words(found)


def test_touches_that_have_nothing_to_do_with_each_other_have_no_pose() -> None:
    unit, view = make_unit(SIZE_PX), PoseView(apart=True)
    follow = Follower(unit)
    shown = [view(follow(unit.background, touch, 0.0)) for touch in bead_pair(0)[:2]]
    assert {(item.state, item.pose) for item in shown} == {("–", APART)}
    axes = np.array((230, 159, 0))  # of y, orange; nothing else is as colourful
    for apart, drawn in ((True, False), (False, True)):
        felt = Follower(unit)(unit.background, bead_pair(0)[0], 0.0)
        picture = decode_jpeg(base64.b64decode(PoseView(apart)(felt).picture.partition(",")[2]))
        assert (np.abs(picture.astype(int) - axes).max(-1) < 40).any() == drawn
    nothing = view(follow(unit.background, blank(), 0.0))
    assert nothing.pose != APART and nothing.state != "tracking"
