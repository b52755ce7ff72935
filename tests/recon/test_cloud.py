# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
import io

import numpy as np
import pytest

from recon.ball import ball_cap
from recon.cloud import point_cloud, skin_mesh
from recon.cloud_files import FIELDS, FORMATS, POINT, cloud_bytes
from recon.pipeline import Reconstruction
from sensor.design import STANDARD
from sensor.errors import WedgeError

WIDTH, HEIGHT, PITCH = 40, 30, (0.1, 0.12)


def touch(depth=None, gradient=None, boundary="dirichlet", pitch=PITCH):
    cap = ball_cap((WIDTH, HEIGHT), (22.0, 14.0), 1.2, 2.0, pitch)
    depth = cap.depth_mm if depth is None else depth
    contact = cap.contact if depth.shape == cap.contact.shape else depth > 0.05
    found = Reconstruction(
        difference=np.zeros((*depth.shape, 3), np.float32),
        gradient=cap.gradient if gradient is None else gradient,
        depth_mm=depth,
        disturbed=contact,
        boundary=boundary,
        mm_per_px=pitch,
    )
    vars(found)["contact"] = contact  # as if asked for before
    return found


def test_points_of_a_ball_lie_on_that_ball_and_normals_point_away_from_its_centre():
    cloud = point_cloud(touch())
    rim_mm = np.sqrt(2.0**2 - 1.2**2)
    center = np.array([(22 - 19.5) * 0.1, (14 - 14.5) * 0.12, rim_mm])
    offset = (cloud.points_mm - center)[cloud.contact]
    np.testing.assert_allclose(np.linalg.norm(offset, axis=1), 2.0, atol=1e-5)
    np.testing.assert_allclose(cloud.normals[cloud.contact], -offset / 2.0, atol=1e-5)
    assert (cloud.points_mm[~cloud.contact, 2] == 0).all()


def test_the_origin_is_the_middle_of_the_frame_and_y_runs_down():
    points = point_cloud(touch()).points_mm.reshape(HEIGHT, WIDTH, 3)
    np.testing.assert_allclose(points[..., :2].mean((0, 1)), 0, atol=1e-6)
    np.testing.assert_allclose(np.diff(points[0, :, 0]), 0.1, atol=1e-6)
    np.testing.assert_allclose(np.diff(points[:, 0, 1]), 0.12, atol=1e-6)


def test_faces_of_the_mesh_have_the_points_normals_and_cover_the_pad():
    mesh = skin_mesh(touch())
    corners = mesh.cloud.points_mm[mesh.triangles].astype(float)
    cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    assert (cross[:, 2] > 0).all()
    area = cross[:, 2].sum() / 2
    assert area == pytest.approx((WIDTH - 1) * 0.1 * (HEIGHT - 1) * 0.12)
    face = cross / np.linalg.norm(cross, axis=1, keepdims=True)
    inside = mesh.cloud.contact[mesh.triangles].all(1)
    agreement = (face * mesh.cloud.normals[mesh.triangles].mean(1)).sum(1)
    assert agreement[inside].min() > 0.98


def test_where_no_estimator_tells_its_errors_none_is_said():
    cloud = point_cloud(touch())
    assert np.isnan(cloud.sigma_mm).all()
    assert all(np.isnan(read_back(cloud_bytes(cloud, form), form)).all() for form in FORMATS)


def read_back(content, form):
    """The sigmas of a file."""
    if form == "npz":
        with np.load(io.BytesIO(content)) as read:
            return read["sigma_mm"]
    end = b"end_header\n" if form == "ply" else b"DATA binary\n"
    return np.frombuffer(content.split(end, 1)[1], POINT)["sigma"]


