# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Holes in the solids agree with the fastener table, on both sides of every joint."""

from collections.abc import Mapping

import cadquery as cq
import numpy as np
from OCP.BRepAdaptor import BRepAdaptor_Surface
from OCP.GeomAbs import GeomAbs_Cylinder

from cad.checks.result import Result
from cad.tables import fastener
from sensor.design import Wedge


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
