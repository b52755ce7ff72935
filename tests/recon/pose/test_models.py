# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""What a touch is compared with: the keyframe in reach, or the mesh drawn where it is."""

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.pose_search import block
from benchmarks.touches import pressed
from recon.pose.joint import Joint
from recon.pose.models import (
    CLOSE_DEG,
    CLOSE_MM,
    REACH_DEG,
    REACH_MM,
    RENDER_DEG,
    RENDER_MM,
    Keyframe,
    MeshModel,
    TouchModel,
    keyframe,
)
from recon.pose.registration import contact_middle, contact_points
from recon.pose.rigid import applied, motion
from recon.pose.tracker import REGISTRATIONS, Tracker
from sensor.errors import WedgeError
from tests.recon.pose.touched import bead_pair, coarse_bead, touches


def of_bead() -> Keyframe:
    return keyframe(bead_pair(0)[0], np.eye(4), np.zeros((6, 6)), Joint())


def turned_deg(angle: float, about: np.ndarray) -> np.ndarray:
    """About the gel's normal through a point, which stays where it is."""
    turn = motion(np.array([0, 0, np.radians(angle), 0, 0, 0]))
    turn[:3, 3] = about - turn[:3, :3] @ about
    return turn


def shifted_mm(length: float) -> np.ndarray:
    return motion(np.array([0, 0, 0, 0.6 * length, -0.8 * length, 0]))


def test_a_keyframe_is_in_reach_by_its_turn_and_by_its_shift() -> None:
    item = of_bead()
    model = TouchModel(keyframes=[item])
    like = item.pyramid.touch
    for share, found in ((0.9, item), (1.1, None)):
        assert model.near(turned_deg(share * REACH_DEG, item.middle), like) is found
        assert model.near(shifted_mm(share * REACH_MM), like) is found


def test_the_nearest_keyframe_is_compared_with() -> None:
    item = of_bead()
    items = [replace(item, T_sensor_object=shifted_mm(length)) for length in (-0.8, 0.1, 0.9)]
    model = TouchModel(keyframes=items)
    for length, wanted in ((-0.6, items[0]), (0.3, items[1]), (0.7, items[2])):
        assert model.near(shifted_mm(length), item.pyramid.touch) is wanted


def test_a_search_begins_with_touches_that_were_given_and_not_with_those_learnt() -> None:
    item = of_bead()
    given = [replace(item, covariance=number * np.eye(6)) for number in range(2)]
    model = TouchModel(keyframes=list(given))
    model.learn(replace(item, covariance=9 * np.eye(6)))
    touch = bead_pair(0)[1]
    center = contact_points(touch).mean(0)
    guesses = list(model.guesses(touch))
    assert {id(known) for known, _ in guesses} == {id(known) for known in given}
    for known, pose in guesses:
        if pose is not known.T_sensor_object:  # then its contact comes to lie on the touch's
            np.testing.assert_allclose(applied(pose, known.middle), center, atol=1e-9)


@pytest.mark.parametrize(
    ("close", "most_deg", "most_mm"), [(False, RENDER_DEG, RENDER_MM), (True, CLOSE_DEG, CLOSE_MM)]
)
def test_a_mesh_is_drawn_anew_where_it_turned_or_shifted_by_more(close, most_deg, most_mm) -> None:
    mesh = block(np.array([10.0, 10, 10]))
    start = motion(np.array([0.5, 0.6, 0, 0, 0, 0]))
    start[2, 3] = -1.3 - applied(start, mesh.vertices_mm)[:, 2].min()
    like = bead_pair(0)[0]
    for share, again in ((0.9, True), (1.1, False)):
        for way in ("turn", "shift"):
            model = MeshModel(mesh=mesh, registration=Joint())
            first = model.near(start, like)
            assert first is not None
            moved = turned_deg(share * most_deg, first.middle)
            if way == "shift":
                moved = shifted_mm(share * most_mm)
            assert (model.near(moved @ start, like, close=close) is first) == again


def test_a_mesh_is_drawn_anew_for_a_sensor_of_another_size_or_pitch() -> None:
    mesh = block(np.array([10.0, 10, 10]))
    start = motion(np.array([0.5, 0.6, 0, 0, 0, 0]))
    start[2, 3] = -1.3 - applied(start, mesh.vertices_mm)[:, 2].min()
    like = bead_pair(0)[0]
    model = MeshModel(mesh=mesh, registration=Joint())
    for size_px, mm_per_px in (((80, 60), like.mm_per_px), ((160, 120), (0.2, 0.2))):
        other = pressed(coarse_bead(), np.eye(4), None, size_px=size_px, mm_per_px=mm_per_px)
        for sensor in (like, other, like):
            drawn = model.near(start, sensor)
            assert drawn is not None and drawn is model.near(start, sensor)
            own = drawn.pyramid.touch
            assert own.depth_mm.shape == sensor.depth_mm.shape
            assert own.mm_per_px == sensor.mm_per_px


@pytest.mark.parametrize(("name", "other"), [("gicp", "joint"), ("joint", "plane")])
def test_a_model_of_another_registration_is_refused(name: str, other: str) -> None:
    first = bead_pair(0)[0]
    mesh = block(np.array([10.0, 10, 10]))
    for model in (
        MeshModel(mesh=mesh, registration=REGISTRATIONS[other]),
        touches([(first, np.eye(4))], REGISTRATIONS[other]),
    ):
        with pytest.raises(WedgeError, match=f"registration of the tracker, '{name}'"):
            Tracker(name, model)
        Tracker(other, model)


def test_the_middle_of_a_contact_is_that_of_its_points() -> None:
    seen = bead_pair(0)[0]
    np.testing.assert_allclose(contact_middle(seen), contact_points(seen).mean(0), atol=1e-6)
    empty = replace(seen, contact=np.zeros_like(seen.contact))
    np.testing.assert_array_equal(contact_middle(empty), np.zeros(3))
