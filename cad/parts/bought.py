# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Bought and laser-cut parts as bodies of the assembly: the room they take, in their place."""

import cadquery as cq

from cad.electronics.boards import boards
from cad.features import box, cylinder, one_solid, turned, union_of, workplane
from cad.layout import Layout
from cad.motions import Vector
from cad.optics import pad_center_x_mm
from cad.parts.electronics_cover import BOARD_TO_BACK, POST_HEIGHT, POSTS, WALL, board_x, board_z
from cad.parts.mold import gel_pad
from cad.tables import fastener
from sensor.design import Wedge
from sensor.fabrication import FLEX_MM

BOARD = (24.0, 29.0, 1.6)
"""The CSI-to-HDMI adapter, x, y, z: an assumption, measure yours."""
SOCKET = (5.0, 20.0, 2.0)
"""Its socket for the ribbon, at its front edge: an assumption, too."""
RESISTOR_BOARD_HEIGHT = 3.0
"""With its resistors, wires soldered straight into the holes."""
TAPE = 0.3
RESISTOR_BOARD_INSET = 2.5
"""From the adapter's back edge to that of the resistor board on it."""
PLUG_LENGTH, PLUG_INSET = 10.5, 0.5
"""Of its HDMI connector, and from its end to the back of the cover."""
WIRES_LENGTH = 5.8
"""In which they turn from the cover's opening into the boards."""
PLUG = (15.0, 5.6)
"""Width and height of the connector."""


def acrylic(design: Wedge) -> cq.Solid:
    """The clear block, with the pins' notches."""
    place = Layout(design)
    half = place.acrylic_half
    block = box((place.acrylic_x0, place.acrylic_x1), (-half, half), (place.bottom, 0))
    notches = union_of(
        cylinder((x, y, place.bottom - 1), (0, 0, 1), place.pin_hole_radius, 2 - place.bottom)
        for x, y in place.pin_places
    )
    return one_solid(block.cut(notches), "the acrylic")


def mirror(design: Wedge) -> cq.Solid:
    """The mirror on its seat."""
    shape = design.mirror
    foot = (shape.foot_x_mm, 0.0, shape.foot_height_mm)
    x, half = shape.foot_x_mm, shape.width_mm / 2
    z = shape.foot_height_mm
    slab = box((x, x + shape.length_mm), (-half, half), (z, z + shape.thickness_mm))
    return one_solid(turned(slab, -shape.angle_deg, foot), "the mirror")


def gel(design: Wedge) -> cq.Solid:
    """The gel under the acrylic."""
    place = (pad_center_x_mm(design), 0, -design.acrylic.thickness_mm)
    return one_solid(workplane(gel_pad(design.gel)).translate(place), "the gel")


def film(design: Wedge, name: str, side: str) -> cq.Solid:
    """A gray filter or a diffuser on one side (``red``, ``blue``, ``green``) of the acrylic."""
    place = Layout(design)
    names = list(place.films)
    inner = sum(place.films[before] for before in names[: names.index(name)])
    z = (place.bottom, 0.0)
    if side == "green":
        x = place.acrylic_x1 + inner
        strip = box((x, x + place.films[name]), place.film_ranges["base"], z)
    else:
        y = place.acrylic_half + inner
        strip = box(place.film_ranges["side"], (y, y + place.films[name]), z)
        strip = strip if side == "red" else strip.mirror("XZ")
    return one_solid(strip, f"the {name}")


def led_array(design: Wedge, color: str) -> cq.Solid:
    """LEDs on their flexible circuit, which lies on the pocket's outer wall."""
    place, lights = Layout(design), design.lights
    row = next(row for row in place.light_rows() if row.color == color)
    middle = (place.bottom) / 2
    z = (middle - lights.led_width_mm / 2, middle + lights.led_width_mm / 2)
    back = (place.acrylic_x1 if color == "green" else place.acrylic_half) + place.light_depth
    depth = (back - FLEX_MM - lights.led_height_mm, back - FLEX_MM + 1e-3)
    bodies = [((back - FLEX_MM, back), row.board, place.flex_z)]
    bodies += [
        (depth, (u - lights.led_length_mm / 2, u + lights.led_length_mm / 2), z)
        for u in row.centers
    ]
    if color == "green":
        array = union_of(box(out, along, z) for out, along, z in bodies)
    else:
        array = union_of(box(along, out, z) for out, along, z in bodies)
        array = array if color == "red" else array.mirror("XZ")
    return one_solid(array, f"the {color} LED array")


