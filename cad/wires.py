# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""The room that wires and the camera's ribbon have, in mm."""

import math
from collections.abc import Mapping

from cad.layout import FLANGE, Layout
from cad.parts.bought import resistor_board_end, socket_back
from cad.parts.electronics_cover import WALL, ribbon_rise_mm

WIRE_SPARE_MM = 50.0
"""To hold, strip and solder a wire, and to lay its bends."""
RIBBON_SPARE_MM = 20.0
"""The cover hangs below its place while the ribbon is plugged in."""
Room = tuple[float, float]
"""Width and height of a way for wires."""


def rooms(place: Layout) -> dict[str, Room]:
    """Every narrow way that an array's wires take."""
    inner, outer = place.channel_y
    return {
        "channel": (outer - inner, place.channel_top - place.bottom),
        "passage behind the rib": (place.light_depth - place.rib_out, -place.bottom),
    }


def wires_that_fit(room: Room, wire_mm: float) -> int:
    """Wires side by side and on top of each other, in rows: no trust in closer packing."""
    wide, high = room
    return math.floor(wide / wire_mm + 1e-9) * math.floor(high / wire_mm + 1e-9)


def thickest_wire_mm(room: Room, count: int) -> float:
    """Largest diameter of which so many wires fit."""
    wide, high = room
    return max(min(wide / row, high / math.ceil(count / row)) for row in range(1, count + 1))


def by_side(wires: Mapping[str, int]) -> dict[str, int]:
    """Wires in each of the two channels, from those of each colour; the base's end at y > 0."""
    sides = {"y > 0": wires.get("red", 0) + wires.get("green", 0), "y < 0": wires.get("blue", 0)}
    return {side: count for side, count in sides.items() if count}


def wire_length_mm(place: Layout) -> float:
    """Length of a wire from an array's tail to the far end of the resistor board."""
    leaves = place.rear + FLANGE
    x, z = resistor_board_end(place)
    channel = leaves - place.acrylic_x1 - place.light_depth
    way = math.dist((leaves, place.channel_y[1], place.bottom), (x, 0.0, z))
    return channel + way + WIRE_SPARE_MM


def ribbon_length_mm(place: Layout) -> float:
    """Least length of the ribbon from the camera's head to its end in the adapter's socket."""
    camera = place.design.camera
    back = camera.pupil_x_mm + camera.head_depth_mm * math.cos(place.pitch)
    leaves = place.rear + FLANGE
    x, z = socket_back(place)
    sill = place.design.housing.roof_z_mm - place.design.compartment.height_mm + WALL
    along, up = x - leaves, ribbon_rise_mm(place) + z - sill
    return (leaves - back) / math.cos(place.pitch) + along + up + RIBBON_SPARE_MM


def ribbon_bend_mm(place: Layout) -> float:
    """Radius of the ribbon's bend between camera holder and electronics cover."""
    run = place.cover_x0 - place.rear - FLANGE
    return bend_radius_mm(ribbon_rise_mm(place), run, place.pitch)


def bend_radius_mm(rise_mm: float, run_mm: float, fall_rad: float) -> float:
    """Radius of two equal arcs, one up and one back to level, that rise over a run.

    The first starts downward at ``fall_rad``, as the ribbon leaves a camera that looks up. With
    t the steepest angle between the arcs, run = R (sin fall + 2 sin t) and
    rise = R (1 + cos fall - 2 cos t).
    """
    low, high = 0.0, math.pi / 2
    for _ in range(60):
        steepest = (low + high) / 2
        up = 1 + math.cos(fall_rad) - 2 * math.cos(steepest)
        if up * run_mm < rise_mm * (math.sin(fall_rad) + 2 * math.sin(steepest)):
            low = steepest
        else:
            high = steepest
    along = math.sin(fall_rad) + 2 * math.sin(low)
    return run_mm / along if along > 1e-9 else math.inf
