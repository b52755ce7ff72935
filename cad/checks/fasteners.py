# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Holes in the solids agree with the fastener table, on both sides of every joint."""

from collections.abc import Iterator, Mapping

import cadquery as cq
import numpy as np
from OCP.BRepAdaptor import BRepAdaptor_Surface
from OCP.GeomAbs import GeomAbs_Cylinder

from cad.assembly import screw_rows
from cad.motions import Vector
from cad.result import Result
from cad.tables import fastener
from sensor.design import Wedge

Axis = tuple[tuple[float, ...], tuple[float, ...]]
"""A line's direction without its sign, and its point next to the origin, to the micrometre."""

_TAPPED = {
    "rear_screw": ("case",),
    "roof_screw": ("case",),
    "board_screw": ("electronics_cover",),
    "cover_screw": ("adapter_wsg50", "adapter_lab"),
}
"""Parts that each row of screws cuts its thread into."""
_PASSED = {
    "rear_screw": ("camera_holder",),
    "roof_screw": ("adapter_wsg50", "adapter_lab"),
    "board_screw": (),
    "cover_screw": ("electronics_cover",),
}
"""Parts that it goes through."""


def check_fasteners(design: Wedge, solids: Mapping[str, cq.Solid]) -> list[Result]:
    """Every screw has a hole of the table's diameter on its axis, in each part that it meets.

    Other holes of such a diameter, as the pins' can be, are none of a screw's business.
    """
    size = fastener(design.fastening.screw)
    wanted: dict[tuple[str, float], set[Axis]] = {}
    for row in screw_rows(design):
        axes = {_axis(head, row.direction) for head in row.heads}
        for parts, diameter in ((_TAPPED, size.tap_mm), (_PASSED, size.clearance_mm)):
            for name in parts[row.stem]:
                wanted.setdefault((name, diameter), set()).update(axes)
    results = []
    for (name, diameter), axes in wanted.items():
        missing = len(axes - set(_holes(solids[name], diameter)))
        results.append(
            Result("fasteners", f"{name}, {diameter:g} mm", missing, "holes missing", 0,
                   "at most", f"{len(axes)} holes for {size.screw}")
        )  # fmt: skip
    return results


def _holes(solid: cq.Solid, diameter: float) -> Iterator[Axis]:
    """Axes of the cylinders of a diameter among the solid's faces."""
    for face in solid.Faces():
        surface = BRepAdaptor_Surface(face.wrapped)
        if surface.GetType() != GeomAbs_Cylinder:
            continue
        cylinder = surface.Cylinder()
        if abs(2 * cylinder.Radius() - diameter) > 1e-6:
            continue
        at, way = cylinder.Axis().Location(), cylinder.Axis().Direction()
        yield _axis((at.X(), at.Y(), at.Z()), (way.X(), way.Y(), way.Z()))


def _axis(point: Vector, direction: Vector) -> Axis:
    along = np.array(direction)
    nearest = np.array(point) - (np.array(point) @ along) * along
    return _rounded(np.abs(along)), _rounded(nearest)


def _rounded(values: np.ndarray) -> tuple[float, ...]:
    return tuple((np.round(values, 3) + 0.0).tolist())
