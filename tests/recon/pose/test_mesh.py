# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0

import itertools
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial import ConvexHull
from scipy.spatial.transform import Rotation

from benchmarks.touches import OBLIQUE_DEG, SyntheticTouch, cube_corner
from recon.integration.poisson import integrate
from recon.pose.estimate import PoseEstimate
from recon.pose.joint import Joint
from recon.pose.mesh import CONTACT_DEPTH_MM, Mesh, averaged, read_mesh, render, under_side
from recon.pose.models import MeshModel
from recon.pose.pyramid import Pyramid
from recon.pose.registration import pixel_grid_mm
from recon.pose.rigid import angle_deg, applied, inverse, motion, rigid, shift_mm
from recon.pose.tracker import Tracker
from sensor.errors import WedgeError
from tests.recon.pose.touched import (
    MM_PER_PX,
    SIZE_PX,
    bead_pair,
    blank,
    coarse_bead,
    corner,
    touch,
)

SIDE_MM = 10.0


def cube(scale: float = 1.0) -> Mesh:
    """With the corner that touches at the origin, its sides along the axes."""
    return brick(np.full(3, SIDE_MM * scale))


def brick(sides_mm: np.ndarray) -> Mesh:
    """A corner of one with unlike sides looks like its other corners."""
    places = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], float)
    sides = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    triangles = [t for a, b, c, d in sides for t in ((a, b, c), (a, c, d))]
    return Mesh(vertices_mm=-sides_mm * places, triangles=np.array(triangles))


def standing(press_mm: float = 2.0) -> np.ndarray:
    """The pose in which the mesh is the bench's cube corner."""
    upright = Rotation.align_vectors([[0.0, 0, -1]], [[1.0, 1, 1]])[0]
    turn = Rotation.from_euler("z", OBLIQUE_DEG, degrees=True) * upright
    return rigid(turn.as_matrix(), np.array([0, 0, -press_mm]))


def polyhedron(seed: int) -> Mesh:
    """Fourteen random corners, no two alike: from the right side each pose looks like no other."""
    rng = np.random.default_rng(seed)
    ways = rng.standard_normal((14, 3))
    ways /= np.linalg.norm(ways, axis=1, keepdims=True)
    corners = np.array([9, 7, 6]) * ways * rng.uniform(0.7, 1.1, (14, 1))
    return Mesh(vertices_mm=corners, triangles=ConvexHull(corners).simplices)


def lying(mesh: Mesh, number: int, press_mm: float = 1.2) -> np.ndarray:
    """A random pose in which the mesh is pressed so deep, near the middle."""
    turn = Rotation.random(random_state=number).as_matrix()
    corners = mesh.vertices_mm @ turn.T
    z_mm = -press_mm - corners[:, 2].min()
    return rigid(turn, np.array([*-under_side(corners, mesh.triangles, z_mm), z_mm]))


def seen(mesh: Mesh, pose: np.ndarray, seed: int) -> SyntheticTouch:
    drawn = render(mesh, pose, SIZE_PX, MM_PER_PX)
    noise = 0.04 * np.random.default_rng(seed).standard_normal(drawn.gradient.shape)
    gradient = (drawn.gradient + noise).astype(np.float32)
    depth = integrate(gradient, MM_PER_PX, "dirichlet").astype(np.float32)
    contact = depth > CONTACT_DEPTH_MM
    return SyntheticTouch(gradient=gradient, depth_mm=depth, contact=contact, mm_per_px=MM_PER_PX)


def is_right(found: PoseEstimate, pose: np.ndarray) -> bool:
    assert found.T_sensor_object is not None
    left = inverse(pose) @ found.T_sensor_object
    return angle_deg(left) < 2 and shift_mm(left) < 0.3


def test_a_rendered_corner_is_the_corner():
    exact = touch(cube_corner(2.0), np.eye(4), None)
    drawn = render(cube(), standing(), SIZE_PX, MM_PER_PX)
    inside = exact.contact & drawn.contact
    assert np.count_nonzero(exact.contact ^ drawn.contact) < 0.1 * np.count_nonzero(inside)
    assert np.median(np.abs(drawn.gradient - exact.gradient)[inside]) < 1e-5
    assert np.abs(drawn.depth_mm - exact.depth_mm)[inside].max() < 0.1


