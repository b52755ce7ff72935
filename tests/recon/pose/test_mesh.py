# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from benchmarks.touches import OBLIQUE_DEG, cube_corner
from recon.pose.joint import Joint
from recon.pose.mesh import Mesh, read_mesh, render
from recon.pose.models import MeshModel
from recon.pose.rigid import angle_deg, inverse, motion, rigid
from recon.pose.tracker import Tracker
from sensor.errors import WedgeError
from tests.recon.pose.touched import MM_PER_PX, SIZE_PX, corner, touch

SIDE_MM = 10.0


def cube(scale: float = 1.0) -> Mesh:
    """With the corner that touches at the origin, its sides along the axes."""
    places = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], float)
    sides = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    triangles = [t for a, b, c, d in sides for t in ((a, b, c), (a, c, d))]
    return Mesh(vertices_mm=-SIDE_MM * scale * places, triangles=np.array(triangles))


def standing(press_mm: float = 2.0) -> np.ndarray:
    """The pose in which the mesh is the bench's cube corner."""
    upright = Rotation.align_vectors([[0.0, 0, -1]], [[1.0, 1, 1]])[0]
    turn = Rotation.from_euler("z", OBLIQUE_DEG, degrees=True) * upright
    return rigid(turn.as_matrix(), np.array([0, 0, -press_mm]))


def test_a_rendered_corner_is_the_corner():
    exact = touch(cube_corner(2.0), np.eye(4), None)
    drawn = render(cube(), standing(), SIZE_PX, MM_PER_PX)
    inside = exact.contact & drawn.contact
    assert np.count_nonzero(exact.contact ^ drawn.contact) < 0.1 * np.count_nonzero(inside)
    assert np.median(np.abs(drawn.gradient - exact.gradient)[inside]) < 1e-5
    assert np.abs(drawn.depth_mm - exact.depth_mm)[inside].max() < 0.1


def test_a_mesh_is_followed_from_a_known_pose():
    track = Tracker("joint", MeshModel(mesh=cube(), registration=Joint()), standing())
    pose = motion(np.array([0.02, -0.02, 0.02, 0.1, 0.1, -0.05])) @ standing()
    found = track(corner())
    assert found.state == "tracking" and angle_deg(inverse(standing()) @ found.T_sensor_object) < 1
    moved = touch(cube_corner(2.0), pose @ inverse(standing()), 4)
    assert angle_deg(inverse(pose) @ track(moved).T_sensor_object) < 1


def test_a_pose_is_found_from_all_sides_and_said_to_be_one_of_several():
    track = Tracker("joint", MeshModel(mesh=cube(), registration=Joint()))
    found = track(corner())
    assert found.state == "weak" and found.reason == "several poses fit this touch"
    drawn = render(cube(), found.T_sensor_object, SIZE_PX, MM_PER_PX)
    inside = corner().contact & drawn.contact
    assert np.count_nonzero(inside) > 0.9 * np.count_nonzero(corner().contact)
    assert np.median(np.abs(drawn.depth_mm - corner().depth_mm)[inside]) < 0.02


def test_a_mesh_in_metres_is_said():
    with pytest.raises(WedgeError, match="metres"):
        cube(scale=1e-3)
    with pytest.raises(WedgeError, match="one point"):
        cube(scale=0)


@pytest.mark.parametrize("content", [b"", b"solid\n", b"\0" * 200, b"ply\nformat ascii"])
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
    with pytest.raises(WedgeError, match="no STL"):
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
    with pytest.raises(WedgeError, match="corners that it has not"):
        Mesh(vertices_mm=whole.vertices_mm, triangles=triangles)