def pin(design: Wedge, index: int) -> cq.Solid:
    """A piece of wire in the notch between acrylic and case."""
    place = Layout(design)
    x, y = place.pin_places[index]
    radius = design.fastening.pin_diameter_mm / 2
    shape = cylinder((x, y, place.bottom), (0, 0, 1), radius, design.pin_length_mm)
    return one_solid(shape, "a pin")


def camera(design: Wedge) -> cq.Solid:
    """The camera's head and lens barrel."""
    lens = design.camera
    x, z, half = lens.pupil_x_mm, lens.pupil_z_mm, lens.head_size_mm / 2
    head = box((x, x + lens.head_depth_mm), (-half, half), (z - half, z + half))
    barrel = cylinder(
        (x + 0.1, 0, z), (-1, 0, 0), lens.barrel_diameter_mm / 2, lens.barrel_length_mm + 0.1
    )
    return one_solid(turned(head.union(barrel), lens.pitch_deg, (x, 0.0, z)), "the camera")


def screw(size: str, under_head: Vector, direction: Vector, length: float) -> cq.Solid:
    """A screw whose shank points in ``direction``; its thread is drawn at the core's diameter."""
    row = fastener(size)
    back = (-direction[0], -direction[1], -direction[2])
    head = cylinder(under_head, back, row.head_diameter_mm / 2, row.head_height_mm)
    shank = cylinder(under_head, direction, row.core_mm / 2, length)
    return one_solid(head.union(shank), "a screw")


def resistor_board(design: Wedge) -> cq.Solid:
    """The resistor board on the CSI-to-HDMI board's socket, between its screws and its plug."""
    place = Layout(design)
    length, width = boards(design)[0].size
    x1, z = resistor_board_end(place)
    return one_solid(
        box((x1 - length, x1), (-width / 2, width / 2), (z, z + RESISTOR_BOARD_HEIGHT)),
        "the resistor board",
    )


def resistor_board_end(place: Layout) -> tuple[float, float]:
    """Its base-most x, and the height (z) of its underside."""
    x = board_x(place) + BOARD[0] / 2 - RESISTOR_BOARD_INSET
    return x, board_z(place) + BOARD[2] + SOCKET[2] + TAPE


def socket_back(place: Layout) -> tuple[float, float]:
    """Base-most x of the adapter's socket, which the ribbon's end reaches, and its top (z)."""
    return board_x(place) - BOARD[0] / 2 + SOCKET[0], board_z(place) + BOARD[2] + SOCKET[2]


def compartment_height_mm() -> float:
    """Least height of the compartment over all that lies in it."""
    pile = max(PLUG[1], SOCKET[2] + TAPE + RESISTOR_BOARD_HEIGHT)
    return WALL + POST_HEIGHT + BOARD[2] + pile + TAPE


def compartment_length_mm() -> float:
    """Least length of the compartment, with room for the wires before the boards."""
    return BOARD_TO_BACK + BOARD[0] / 2 + WIRES_LENGTH + WALL


def csi_hdmi_board(design: Wedge) -> cq.Solid:
    """The CSI-to-HDMI adapter with its socket and its plug."""
    place = Layout(design)
    x, z = board_x(place), board_z(place)
    length, width, thickness = BOARD
    board = box((x - length / 2, x + length / 2), (-width / 2, width / 2), (z, z + thickness))
    end = place.plate_x1 - PLUG_INSET
    plug = box(
        (end - PLUG_LENGTH, end),
        (-PLUG[0] / 2, PLUG[0] / 2),
        (z + thickness - 0.01, z + thickness + PLUG[1]),
    )
    front = x - length / 2
    socket = box(
        (front, front + SOCKET[0]),
        (-SOCKET[1] / 2, SOCKET[1] / 2),
        (z + thickness - 0.01, z + thickness + SOCKET[2]),
    )
    holes = union_of(
        cylinder((x + along, across, z - 1), (0, 0, 1), place.screw.clearance_mm / 2, 2 + thickness)
        for along, across in POSTS
    )
    return one_solid(board.cut(holes).union(plug).union(socket), "the CSI-to-HDMI board")
