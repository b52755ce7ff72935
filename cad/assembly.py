# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""How the sensor goes together: bodies, the order they go in, and each one's assembly path.

The bill counts these bodies, the guide describes these steps, the insertion test moves each body
along its path, and the exploded view pulls them apart along the same paths.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import cadquery as cq

from cad.catalogue import PRINTED
from cad.layout import FLANGE, PLATE_UNDER_HEAD, REAR_SCREW_LENGTH, ROOF_SCREW_LENGTH, Layout
from cad.motions import Shift, Turn, Vector, Way
from cad.parts import bought
from cad.parts.electronics_cover import POSTS, UNDER_HEAD, board_x, board_z
from cad.parts.gripper_adapter import cover_screw_places
from cad.steps import Assembly, Body, Step
from sensor.design import Wedge

Placed = tuple[Body, Callable[[], cq.Solid]]
"""A body, and what makes its solid in its place."""

BOARD_SCREW_LENGTH = 4.0
COVER_SCREW_LENGTH = 6.0
_DOWN, _UP, _BACK = (0.0, 0.0, -1.0), (0.0, 0.0, 1.0), (1.0, 0.0, 0.0)
MIRROR_SWING_DEG = 10.0
"""The mirror goes in top first, this much steeper than its seat, and its foot swings up."""


@dataclass(frozen=True)
class ScrewRow:
    """Equal screws: where each head lies on its part, the way of the shanks, and their length."""

    stem: str
    heads: tuple[Vector, ...]
    direction: Vector
    length_mm: float


def solids_of(design: Wedge) -> dict[str, cq.Solid]:
    """Every body as a solid in its place."""
    return {body.name: make() for body, make in _placed(design)}


def assembly_of(design: Wedge) -> Assembly:
    """The order in which the sensor goes together."""
    bodies = {body.name: body for body, _ in _placed(design)}
    colors = [row.color for row in Layout(design).light_rows()]
    films = list(Layout(design).films)
    steps = [
        Step("case", "Start with the printed case", "sensor", ("case",)),
        Step("mirror", "Glue the mirror to its seat", "sensor", ("mirror",)),
        Step("lights", "Tape the LED arrays into their pockets", "sensor",
             tuple(f"{color}_leds" for color in colors)),
        Step("acrylic", "Clean the acrylic block", "window", ("acrylic",)),
    ]  # fmt: skip
    titles = {"gray_filter": "Stick on the gray filters", "diffuser": "Stick on the diffusers"}
    steps += [
        Step(film, titles[film], "window", tuple(f"{color}_{film}" for color in colors))
        for film in films
    ]
    steps += [
        Step("gel", "Glue the gel to the acrylic", "window", ("gel",)),
        Step("window", "Press the window into the case", "sensor", (), "window"),
        Step("pins", "Fix the window with two pins", "sensor", ("pin_1", "pin_2")),
        Step("camera_holder", "Take the camera holder", "camera", ("camera_holder",)),
        Step("camera", "Press the camera into its holder", "camera", ("camera",)),
        Step("camera_into_case", "Slide the camera holder into the case", "sensor", (), "camera"),
        Step("rear_screws", "Screw the camera holder down", "sensor", _names("rear_screw", 2)),
        Step("adapter", "Put the gripper adapter on the roof", "sensor", ("adapter_wsg50",)),
        Step("roof_screws", "Screw the gripper adapter down", "sensor", _names("roof_screw", 4)),
        Step("cover", "Take the electronics cover", "electronics", ("electronics_cover",)),
        Step("board", "Put the CSI-to-HDMI board on its posts", "electronics", ("csi_hdmi_board",)),
        Step("board_screws", "Screw the board down", "electronics", _names("board_screw", 4)),
        Step("resistor_board", "Solder, plug in, and put the resistor board in last", "electronics",
             ("resistor_board",)),
        Step("cover_into_place", "Close the compartment", "sensor", (), "electronics"),
        Step("cover_screws", "Screw the cover to the adapter", "sensor", _names("cover_screw", 4)),
    ]  # fmt: skip
    return Assembly(bodies, tuple(steps))


def _names(stem: str, count: int) -> tuple[str, ...]:
    return tuple(f"{stem}_{index + 1}" for index in range(count))


def _straight(direction: Vector, length: float) -> Way:
    x, y, z = direction
    return (Shift((x * length, y * length, z * length)),)


def _placed(design: Wedge) -> list[Placed]:
    return [*_optics(design), *_mechanics(design), *_screws(design)]