@pytest.mark.parametrize("pitch_mm", [0.07, 0.1, 0.13])
def test_a_plate_covers_as_many_pixels_wherever_its_edges_run_through_their_middles(pitch_mm):
    wide, high = 76, 40
    plate = brick(np.array([wide * pitch_mm, 10 * pitch_mm, 5.0]))
    counts = {
        np.count_nonzero(
            render(plate, rigid(np.eye(3), at), (2 * wide, high), (pitch_mm,) * 2).depth_mm
        )
        for column, row in itertools.product(range(0, wide // 2, 3), range(-3, 6))
        for at in [np.array([(column + 0.5) * pitch_mm, (row + 0.5) * pitch_mm, 4.9])]
    }
    assert counts == {(wide + 1) * 11}


@pytest.mark.parametrize("columns", [60, 61])
def test_a_ridge_is_its_own_mirror_image_wherever_it_runs_in_a_pixel(columns):
    ends = [[x, y, abs(x) - 1] for x in (-3.0, 0, 3) for y in (-8.0, 8)]
    sides = np.array([[0, 1, 2], [1, 3, 2], [2, 3, 4], [3, 5, 4]])
    ridge = Mesh(vertices_mm=np.array(ends), triangles=sides)
    slopes = averaged(ridge, np.eye(4), (columns, 20), (0.1, 0.1)).gradient[..., 0]
    assert np.abs(slopes).max() == pytest.approx(1, abs=1e-5)
    np.testing.assert_allclose(slopes, -slopes[:, ::-1], atol=1e-5)


@pytest.mark.parametrize("order", [(0, 1), (1, 0)])
def test_of_sides_above_each_other_the_lowest_is_felt(order):
    x_mm, y_mm = np.meshgrid(*pixel_grid_mm((60, 40), (0.2, 0.2)))
    heights = -1.0 - 0.1 * x_mm, -0.8 + 0.05 * x_mm - 0.02 * y_mm  # two that cross
    corners = np.array([[-30, -30], [30, -30], [0, 60]], float)
    points = [
        np.column_stack([corners, -1.0 - 0.1 * corners[:, 0]]),
        np.column_stack([corners, -0.8 + corners @ (0.05, -0.02)]),
    ]
    both = Mesh(
        vertices_mm=np.concatenate([points[index] for index in order]),
        triangles=np.array([[0, 1, 2], [3, 4, 5]]),
    )
    found = render(both, np.eye(4), (60, 40), (0.2, 0.2))
    np.testing.assert_allclose(found.depth_mm, -np.minimum(*heights), atol=1e-6)
    lower = (heights[0] < heights[1])[..., None]
    np.testing.assert_allclose(found.gradient, np.where(lower, (0.1, 0), (-0.05, 0.02)), atol=1e-6)


def test_triangles_that_would_fill_the_memory_are_refused():
    places = np.array([[-99.0, -99, -1], [99, -99, -1], [0, 99, -1]])
    sheets = Mesh(vertices_mm=places, triangles=np.tile(np.arange(3), (100, 1)))
    with pytest.raises(WedgeError, match="simplify"):
        render(sheets, np.eye(4), (640, 480), (0.02, 0.02))
    model = MeshModel(mesh=sheets, registration=Joint())
    with pytest.raises(WedgeError, match="simplify"):
        model.near(np.eye(4), render(cube(), np.eye(4), (640, 480), (0.02, 0.02)))


def test_after_a_lift_the_under_side_is_what_is_still_below():
    places = np.array([[3.0, 4, -1], [0, 0, -0.2], [9, 9, -0.2], [5, -5, 2]])
    triangles = np.array([[0, 1, 2], [0, 2, 3]])
    np.testing.assert_allclose(under_side(places, triangles, 0.5), [3, 4])


def test_of_a_cliff_slopes_show_nothing_and_of_a_gentle_side_all():
    flat = rigid(np.eye(3), np.array([SIDE_MM / 2, SIDE_MM / 2, SIDE_MM - 0.5]))
    assert averaged(cube(), flat, SIZE_PX, MM_PER_PX).unseen_mm == pytest.approx(0.5, abs=0.02)
    cut = rigid(np.eye(3), flat[:3, 3] + [8, 0, 0])
    assert averaged(cube(), cut, SIZE_PX, MM_PER_PX).unseen_mm == pytest.approx(0.5, abs=0.02)
    drawn = averaged(cube(), standing(), SIZE_PX, MM_PER_PX)
    assert abs(drawn.unseen_mm) < 0.02 * drawn.depth_mm[drawn.contact].mean()
    aside = motion(np.array([0, 0, 0, 9.0, 0, 0])) @ standing()
    drawn = averaged(cube(), aside, SIZE_PX, MM_PER_PX)
    assert drawn.contact[:, -1].any()
    assert abs(drawn.unseen_mm) < 0.02 * drawn.depth_mm[drawn.contact].mean()


def test_depth_that_slopes_do_not_show_is_doubted_as_far():
    mesh, unseen_mm = polyhedron(5), 0.2
    drawn = averaged(mesh, lying(mesh, 50), SIZE_PX, MM_PER_PX)
    current = Pyramid(seen(mesh, lying(mesh, 50), 1))
    sure, doubtful = (
        np.sqrt(np.diag(Joint().align(Pyramid(item), current, np.eye(4)).covariance))
        for item in (drawn, replace(drawn, unseen_mm=unseen_mm))
    )
    assert sure[5] < 0.01
    assert doubtful[5] == pytest.approx(unseen_mm, rel=0.1)
    assert (doubtful[:3] < 1.5 * sure[:3]).all()


@pytest.mark.parametrize("away_mm", [0.0, 500.0])
def test_a_mesh_is_followed_from_a_known_pose_wherever_its_frame_begins(away_mm):
    """Doubt about the turn is no doubt about where it touches, though the origin be far away."""
    T_mesh_corner = rigid(np.eye(3), np.array([away_mm, 0, 0]))
    first = standing() @ inverse(T_mesh_corner)
    mesh = replace(cube(), vertices_mm=applied(T_mesh_corner, cube().vertices_mm))
    track = Tracker("joint", MeshModel(mesh=mesh, registration=Joint()), first)
    moved = motion(np.array([0.02, -0.02, 0.02, 0.1, 0.1, -0.05]))
    for pose, seen in ((np.eye(4), corner()), (moved, touch(cube_corner(2.0), moved, 4))):
        found = track(seen)
        assert found.state == "tracking"
        assert angle_deg(inverse(pose @ first) @ found.T_sensor_object) < 1


def test_a_pose_is_found_from_all_sides():
    track = Tracker("joint", MeshModel(mesh=cube(), registration=Joint()))
    found = track(corner())
    assert found.words == "tracking"  # of 24 poses that look the same
    drawn = render(cube(), found.T_sensor_object, SIZE_PX, MM_PER_PX)
    inside = corner().contact & drawn.contact
    assert np.count_nonzero(inside) > 0.9 * np.count_nonzero(corner().contact)
    assert np.median(np.abs(drawn.depth_mm - corner().depth_mm)[inside]) < 0.02


def test_a_mesh_that_was_lost_is_searched_anew():
    mesh = polyhedron(1)
    first, lifted, jumped = (lying(mesh, number) for number in (10, 11, 12))
    track = Tracker("joint", MeshModel(mesh=mesh, registration=Joint()), first)
    assert is_right(track(seen(mesh, first, 0)), first)
    assert track(blank()).reason == "nothing touches"
    for seed in (1, 2):
        found = track(seen(mesh, lifted, seed))
        assert found.words == "tracking" and is_right(found, lifted)
    assert track(seen(mesh, jumped, 3)).state == "lost"
    for seed in (4, 5):
        found = track(seen(mesh, jumped, seed))
        assert found.words == "tracking" and is_right(found, jumped)


def test_doubt_of_a_search_stays_with_the_poses_that_follow_from_it():
    model = MeshModel(mesh=brick(np.array([9.0, 10, 11])), registration=Joint())
    track = Tracker("joint", model, standing())
    assert track(corner()).state == "tracking"  # somebody knew
    track(blank())
    turned = rigid(Rotation.from_euler("z", 50, degrees=True).as_matrix(), np.zeros(3))
    found = [track(touch(cube_corner(2.0), turned, seed)) for seed in (6, 7)]
    found += [track(item) for item in (blank(), touch(cube_corner(2.0), turned, 8))]
    assert [item.reason for item in found] == [
        "several poses fit this touch",
        "the touch by which it was found left it in doubt",
        "nothing touches",
        "the touch by which it was found left it in doubt",
    ]
    assert [item.state for item in found] == ["weak", "weak", "lost", "weak"]


@pytest.mark.parametrize(("number", "way"), [(11, 0), (13, 2)])
def test_a_wrong_pose_by_a_search_has_a_warning_and_keeps_it(number, way):
    mesh = polyhedron(number)
    pose = lying(mesh, 10 * number + way)
    track = Tracker("joint", MeshModel(mesh=mesh, registration=Joint()))
    for seed in (way, way + 50):
        found = track(seen(mesh, pose, seed))
        assert found.state != "tracking" or is_right(found, pose)


def test_a_touch_like_one_that_was_searched_in_vain_is_not_searched_again(monkeypatch):
    searches = []
    monkeypatch.setattr(MeshModel, "guesses", lambda _, like: searches.append(like) or ())
    track = Tracker("joint", MeshModel(mesh=cube(), registration=Joint()))
    first, again = bead_pair(0)[0], bead_pair(1)[0]  # noise apart
    aside = touch(coarse_bead(), motion(np.array([0, 0, 0, 3.0, 0, 0])), 5)
    counts = []
    for item in (first, again, aside, blank(), aside):
        assert track(item).reason in ("no pose of the object fits this touch", "nothing touches")
        counts.append(len(searches))
    assert counts == [1, 1, 2, 2, 3]


@pytest.mark.parametrize("unit_mm", [1e3, 25.4])
def test_a_mesh_in_metres_or_inches_is_said(unit_mm):
    with pytest.raises(WedgeError, match="metres, inches"):
        cube(scale=1 / unit_mm)


def test_a_mesh_of_one_point_is_said():
    with pytest.raises(WedgeError, match="one point"):
        cube(scale=0)


@pytest.mark.parametrize(
    "content", [b"", b"solid\n", b"\0" * 200, b"ply\nformat ascii", b"v 0 0\nf 1 1 1\n"]
)
@pytest.mark.parametrize("kind", ["stl", "ply", "obj"])
def test_damaged_files_are_one_sentence(tmp_path, kind, content):
    path = tmp_path / f"thing.{kind}"
    path.write_bytes(content)
    with pytest.raises(WedgeError, match="thing"):
        read_mesh(path)


def test_a_written_mesh_is_read_back(tmp_path):
    path = tmp_path / "cube.obj"
    mesh = cube()
    lines = ["v {} {} {}".format(*corner) for corner in mesh.vertices_mm]
    lines += ["f {} {} {}".format(*(triangle + 1)) for triangle in mesh.triangles]
    path.write_text("\n".join(lines))
    assert np.ptp(read_mesh(path).vertices_mm, axis=0).max() == SIDE_MM
    with pytest.raises(WedgeError, match="not an STL, PLY or OBJ file"):
        read_mesh(tmp_path / "cube.step")


def test_a_corner_that_no_triangle_has_is_nothing_that_touches(tmp_path):
    path = tmp_path / "cube.ply"
    mesh = cube()
    lines = ["ply", "format ascii 1.0", "element vertex 9"]
    lines += [f"property float {axis}" for axis in "xyz"]
    lines += ["element face 12", "property list uchar int vertex_indices", "end_header"]
    lines += ["0 0 -3000", *("{} {} {}".format(*corner) for corner in mesh.vertices_mm)]
    lines += ["3 {} {} {}".format(*(triangle + 1)) for triangle in mesh.triangles]
    path.write_text("\n".join(lines) + "\n")
    read = read_mesh(path)
    assert len(read.vertices_mm) == 8
    np.testing.assert_array_equal(
        read.vertices_mm[read.triangles], mesh.vertices_mm[mesh.triangles]
    )


@pytest.mark.parametrize("corner", [-1, 8])
def test_a_corner_that_is_not_there_is_refused(corner):
    whole = cube()
    triangles = np.concatenate([whole.triangles, [[0, 1, corner]]])
    with pytest.raises(WedgeError, match="triangles whose corners are missing"):
        Mesh(vertices_mm=whole.vertices_mm, triangles=triangles)
