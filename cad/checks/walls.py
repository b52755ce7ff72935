# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Walls a printer can make, and faces that it must bridge in the air."""

import math

import numpy as np
import trimesh

from cad.layout import MIN_WALL
from cad.rays import first_hits
from cad.result import Result

WALL_RAYS = 20_000
_DECIMALS = 5
"""Of a thickness in mm; the mesh's coordinates are rounded to seven."""
_OVERHANG_DEG = 45.0
_OVERHANG_SHARE = 15.0
_BED_MM = 0.05


def check_walls(name: str, mesh: trimesh.Trimesh) -> Result:
    """Thinnest wall with parallel faces, by rays shot inward from points all over the surface.

    Knife edges, where faces meet at an angle, are no walls: opposite normals must agree.
    """
    points, faces = _places(mesh)
    normals = np.asarray(mesh.face_normals)
    inward = -normals[faces]
    _, struck = first_hits(mesh, points + 1e-3 * inward, inward)
    opposed = np.einsum("ij,ij->i", normals[struck], normals[faces]) < -0.98
    walls = opposed & (struck >= 0)
    # The rays are followed in single precision; the thickness is not: 0.8 mm must be 0.8 mm.
    to_plane = np.asarray(mesh.triangles)[struck, 0] - points
    across = np.einsum("ij,ij->i", inward, normals[struck])
    depth = np.einsum("ij,ij->i", to_plane, normals[struck]) / np.where(walls, across, 1.0)
    thinnest = float(depth[walls].min()) if walls.any() else math.inf
    place = points[walls][int(depth[walls].argmin())] if walls.any() else np.zeros(3)
    where = "at " + ", ".join(f"{value:.1f}" for value in place)
    return Result("wall", name, round(thinnest, _DECIMALS), "mm", MIN_WALL, "at least", where)


def _places(mesh: trimesh.Trimesh) -> tuple[np.ndarray, np.ndarray]:
    """Points all over the surface, and some on each facet, so that small holes are not missed."""
    points, faces = trimesh.sample.sample_surface(mesh, WALL_RAYS, seed=7)
    corners = np.asarray(mesh.triangles)
    middle = corners.mean(axis=1)
    inside = [middle] + [0.9 * corners[:, k] + 0.1 * middle for k in range(3)]
    inside += [0.45 * (corners[:, k] + corners[:, k - 1]) + 0.1 * middle for k in range(3)]
    every = np.arange(len(corners))
    return np.concatenate([points, *inside]), np.concatenate([faces, *[every] * len(inside)])


def check_overhang(name: str, mesh: trimesh.Trimesh) -> Result:
    """Area that faces down by more than 45 degrees and does not lie on the bed, as printed."""
    down = np.asarray(mesh.face_normals)[:, 2] < -math.cos(math.radians(_OVERHANG_DEG)) - 1e-6
    height = np.asarray(mesh.triangles)[:, :, 2].max(axis=1)
    area = float(np.asarray(mesh.area_faces)[down & (height > _BED_MM)].sum())
    share = 100 * area / float(mesh.area)
    return Result("overhang", name, share, "% of its surface", _OVERHANG_SHARE, "at most",
                  f"{area:.0f} mm² bridged without supports")  # fmt: skip
