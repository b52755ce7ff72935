# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""What a printer must be able to make: closed bodies, walls thick enough, little in the air."""

import math
from collections.abc import Mapping

import cadquery as cq
import numpy as np
import trimesh
from OCP.BRepAdaptor import BRepAdaptor_Surface
from OCP.GeomAbs import GeomAbs_Cylinder

from cad.catalogue import PRINTED
from cad.checks.result import Result
from cad.layout import FLANGE, MIN_WALL, PLATE, Layout
from cad.parts import mold
from cad.parts.jigs import ball_jig_volume_mm3
from cad.rays import Scene
from cad.tables import fastener
from sensor.design import Gel, Wedge

WALL_RAYS = 20_000
FACETS_MM = 0.005
"""Meshes lie this close to their solids: every length measured on them is that uncertain."""
_OVERHANG_DEG = 45.0
_OVERHANG_SHARE = 15.0
_BED_MM = 0.05


def check_solids(solids: Mapping[str, cq.Solid], meshes: Mapping[str, trimesh.Trimesh]) -> list[Result]:
    """Every part is one valid solid, and its mesh one closed surface of the same volume."""
    results = []
    for name, mesh in meshes.items():
        solid = solids[name]
        sound = solid.isValid() and mesh.is_watertight and mesh.is_winding_consistent
        bodies = mesh.body_count if sound else 0
        results.append(Result("solid", name, bodies, "closed body", 1, "at most", "valid, watertight"
                              if sound else "not closed"))  # fmt: skip
        error = abs(mesh.volume / solid.Volume() - 1) * 100 if sound else math.nan
        results.append(Result("mesh volume", name, error, "% from the solid", 0.2, "at most"))
    return results


def check_walls(name: str, mesh: trimesh.Trimesh) -> Result:
    """Thinnest wall with parallel faces, by rays shot inward from points all over the surface.

    Knife edges, where faces meet at an angle, are no walls: opposite normals must agree.
    """
    points, faces = _places(mesh)
    normals = np.asarray(mesh.face_normals)
    inward = -normals[faces]
    scene, start = Scene(mesh), points + 1e-3 * inward
    struck = scene.triangle(start, inward)
    depth = scene.distance(start, inward) + 1e-3
    opposed = np.einsum("ij,ij->i", normals[struck], normals[faces]) < -0.98
    walls = opposed & (struck >= 0) & np.isfinite(depth)
    thinnest = float(depth[walls].min()) if walls.any() else math.inf
    place = points[walls][int(depth[walls].argmin())] if walls.any() else np.zeros(3)
    where = "at " + ", ".join(f"{value:.1f}" for value in place)
    return Result("wall", name, thinnest, "mm", MIN_WALL - FACETS_MM, "at least", where)


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
    height = np.asarray(mesh.triangles)[:, :, 2].min(axis=1)
    area = float(np.asarray(mesh.area_faces)[down & (height > _BED_MM)].sum())
    share = 100 * area / float(mesh.area)
    return Result("overhang", name, share, "% of its surface", _OVERHANG_SHARE, "at most",
                  f"{area:.0f} mm² bridge without support")  # fmt: skip


def check_mold(design: Wedge, curved: trimesh.Trimesh, flat: trimesh.Trimesh) -> list[Result]:
    """Largest distance of the cavity's mesh from the ellipsoid, and from the plane."""
    gel = design.gel
    results = []
    for subject, mesh, surface in (
        ("curved cavity", curved, _ellipsoid_z),
        ("flat cavity", flat, lambda gel, x, y: np.full_like(x, -gel.thickness_mm)),
    ):
        floor = _cavity_points(gel, mesh)
        deviation = np.abs(floor[:, 2] - surface(gel, floor[:, 0], floor[:, 1]))
        worst = float(deviation.max()) if len(floor) else math.nan
        results.append(
            Result("mold", subject, worst, "mm", 0.01, "at most", f"{len(floor)} points")
        )
    return results


def _cavity_points(gel: Gel, mesh: trimesh.Trimesh) -> np.ndarray:
    """Corners and middles of the facets of the cavity's floor."""
    triangles = np.asarray(mesh.triangles)
    middle = triangles.mean(axis=1)
    inside = (np.abs(middle[:, 0]) < gel.pad_length_mm / 2) & (
        np.abs(middle[:, 1]) < gel.pad_width_mm / 2
    )
    normals = np.asarray(mesh.face_normals)
    deep = middle[:, 2] < -min(gel.corner_thickness_mm, gel.thickness_mm) * 0.5
    floor = inside & deep & (normals[:, 2] > 0.5)
    corners = triangles[floor]
    edges = (corners + np.roll(corners, 1, axis=1)) / 2
    return np.concatenate([corners.reshape(-1, 3), edges.reshape(-1, 3), middle[floor]])