def _optics(design: Wedge) -> list[Placed]:
    """Mirror, lights and the window, all of which go in from below."""
    place = Layout(design)
    down = partial(_straight, _DOWN)
    far = design.housing.roof_z_mm + design.acrylic.thickness_mm + 5
    swing = Turn((place.mirror_x1, 0.0, place.mirror_top), -MIRROR_SWING_DEG)
    glass = Body("mirror", "mirror", "PMMA front-surface mirror", (swing, *down(far)))
    bodies: list[Placed] = [
        (glass, partial(bought.mirror, design)),
        (Body("acrylic", "acrylic", "PMMA clear", down(far)), partial(bought.acrylic, design)),
        (Body("gel", "gel", "silicone clear", down(far / 2)), partial(bought.gel, design)),
    ]
    outward = {"red": (0.0, 8.0, 0.0), "blue": (0.0, -8.0, 0.0), "green": (8.0, 0.0, 0.0)}
    for row in place.light_rows():
        color = row.color
        body = Body(f"{color}_leds", f"led_array_{color}", "electronics", down(far / 2))
        bodies.append((body, partial(bought.led_array, design, color)))
        side = "base" if color == "green" else "side"
        for order, film in enumerate(place.films):
            away = _straight(outward[color], 1 + 0.5 * order)
            strip = Body(f"{color}_{film}", f"{film}_{side}", "film", away)
            bodies.append((strip, partial(bought.film, design, film, color)))
    wire = f"pin_{design.fastening.pin_diameter_mm:g}"
    bodies += [
        (Body(f"pin_{index + 1}", wire, "brass", down(10)), partial(bought.pin, design, index))
        for index in range(2)
    ]
    return bodies


def _mechanics(design: Wedge) -> list[Placed]:
    """The printed parts of the assembly, the camera and the board."""
    place = Layout(design)
    length = design.housing.case_length_mm
    ways: dict[str, Way] = {
        "case": (),
        "camera_holder": _straight(_BACK, length),
        "adapter_wsg50": _straight(_UP, 20),
        "electronics_cover": _straight(_DOWN, 30),
    }
    bodies: list[Placed] = [
        (Body(part.id, part.id, part.material, ways[part.id]), partial(part.make, design))
        for part in PRINTED
        if part.use == "assembly"
    ]
    back = _straight((math.cos(place.pitch), 0.0, -math.sin(place.pitch)), 25)
    bodies.append((Body("camera", "camera", "electronics", back), partial(bought.camera, design)))
    for name, make in (
        ("csi_hdmi_board", bought.csi_hdmi_board),
        ("resistor_board", bought.resistor_board),
    ):
        bodies.append((Body(name, name, "electronics", _straight(_UP, 20)), partial(make, design)))
    return bodies


def screw_rows(design: Wedge) -> tuple[ScrewRow, ...]:
    """Every screw of the sensor: the holes of the parts that it joins lie on its axis."""
    place = Layout(design)
    y, roof = place.screw_y, design.housing.roof_z_mm
    middle = board_x(place)
    top = board_z(place) + bought.BOARD[2]
    return (
        ScrewRow(
            "rear_screw",
            tuple((place.rear + FLANGE, side * y, place.rear_screw_z) for side in (-1, 1)),
            (-1.0, 0.0, 0.0),
            REAR_SCREW_LENGTH,
        ),
        ScrewRow(
            "roof_screw",
            tuple(
                (x, side * y, roof + PLATE_UNDER_HEAD)
                for x in place.roof_screw_x
                for side in (-1, 1)
            ),
            _DOWN,
            ROOF_SCREW_LENGTH,
        ),
        ScrewRow(
            "board_screw",
            tuple((middle + along, across, top) for along, across in POSTS),
            _DOWN,
            BOARD_SCREW_LENGTH,
        ),
        ScrewRow(
            "cover_screw",
            tuple((x, across, roof - UNDER_HEAD) for x, across in cover_screw_places(place)),
            _UP,
            COVER_SCREW_LENGTH,
        ),
    )


def _screws(design: Wedge) -> list[Placed]:
    bodies: list[Placed] = []
    size = design.fastening.screw
    for row in screw_rows(design):
        part = f"screw_{size.lower()}x{row.length_mm:g}"
        back = _straight(row.direction, -20)
        for index, head in enumerate(row.heads):
            body = Body(f"{row.stem}_{index + 1}", part, "steel", back)
            make = partial(bought.screw, size, head, row.direction, row.length_mm)
            bodies.append((body, make))
    return bodies