def test_a_curved_gel_bends_the_untouched_skin_and_its_normals():
    flat = np.zeros((HEIGHT, WIDTH))
    cloud = point_cloud(touch(flat, np.zeros((HEIGHT, WIDTH, 2)), pitch=(0.7, 0.7)), STANDARD.gel)
    gel = STANDARD.gel
    x, y, z = cloud.points_mm.T.astype(float)
    axes = (gel.semi_axis_along_mm, gel.semi_axis_across_mm, gel.semi_axis_normal_mm)
    shell = (x / axes[0]) ** 2 + (y / axes[1]) ** 2 + (z / axes[2] + 1) ** 2
    np.testing.assert_allclose(shell, 1, atol=1e-5)
    outward = np.stack([x / axes[0] ** 2, y / axes[1] ** 2, (z + axes[2]) / axes[2] ** 2], 1)
    outward /= np.linalg.norm(outward, axis=1, keepdims=True)
    np.testing.assert_allclose(cloud.normals, outward, atol=1e-5)
    with pytest.raises(WedgeError, match="beyond the design's curved gel"):
        point_cloud(touch(flat, np.zeros((HEIGHT, WIDTH, 2)), pitch=(9.0, 9.0)), gel)


def test_ply_is_read_by_trimesh_as_cloud_and_as_mesh(tmp_path):
    trimesh = pytest.importorskip("trimesh")
    mesh = skin_mesh(touch())
    (tmp_path / "mesh.ply").write_bytes(cloud_bytes(mesh.cloud, "ply", mesh.triangles))
    read = trimesh.load(tmp_path / "mesh.ply", process=False)
    np.testing.assert_allclose(read.vertices, mesh.cloud.points_mm, atol=1e-6)
    np.testing.assert_array_equal(read.faces, mesh.triangles)
    np.testing.assert_allclose(read.vertex_normals, mesh.cloud.normals, atol=1e-5)
    assert (read.face_normals[:, 2] > 0).all()
    (tmp_path / "cloud.ply").write_bytes(cloud_bytes(mesh.cloud, "ply"))
    points = trimesh.load(tmp_path / "cloud.ply", process=False)
    np.testing.assert_allclose(points.vertices, mesh.cloud.points_mm, atol=1e-6)


def test_ply_is_read_by_vtk(tmp_path):
    vtk = pytest.importorskip("vtkmodules.vtkIOPLY")
    support = pytest.importorskip("vtkmodules.util.numpy_support")
    mesh = skin_mesh(touch())
    (tmp_path / "mesh.ply").write_bytes(cloud_bytes(mesh.cloud, "ply", mesh.triangles))
    reader = vtk.vtkPLYReader()
    reader.SetFileName(str(tmp_path / "mesh.ply"))
    reader.Update()
    read = reader.GetOutput()
    points = support.vtk_to_numpy(read.GetPoints().GetData())
    np.testing.assert_allclose(points, mesh.cloud.points_mm, atol=1e-6)
    assert read.GetNumberOfPolys() == len(mesh.triangles)


def test_pcd_says_what_it_holds():
    cloud = point_cloud(touch())
    header, content = cloud_bytes(cloud, "pcd").split(b"DATA binary\n")
    words = dict(line.split(" ", 1) for line in header.decode().splitlines()[1:])
    assert words["FIELDS"].split() == list(FIELDS)
    sizes = [int(size) for size in words["SIZE"].split()]
    assert sum(sizes) == POINT.itemsize and len(content) == int(words["POINTS"]) * sum(sizes)
    assert int(words["WIDTH"]) * int(words["HEIGHT"]) == len(cloud)
    records = np.frombuffer(content, POINT)
    np.testing.assert_array_equal(records["z"], cloud.points_mm[:, 2])
    np.testing.assert_array_equal(records["contact"], cloud.contact)


def test_npz_keeps_every_array_and_holds_no_pickle():
    mesh = skin_mesh(touch())
    with np.load(io.BytesIO(cloud_bytes(mesh.cloud, "npz", mesh.triangles))) as read:
        np.testing.assert_array_equal(read["points_mm"], mesh.cloud.points_mm)
        np.testing.assert_array_equal(read["sigma_mm"], mesh.cloud.sigma_mm)
        np.testing.assert_array_equal(read["triangles"], mesh.triangles)


def test_a_chosen_part_and_an_empty_one_are_clouds_too():
    cloud = point_cloud(touch())
    assert len(cloud[cloud.contact]) == cloud.contact.sum()
    nothing = cloud[np.zeros(len(cloud), bool)]
    assert len(nothing) == 0
    for form in ("ply", "pcd", "npz"):
        assert cloud_bytes(nothing, form)
