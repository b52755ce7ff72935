# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""What the live page says of an object's pose and of a gel's dots."""

import base64
from dataclasses import replace

import numpy as np
import pytest

from app.pages.following import FORGET_S, Follower, KeptTouch, pose_words
from recon.pose.rigid import motion
from recon.pose.tracker import PoseEstimate
from recon.stream.jpeg import decode_jpeg
from tests.dotted import HEIGHT, WIDTH, dotted, grid_px
from tests.recon.fast.units import make_unit
from tests.recon.pose.touched import SIZE_PX, bead_pairs, blank
from tests.synthetic import digitized


def test_dots_that_moved_are_counted_and_measured() -> None:
    unit = make_unit((WIDTH, HEIGHT))
    card = replace(unit.card, mm_per_px=(0.1, 0.1), size_px=(WIDTH, HEIGHT))
    places = grid_px()
    unit = replace(unit, card=card, background=digitized(dotted(places)))
    follow = Follower(unit, None)
    flat = np.zeros((HEIGHT, WIDTH), np.float32)
    touch = KeptTouch(
        gradient=np.zeros((HEIGHT, WIDTH, 2), np.float32),
        depth_mm=flat,
        contact=flat > 0,
        mm_per_px=(0.1, 0.1),
    )
    found = follow(digitized(dotted(places + np.array([2.0, 0]))), touch, 0.0)
    assert found.markers.startswith(f"{len(places)} of {len(places)} dots seen")
    assert float(found.markers.split("moved ")[1].split()[0]) == pytest.approx(0.2, abs=0.02)
    still = follow(digitized(dotted(places)), touch, 0.1)
    arrows = [
        decode_jpeg(base64.b64decode(item.picture.partition(",")[2])).std()
        for item in (found, still)
    ]
    assert arrows[0] > arrows[1]


def test_after_a_second_without_touch_the_next_object_is_new() -> None:
    first, second, _ = bead_pairs()[0]
    unit = make_unit(SIZE_PX)
    follow = Follower(unit, None)
    for now_s, touch, state, pose in (
        (0.0, blank(), "lost", "nothing touches"),
        (0.1, first, "tracking", "turn +0.0 +0.0 +0.0°"),
        (0.2, second, "tracking", "turn"),
        (0.3, blank(), "lost", "nothing touches"),
        (0.4 + FORGET_S, blank(), "lost", "nothing touches"),
        (0.5 + FORGET_S, second, "tracking", "turn +0.0 +0.0 +0.0°"),
    ):
        found = follow(unit.background, touch, now_s)
        assert found.state == state and found.pose.startswith(pose)
        assert found.markers == "none on this gel"


def test_a_pose_is_told_with_its_doubt() -> None:
    pose = motion(np.array([0, 0, np.radians(5), 1.0, 0, 0]))
    doubt = np.diag([0, 0, np.radians(2) ** 2, 0.3**2, 0, 0])
    found = PoseEstimate(state="weak", reason="why", T_sensor_object=pose, covariance=doubt)
    assert "+5.0° ± 2.0°" in pose_words(found) and "mm ± 0.30 mm; why" in pose_words(found)
