# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from benchmarks.pose_search import (
    Case,
    block,
    cut_off,
    drawn_case,
    held,
    lying,
    noisy,
    off,
    polyhedron,
)
from recon.pose.estimate import PoseEstimate
from recon.pose.joint import Joint
from recon.pose.mesh import Mesh
from recon.pose.models import MeshModel
from recon.pose.rigid import angle_deg, applied, inverse, rigid, shift_mm
from recon.pose.search import APART_DEG, APART_MM, _apart, sifted
from recon.pose.symmetry import nearest_turn, own_rotations
from recon.pose.tracker import Tracker


def searched(mesh: Mesh, touch) -> PoseEstimate:
    return Tracker("joint", MeshModel(mesh=mesh, registration=Joint()))(touch)


@pytest.mark.parametrize("number", [6, 26, 31])
def test_a_random_pose_of_a_random_polyhedron_is_found(number):
    touched = drawn_case("polyhedra", number)
    assert_found(touched, searched(touched.mesh, touched.touch))


def assert_found(touched: Case, found: PoseEstimate) -> None:
    assert found.words == "tracking"
    angle, away = off(touched, found.T_sensor_object, own_rotations(touched.mesh))
    assert angle < 1 and away < 0.05


def test_a_corner_of_a_cube_is_found_and_told_as_turned_least():
    mesh = block(np.array([10.0, 10, 10]))
    turn = Rotation.from_euler("z", 35, degrees=True).as_matrix() @ standing_on_a_corner()
    pose = lying(mesh, turn, 1.3)
    track = Tracker("joint", MeshModel(mesh=mesh, registration=Joint()))
    found = track(noisy(mesh, pose, np.random.default_rng(1), 2.0))
    assert found.words == "tracking"
    own = own_rotations(mesh)
    expected = pose @ nearest_turn(pose, np.eye(4), own)
    left = inverse(expected) @ found.T_sensor_object
    assert angle_deg(left) < 1 and shift_mm(left) < 0.1
    moved = rigid(Rotation.from_euler("z", 4, degrees=True).as_matrix(), np.array([0.2, 0, 0]))
    followed = track(noisy(mesh, moved @ pose, np.random.default_rng(2), 2.0))
    left = inverse(moved @ expected) @ followed.T_sensor_object
    assert followed.words == "tracking" and angle_deg(left) < 1 and shift_mm(left) < 0.1


def test_what_a_touch_leaves_open_stays_weak():
    slab, ridge = block(np.array([90.0, 90, 12])), block(np.array([90.0, 12, 12]))
    tilted = Rotation.from_euler("x", 5, degrees=True).as_matrix()
    lowest = rigid(tilted, np.array([0, 0, 5.6]))
    on_edge = rigid(Rotation.from_euler("x", 40, degrees=True).as_matrix(), np.zeros(3))
    on_edge[2, 3] = -1.0 - applied(on_edge, ridge.vertices_mm)[:, 2].min()
    for mesh, pose in ((slab, lowest), (ridge, on_edge)):
        found = searched(mesh, noisy(mesh, pose, np.random.default_rng(3), 2.0))
        assert found.state == "weak"


def test_corners_of_a_box_are_alike_and_that_is_said():
    mesh = block(np.array([12.0, 10, 8]))
    pose = lying(mesh, standing_on_a_corner(), 1.3)
    found = searched(mesh, noisy(mesh, pose, np.random.default_rng(1), 2.0))
    assert found.words == "weak: several poses fit this touch"


def test_every_picture_that_a_search_draws_is_compared(monkeypatch):
    drawn, compared = [], []
    draw, align = MeshModel._rendered, Joint.align

    def drawing(*args):
        drawn.append(draw(*args))
        return drawn[-1]

    def comparing(self, reference, *args):
        compared.append(reference)
        return align(self, reference, *args)

    monkeypatch.setattr(MeshModel, "_rendered", drawing)
    monkeypatch.setattr(Joint, "align", comparing)
    touched = drawn_case("polyhedra", 1)
    assert_found(touched, searched(touched.mesh, touched.touch))
    assert {id(item.prepared) for item in drawn} == {id(item) for item in compared}


@pytest.mark.parametrize("number", [0, 6, 8])
def test_a_pose_is_off_by_as_much_as_its_covariance_says(number):
    """Where sides are cliffs, where edges run between pixels, and where the frame cuts it off."""
    touched = drawn_case("polyhedra", number)
    model = MeshModel(mesh=touched.mesh, registration=Joint())
    told = Tracker("joint", model, touched.pose)(touched.touch)
    assert held(touched, told, [np.eye(4)]) < 3


def test_a_pose_of_which_a_shift_is_not_seen_is_a_rival_still():
    touched = drawn_case("bolts", 4)
    found = searched(touched.mesh, touched.touch)
    angle, away = off(touched, found.T_sensor_object, own_rotations(touched.mesh))
    assert found.state == "weak" or (angle < 5 and away < 0.5)


def test_a_mesh_pressed_half_outside_of_the_frame_is_found():
    rng = np.random.default_rng(4)
    mesh = polyhedron(rng)
    pose = lying(mesh, Rotation.random(random_state=rng).as_matrix(), 1.4)
    pose = cut_off(mesh, pose, 0.5, rng)
    found = searched(mesh, noisy(mesh, pose, rng, 4.0))
    left = inverse(pose) @ found.T_sensor_object
    assert found.words == "tracking" and angle_deg(left) < 2 and shift_mm(left) < 0.2


@pytest.mark.parametrize("share", [1.0, 0.6])
def test_how_deep_a_mesh_is_pressed_follows_from_how_much_of_it_touches(share):
    rng = np.random.default_rng(5)
    mesh = polyhedron(rng)
    pose = cut_off(mesh, lying(mesh, Rotation.random(random_state=2).as_matrix(), 1.4), share, rng)
    touch = noisy(mesh, pose, rng, 0.0)
    shallow = replace(touch, depth_mm=0.7 * touch.depth_mm)
    guesses = sifted(mesh, shallow, [np.eye(4)], 16)
    near = [guess for guess in guesses if angle_deg(guess @ inverse(pose)) < 8]
    assert near and abs(applied(near[0], mesh.vertices_mm)[:, 2].min() + 1.4) < 0.2


def test_poses_are_apart_by_turn_or_by_shift_or_by_a_turn_of_the_object_s_own() -> None:
    center, best = np.array([3.0, -2, -0.5]), lying(block(np.full(3, 10.0)), np.eye(3), 1.0)
    own = [np.eye(4), rigid(np.diag([-1.0, -1, 1]), np.zeros(3))]

    def moved(angle: float, away: float) -> np.ndarray:
        """About the middle of what is seen, and then aside."""
        turn = Rotation.from_euler("y", angle, degrees=True).as_matrix()
        return rigid(turn, center - turn @ center + [0.6 * away, 0, 0.8 * away]) @ best

    far = [moved(1.1 * APART_DEG, 0.0), moved(0.0, 1.1 * APART_MM)]
    near = [moved(0.9 * APART_DEG, 0.0), moved(0.0, 0.9 * APART_MM), best @ own[1]]
    found = _apart(np.stack([best, *near, *far, *near]), own, center, 9)
    np.testing.assert_allclose(found, [best, *far])
    assert len(_apart(np.stack([best, *far]), own, center, 2)) == 2


def standing_on_a_corner() -> np.ndarray:
    return Rotation.align_vectors([[0.0, 0, -1]], [[1.0, 1, 1]])[0].as_matrix()
