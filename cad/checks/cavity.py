# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""The mold's cavity against the surface of the gel, and the way out of what is too much."""

import math
from collections.abc import Mapping
from itertools import product

import manifold3d
import numpy as np
import trimesh

from cad.manifolds import manifold_of
from cad.result import Result
from sensor.design import Gel, Wedge

_SLIT = 0.25
"""A gap of less lets no silicone out by hand: the lid is thickened by this before it closes."""


def check_mold(design: Wedge, halves: Mapping[str, trimesh.Trimesh]) -> list[Result]:
    """Largest distance of the cavity's mesh from the ellipsoid, and from the plane.

    Args:
        design: The sensor.
        halves: ``mold_curved`` and ``mold_flat``, or those of them that are made.
    """
    gel = design.gel
    results = []
    for name, subject, surface in (
        ("mold_curved", "curved cavity", _ellipsoid_z),
        ("mold_flat", "flat cavity", lambda gel, x, y: np.full_like(x, -gel.thickness_mm)),
    ):
        if name not in halves:
            continue
        floor = _cavity_points(gel, halves[name])
        deviation = np.abs(floor[:, 2] - surface(gel, floor[:, 0], floor[:, 1]))
        worst = float(deviation.max()) if len(floor) else math.nan
        results.append(
            Result("mold", subject, worst, "mm", 0.01, "at most", f"{len(floor)} points")
        )
    return results


def check_relief(halves: Mapping[str, trimesh.Trimesh], lid: trimesh.Trimesh) -> list[Result]:
    """Space in the closed mold that at most a slit joins to the outside: silicone is shut in there.

    Args:
        halves: As for ``check_mold``.
        lid: Of the mold, as it is modelled: turned over, it lies on the half.
    """
    over = manifold_of(lid).rotate((180.0, 0.0, 0.0))
    shifts = product((-_SLIT, _SLIT), (-_SLIT, _SLIT), (-_SLIT,))
    closing = manifold3d.Manifold.batch_boolean(
        [over.translate(shift) for shift in shifts], manifold3d.OpType.Add
    )
    results = []
    for name, mesh in halves.items():
        shells = (manifold_of(mesh) + closing).decompose()
        # A shell around space inside a body has its faces turned inward: a negative volume.
        shut_in = 0.0 - sum(min(shell.volume(), 0.0) for shell in shells)
        results.append(Result("mold", f"{name}, trapped", shut_in, "mm³", 0.0, "at most",
                              "space under the lid with no way out"))  # fmt: skip
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
