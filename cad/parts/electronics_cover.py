# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""The box behind the sensor for the CSI-to-HDMI adapter; the gripper adapter is its lid."""

import math

import cadquery as cq

from cad.features import box, cylinder, one_solid, union_of
from cad.layout import FLANGE, Layout
from cad.parts.gripper_adapter import HEAD_GAP, cover_corner_half, cover_screw_places
from sensor.design import Wedge

WALL = 1.2
UNDER_HEAD = 3.0
POST_HEIGHT, POST_DIAMETER = 4.0, 5.0
POSTS = ((-10.0, -13.0), (-10.0, 13.0), (10.0, -10.5), (10.0, 10.5))
"""(x, y) from the board's middle: posts 26 and 21 mm apart in rows 20 mm apart, as in the lab's
own compartment. Measure your adapter's holes."""
BOARD_TO_BACK = 21.0
"""From the board's middle to the back of the cover."""
RIBBON_GAP = 2.0
"""On either side of the camera's ribbon, in the opening that its wires share."""
PLUG = 17.0
"""Width of the opening for the HDMI plug."""


def board_z(place: Layout) -> float:
    """Height (z) of the adapter board's underside."""
    design = place.design
    return design.housing.roof_z_mm - design.compartment.height_mm + WALL + POST_HEIGHT


def ribbon_rise_mm(place: Layout) -> float:
    """How far the ribbon must rise from where it leaves the holder to the cover's opening."""
    camera, wiring = place.design.camera, place.design.wiring
    leaves = camera.pupil_z_mm - (place.rear + FLANGE - camera.pupil_x_mm) * math.tan(place.pitch)
    sill = place.design.housing.roof_z_mm - place.design.compartment.height_mm + WALL
    return max(0.0, sill + wiring.ribbon_thickness_mm - leaves)


def board_x(place: Layout) -> float:
    """Place (x) of the adapter board's middle: its socket must reach the back of any cover."""
    return place.plate_x1 - BOARD_TO_BACK


def electronics_cover(design: Wedge) -> cq.Solid:
    """The printed cover, in its place under the gripper adapter."""
    place = Layout(design)
    x, top = (place.cover_x0, place.plate_x1), design.housing.roof_z_mm
    half, bottom = design.compartment.width_mm / 2, top - design.compartment.height_mm
    body = box(x, (-half, half), (bottom, top)).cut(
        box((x[0] + WALL, x[1] - WALL), (WALL - half, half - WALL), (bottom + WALL, top + 1))
    )
    corner = cover_corner_half(place)
    corners = union_of(
        box((cx - corner, cx + corner), (cy - corner, cy + corner), (bottom, top))
        for cx, cy in cover_screw_places(place)
    ).intersect(box(x, (-half, half), (bottom, top)))
    opening = design.wiring.ribbon_width_mm / 2 + RIBBON_GAP
    cable = box((x[0] - 1, x[0] + WALL + 1), (-opening, opening), (bottom + WALL, top + 1))
    plug = box((x[1] - WALL - 1, x[1] + 1), (-PLUG / 2, PLUG / 2), (board_z(place) - 1, top + 1))
    body = body.union(corners).union(_posts(place)).cut(cable).cut(plug)
    return one_solid(body.cut(_screw_ways(place)), "the electronics cover")


def _posts(place: Layout) -> cq.Workplane:
    middle, z = board_x(place), board_z(place)
    posts = []
    for along, across in POSTS:
        foot = (middle + along, across, z - POST_HEIGHT - 0.5)
        post = cylinder(foot, (0, 0, 1), POST_DIAMETER / 2, POST_HEIGHT + 0.5)
        hole = cylinder((middle + along, across, z), (0, 0, -1), place.screw.tap_mm / 2, 3.5)
        posts.append(post.cut(hole))
    return union_of(posts)


def _screw_ways(place: Layout) -> cq.Workplane:
    """Holes in the corners, and wide ways from below down which screw and driver go."""
    top = place.design.housing.roof_z_mm
    ways = []
    for x, y in cover_screw_places(place):
        ways.append(cylinder((x, y, top + 1), (0, 0, -1), place.screw.clearance_mm / 2, 60))
        sink = place.screw.head_diameter_mm / 2 + HEAD_GAP
        ways.append(cylinder((x, y, top - UNDER_HEAD), (0, 0, -1), sink, 60))
    return union_of(ways)
