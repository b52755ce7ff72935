# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Plates between the sensor's roof and a gripper; their underside closes the compartment."""

from dataclasses import dataclass

import cadquery as cq

from cad.features import box, cylinder, one_solid, union_of
from cad.layout import MIN_WALL, PLATE, PLATE_UNDER_HEAD, Layout
from cad.tables import fastener
from sensor.design import Wedge

GRIPPER_SCREW_LENGTH = 8.0
"""Of the screws from the plate into the gripper."""
HEAD_GAP = 0.2
"""Around a sunk screw head, and by which it stays below the surface."""
LEAST_UNDER_HEAD = 1.8
"""Of the plate, under the sunk heads of the gripper's screws."""


@dataclass(frozen=True)
class Pattern:
    """Holes of a gripper's finger: (along x, along y) from the centre of the plate's rear."""

    screw: str
    places: tuple[tuple[float, float], ...]


WSG_50 = Pattern("M4", ((0.0, -10.5), (0.0, 10.5)))
"""Weiss WSG-50, as on the public adaptor of another sensor: two holes, 21 mm apart."""
LAB = Pattern("M3", ((-6.0, -13.05), (-6.0, 13.05), (6.0, -13.05), (6.0, 13.05)))
"""The four holes, 26.1 x 12 mm, of the adapter of the lab that published the sensor."""


def adapter_wsg50(design: Wedge) -> cq.Solid:
    """Adapter for the Weiss WSG-50."""
    return _adapter(design, WSG_50)


def adapter_lab(design: Wedge) -> cq.Solid:
    """Adapter with the hole pattern of the published sensor's lab."""
    return _adapter(design, LAB)


def under_gripper_head_mm(pattern: Pattern) -> float:
    """Plate that remains under the sunk heads of the gripper's screws."""
    return max(PLATE - fastener(pattern.screw).head_height_mm - HEAD_GAP, LEAST_UNDER_HEAD)


def cover_corner_half(place: Layout) -> float:
    """Half the side of the cover's corner blocks, which hold its sunk screws."""
    return max(3.2, place.screw.head_diameter_mm / 2 + HEAD_GAP + MIN_WALL + 0.05)


def cover_screw_places(place: Layout) -> list[tuple[float, float]]:
    """(x, y) of the screws between cover and plate."""
    compartment, inset = place.design.compartment, cover_corner_half(place)
    x0, x1 = place.cover_x0 + inset, place.plate_x1 - inset
    y = compartment.width_mm / 2 - inset
    return [(x0, -y), (x0, y), (x1, -y), (x1, y)]


def _adapter(design: Wedge, pattern: Pattern) -> cq.Solid:
    place = Layout(design)
    z0 = design.housing.roof_z_mm
    rim = place.screw_y + place.screw.head_diameter_mm / 2 + HEAD_GAP + MIN_WALL
    half, wide = max(place.outer_half, rim), design.compartment.width_mm / 2
    front = place.roof_screw_x[0] - place.screw.head_diameter_mm / 2 - 1.5
    neck = place.cover_x0 - 2.0
    body = box((front, neck + 1.0), (-half, half), (z0, z0 + PLATE))
    body = body.union(box((neck, place.plate_x1), (-wide, wide), (z0, z0 + PLATE)))
    return one_solid(
        body.cut(_roof_screws(place)).cut(_gripper_holes(place, pattern)).cut(_cover_holes(place)),
        "the gripper adapter",
    )


def _roof_screws(place: Layout) -> cq.Workplane:
    z0 = place.design.housing.roof_z_mm
    holes = []
    for x in place.roof_screw_x:
        for y in (-place.screw_y, place.screw_y):
            holes.append(
                cylinder((x, y, z0 - 1), (0, 0, 1), place.screw.clearance_mm / 2, PLATE + 2)
            )
            sink = place.screw.head_diameter_mm / 2 + HEAD_GAP
            holes.append(cylinder((x, y, z0 + PLATE_UNDER_HEAD), (0, 0, 1), sink, PLATE))
    return union_of(holes)


def _gripper_holes(place: Layout, pattern: Pattern) -> cq.Workplane:
    """Clearance holes, sunk from below so that the heads clear the electronics."""
    size, z0 = fastener(pattern.screw), place.design.housing.roof_z_mm
    middle = (place.cover_x0 + place.plate_x1) / 2
    holes = []
    for along, across in pattern.places:
        start = (middle + along, across, z0 - 1)
        holes.append(cylinder(start, (0, 0, 1), size.clearance_mm / 2, PLATE + 2))
        sink = size.head_diameter_mm / 2 + 2 * HEAD_GAP
        depth = PLATE - under_gripper_head_mm(pattern)
        holes.append(cylinder(start, (0, 0, 1), sink, 1 + depth))
    return union_of(holes)


def _cover_holes(place: Layout) -> cq.Workplane:
    z0 = place.design.housing.roof_z_mm
    return union_of(
        cylinder((x, y, z0 - 1), (0, 0, 1), place.screw.tap_mm / 2, PLATE)
        for x, y in cover_screw_places(place)
    )
