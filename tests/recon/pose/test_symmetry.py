# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from benchmarks.pose_search import block, bolt, hull, prism
from recon.pose import symmetry
from recon.pose.mesh import Mesh
from recon.pose.rigid import angle_deg, applied, inverse, rigid
from recon.pose.symmetry import nearest_turn, own_rotations

CORNERS = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], float)
TETRAHEDRON = 4 * CORNERS[CORNERS.prod(1) > 0]
WEDGE = np.array([[0, 0, 0], [10, 0, 0], [2, 7, 0], [1, 1, 5.0]])


def cut_finely(mesh: Mesh) -> Mesh:
    """Each triangle in three, so that facets are no longer cut as their likes are."""
    middles = mesh.vertices_mm[mesh.triangles[::2]].mean(1)
    vertices = np.concatenate([mesh.vertices_mm, middles])
    new = np.arange(len(middles)) + len(mesh.vertices_mm)
    a, b, c = mesh.triangles[::2].T
    parts = [np.stack(item, -1) for item in ((a, b, new), (b, c, new), (c, a, new))]
    return Mesh(vertices_mm=vertices, triangles=np.concatenate([mesh.triangles[1::2], *parts]))


@pytest.mark.parametrize(
    ("mesh", "count"),
    [
        (block(np.array([9, 9, 9])), 24),
        (block(np.array([9, 9, 6])), 8),
        (block(np.array([10, 8, 6])), 4),
        (hull(TETRAHEDRON), 12),
        (prism(6, 5, 0, 4), 12),
        (bolt(np.random.default_rng(0)), 6),
        (hull(WEDGE), 1),
    ],
)
def test_a_body_has_as_many_own_rotations_as_its_group(mesh, count):
    somewhere = rigid(Rotation.random(random_state=3).as_matrix(), np.array([30, -20, 5.0]))
    moved = Mesh(vertices_mm=applied(somewhere, mesh.vertices_mm), triangles=mesh.triangles)
    for body in (moved, cut_finely(moved)):
        turns = own_rotations(body)
        assert len(turns) == count
        np.testing.assert_array_equal(turns[0], np.eye(4))
        for turn in turns:
            away = applied(turn, moved.vertices_mm)[:, None] - moved.vertices_mm
            assert np.linalg.norm(away, axis=-1).min(1).max() < 1e-6
        between = [angle_deg(one @ inverse(two)) for one in turns for two in turns]
        assert np.count_nonzero(np.array(between) < 1) == count


def test_a_mark_on_one_side_is_no_symmetry():
    cube = block(np.array([9, 9, 9.0]))
    tip = hull(np.array([[-1, -1, 4.5], [1, -1, 4.5], [0, 1, 4.5], [0, 0, 5.0]]))
    marked = Mesh(
        vertices_mm=np.concatenate([cube.vertices_mm, tip.vertices_mm]),
        triangles=np.concatenate([cube.triangles, tip.triangles + len(cube.vertices_mm)]),
    )
    assert len(own_rotations(marked)) == 1


def test_which_way_a_facet_is_longer_counts():
    """Strips on a cube's sides as the seam of a ball runs: no quarter turn takes them along."""
    strip = np.array([[-3, -1, 9], [3, -1, 9], [3, 1, 9], [-3, 1, 9]], float)
    sides = [
        np.roll(side * strip * [1, side, 1], by, axis=1) for side in (1, -1) for by in range(3)
    ]
    triangles = np.array([[0, 1, 2], [0, 2, 3]])
    mesh = Mesh(
        vertices_mm=np.concatenate(sides),
        triangles=np.concatenate([triangles + 4 * number for number in range(6)]),
    )
    assert len(own_rotations(mesh)) == 12


@pytest.mark.parametrize(("sides", "count"), [(240, 480), (260, 1)])
def test_a_body_of_too_many_turns_is_round_and_has_the_identity_alone(sides, count):
    assert len(own_rotations(prism(sides, 5, 0, 4))) == count


def test_a_sheet_of_one_facet_has_the_identity_alone():
    corners = np.array([[0, 0, 0], [9, 0, 0], [9, 9, 0], [0, 9, 0.0]])
    sheet = Mesh(vertices_mm=corners, triangles=np.array([[0, 1, 2], [0, 2, 3]]))
    assert len(own_rotations(sheet)) == 1


def test_of_poses_that_look_the_same_the_least_turned_is_named():
    turns = own_rotations(block(np.array([9, 9, 9.0])))
    for number in range(10):
        pose = rigid(Rotation.random(random_state=number).as_matrix(), np.array([1, 2, 3.0]))
        found = pose @ nearest_turn(pose, np.eye(4), turns)
        assert angle_deg(found) == pytest.approx(min(angle_deg(pose @ turn) for turn in turns))
        assert angle_deg(found) < 62.8  # no turn is farther from all 24
        other = pose @ turns[number]
        np.testing.assert_allclose(other @ nearest_turn(other, np.eye(4), turns), found, atol=1e-6)


def globe(around: int) -> Mesh:
    """A ball of flat facets between circles of latitude and of longitude."""
    down = (np.arange(around // 2) + 0.5) * 2 * np.pi / around
    angles = np.arange(around) * 2 * np.pi / around
    ring = np.stack([np.cos(angles), np.sin(angles), 0 * angles], -1)
    return hull(np.concatenate([[0, 0, np.cos(at)] + np.sin(at) * ring for at in down]) * 5)


def test_each_turn_of_a_ball_is_tried_on_some_of_its_facets_only(monkeypatch):
    asked = []

    class Counted(symmetry.cKDTree):
        def query(self, places, *args, **options):
            asked.append(len(places))
            return super().query(places, *args, **options)

    monkeypatch.setattr(symmetry, "cKDTree", Counted)
    ball, around = globe(80), 80
    turns = own_rotations(ball)
    assert len(turns) == 2 * around
    facets = around * (around // 2 - 1) + 2
    assert sum(asked) < 0.2 * len(turns) * facets


def test_a_turn_that_takes_all_but_a_few_facets_to_their_likes_is_none():
    """Of two corners pulled out of a ball, either could be the other one, turned."""
    ball = globe(40)
    assert len(own_rotations(ball)) == 80
    for steps in range(1, 20):  # along a circle of latitude
        places = ball.vertices_mm.copy()
        places[[80, 80 + steps]] *= 1.03
        assert len(own_rotations(replace(ball, vertices_mm=places))) == 1


def test_small_unlikenesses_around_an_ellipse_do_not_add_up():
    rod = prism(240, 1, 0, 4)
    oval = Mesh(vertices_mm=rod.vertices_mm * [5, 4.9, 1], triangles=rod.triangles)
    for turn in own_rotations(oval):
        moved = applied(turn, oval.vertices_mm) - [0, 0, 2]
        stretched = np.hypot(moved[:, 0] / 5, moved[:, 1] / 4.9)
        assert np.abs(stretched - 1).max() < 0.01