def _ellipsoid_z(gel: Gel, x: np.ndarray, y: np.ndarray) -> np.ndarray:
    root = np.sqrt(1 - (x / gel.semi_axis_along_mm) ** 2 - (y / gel.semi_axis_across_mm) ** 2)
    return np.asarray(gel.semi_axis_normal_mm * (1 - root) - gel.thickness_mm)


def check_closed_forms(design: Wedge, solids: Mapping[str, cq.Solid]) -> list[Result]:
    """Volumes that a formula gives: the solids must agree to a millionth."""
    expected = {
        "ball_jig": ball_jig_volume_mm3(design),
        "mold_flat": _flat_mold_mm3(design.gel),
        "mold_lid": _lid_mm3(design),
    }
    return [
        Result("closed form", name, abs(solids[name].Volume() / volume - 1) * 1e6, "millionths", 1.0,
               "at most", f"{volume:.3f} mm³")
        for name, volume in expected.items()
    ]  # fmt: skip


def _rounded_block_mm3(gel: Gel, height: float) -> float:
    area = (gel.pad_length_mm + 2 * mold.RIM) * (gel.pad_width_mm + 2 * mold.RIM)
    return (area - (4 - math.pi) * 2.0**2) * height


def _ring_mm3(gel: Gel, gap: float, height: float) -> float:
    def area(margin: float) -> float:
        return (gel.pad_length_mm + 2 * margin) * (gel.pad_width_mm + 2 * margin)

    return (area(mold.GROOVE_OUTSIDE - gap) - area(mold.GROOVE_INSIDE + gap)) * height


def _flat_mold_mm3(gel: Gel) -> float:
    cavity = gel.pad_length_mm * gel.pad_width_mm * gel.thickness_mm
    overflow = 4 * mold.GROOVE_INSIDE * mold.OVERFLOW_WIDTH * mold.OVERFLOW_DEPTH
    block = _rounded_block_mm3(gel, gel.thickness_mm + mold.FLOOR)
    # A shallow gel is no deeper than the overflow, which then cuts nothing inside the cavity.
    return block - cavity - overflow - _ring_mm3(gel, 0, mold.GROOVE_DEPTH)


def _lid_mm3(design: Wedge) -> float:
    ring = _ring_mm3(design.gel, Layout(design).slide, mold.GROOVE_DEPTH - 0.2)
    return _rounded_block_mm3(design.gel, mold.LID) + ring


def check_fasteners(design: Wedge, solids: Mapping[str, cq.Solid]) -> list[Result]:
    """Holes found in the solids have the diameters of the table, wherever screws meet parts."""
    row = fastener(design.fastening.screw)
    expected = {
        ("case", row.tap_mm): 6,
        ("camera_holder", row.clearance_mm): 2,
        ("adapter_wsg50", row.clearance_mm): 4,
        ("adapter_wsg50", row.tap_mm): 4,
        ("adapter_lab", row.clearance_mm): 4,
        ("adapter_lab", row.tap_mm): 4,
        ("electronics_cover", row.tap_mm): 4,
        ("electronics_cover", row.clearance_mm): 4,
    }
    results = []
    for (name, diameter), count in expected.items():
        found = _holes(solids[name], diameter)
        results.append(
            Result("fasteners", f"{name}, {diameter:g} mm", abs(found - count), "holes off", 0,
                   "at most", f"{found} holes for {row.screw}")
        )  # fmt: skip
    return results


def _holes(solid: cq.Solid, diameter: float) -> int:
    """Number of cylindrical axes of a diameter among the solid's faces."""
    axes = set()
    for face in solid.Faces():
        surface = BRepAdaptor_Surface(face.wrapped)
        if surface.GetType() != GeomAbs_Cylinder:
            continue
        cylinder = surface.Cylinder()
        if abs(2 * cylinder.Radius() - diameter) > 1e-6:
            continue
        at, way = cylinder.Axis().Location(), cylinder.Axis().Direction()
        point = np.array([at.X(), at.Y(), at.Z()])
        along = np.array([way.X(), way.Y(), way.Z()])
        nearest = point - (point @ along) * along
        axes.add(tuple((np.round(nearest, 3) + 0.0).tolist()))
    return len(axes)
