# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""The camera holder: a plug that the camera is pressed into, with a flange for two screws."""

import cadquery as cq

from cad.features import both_sides, box, cylinder, one_solid, turned
from cad.layout import FLANGE, MIN_WALL, Layout
from cad.parts.case import wire_channel
from sensor.design import Wedge

BARREL_GAP = 0.3


def camera_holder(design: Wedge) -> cq.Solid:
    """The printed holder, in its place in the body."""
    place = Layout(design)
    low, high = place.plug_z
    plug = box(
        (place.tunnel_x0 + place.slide, place.rear + FLANGE),
        (-place.plug_half, place.plug_half),
        (low, high),
    )
    half = place.outer_half
    flange = box((place.rear, place.rear + FLANGE), (-half, half), (place.bottom, high + 1.0))
    body = plug.union(flange).cut(_socket(place))
    channel = wire_channel(place, (place.rear - 1, place.rear + FLANGE + 1))
    return one_solid(body.cut(both_sides(channel)).cut(_screw_holes(place)), "the camera holder")


def _socket(place: Layout) -> cq.Workplane:
    """The camera's way in from the back, and the hole that its lens looks through."""
    camera = place.design.camera
    pupil = (camera.pupil_x_mm, 0.0, camera.pupil_z_mm)
    far = place.rear + FLANGE + camera.head_size_mm
    half = place.socket_half
    x, z = camera.pupil_x_mm, camera.pupil_z_mm
    head = box((x, far), (-half, half), (z - half, z + half))
    lens = cylinder(
        (place.tunnel_x0 - camera.head_size_mm, 0, z),
        (1, 0, 0),
        camera.barrel_diameter_mm / 2 + BARREL_GAP,
        x - place.tunnel_x0 + camera.head_size_mm + 0.1,
    )
    return turned(head.union(lens), camera.pitch_deg, pupil)


def _screw_holes(place: Layout) -> cq.Workplane:
    """Clearance holes; too near the flange's edge, they are slots that open to the side."""
    y, z, radius = place.screw_y, place.rear_screw_z, place.screw.clearance_mm / 2
    hole = cylinder((place.rear - 1, y, z), (1, 0, 0), radius, FLANGE + 2)
    if y + radius + MIN_WALL > place.outer_half + 1e-6:
        hole = hole.union(
            box(
                (place.rear - 1, place.rear + FLANGE + 1),
                (y, place.outer_half + 1),
                (z - radius, z + radius),
            )
        )
    return both_sides(hole)
