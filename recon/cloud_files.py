# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Clouds and meshes as files that other tools open: PLY, PCD and NPZ.

PLY is binary, little-endian, version 1.0 (Turk, The PLY Polygon File Format, 1994); PCD is binary,
version 0.7 (pointclouds.org/documentation/tutorials/pcd_file_format.html).
"""

import io
from dataclasses import fields

import numpy as np
from jaxtyping import Int32

from recon.cloud import PointCloud

FORMATS = ("ply", "pcd", "npz")
FIELDS = ("x", "y", "z", "normal_x", "normal_y", "normal_z", "sigma", "contact")
PLY_NAMES = ("x", "y", "z", "nx", "ny", "nz", "sigma", "contact")
POINT = np.dtype([(name, "<f4") for name in FIELDS])
"""All floats, contact as 0 and 1: some readers know no other kind."""
FACE = np.dtype([("corners", "u1"), ("points", "<i4", (3,))])


def cloud_bytes(
    cloud: PointCloud, form: str, triangles: Int32[np.ndarray, "m 3"] | None = None
) -> bytes:
    """The content of a file.

    Args:
        cloud: its points, mm.
        form: one of ``FORMATS``.
        triangles: of a mesh; PCD has no place for them and leaves them out.
    """
    if form == "npz":
        return _npz(cloud, triangles)
    if form == "pcd":
        return _pcd(cloud)
    return _ply(cloud, triangles)


def _records(cloud: PointCloud) -> np.ndarray:
    records = np.empty(len(cloud), POINT)
    more = np.stack([cloud.sigma_mm, cloud.contact], 1)
    columns = np.concatenate([cloud.points_mm, cloud.normals, more], 1)
    for name, values in zip(FIELDS, columns.T, strict=True):
        records[name] = values
    return records


def _ply(cloud: PointCloud, triangles: Int32[np.ndarray, "m 3"] | None) -> bytes:
    lines = ["ply", "format binary_little_endian 1.0"]
    lines.append("comment gel frame: x right, y down, z out of the gel; mm; sigma along z")
    lines += [f"element vertex {len(cloud)}", *(f"property float {name}" for name in PLY_NAMES)]
    content = _records(cloud).tobytes()
    if triangles is not None:
        lines += [f"element face {len(triangles)}", "property list uchar int vertex_indices"]
        faces = np.empty(len(triangles), FACE)
        faces["corners"], faces["points"] = 3, triangles
        content += faces.tobytes()
    return "\n".join([*lines, "end_header", ""]).encode() + content


def _pcd(cloud: PointCloud) -> bytes:
    count = len(cloud)
    header = [
        "# .PCD v0.7 - gel frame: x right, y down, z out of the gel; mm; sigma along z",
        "VERSION 0.7",
        f"FIELDS {' '.join(FIELDS)}",
        f"SIZE{' 4' * len(FIELDS)}",
        f"TYPE{' F' * len(FIELDS)}",
        f"COUNT{' 1' * len(FIELDS)}",
        f"WIDTH {count}",
        "HEIGHT 1",
        "VIEWPOINT 0 0 0 1 0 0 0",
        f"POINTS {count}",
        "DATA binary",
        "",
    ]
    return "\n".join(header).encode() + _records(cloud).tobytes()


def _npz(cloud: PointCloud, triangles: Int32[np.ndarray, "m 3"] | None) -> bytes:
    arrays = {item.name: getattr(cloud, item.name) for item in fields(cloud)}
    if triangles is not None:
        arrays["triangles"] = triangles
    stream = io.BytesIO()
    np.savez_compressed(stream, allow_pickle=False, **arrays)
    return stream.getvalue()
