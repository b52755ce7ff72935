# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Boards as rectangles of copper, so that what touches what is exact. Lengths in mm."""

import math
from dataclasses import dataclass

from cad.electronics.resistors import Ballast, ballasts
from cad.layout import Layout, LightRow
from sensor.design import Wedge
from sensor.fabrication import FLEX_MM

TRACK, GAP, EDGE = 0.3, 0.2, 0.2
"""Width of tracks, smallest distance of copper to copper, and to the board's edge."""
HOLE, HOLE_PAD, HOLE_PITCH = 1.0, 1.7, 2.54
"""Where a wire is soldered in: drill, square pad and pitch."""
_PAD_SHARE, _PAD_LEAST = 0.8, 0.6
"""Height of an LED's pads over its width, and in mm at least."""
_HALF_GAP = 0.215
"""From an LED's middle to its pads, over its length."""
LEAST_LED_WIDTH = _PAD_LEAST / _PAD_SHARE
LEAST_LED_LENGTH = (TRACK + GAP) / (0.5 + _HALF_GAP)
"""Below it the tracks to the middles of an LED's two pads come closer than the gap."""


@dataclass(frozen=True)
class Rectangle:
    """Copper of one layer."""

    x: tuple[float, float]
    y: tuple[float, float]

    def touches(self, other: "Rectangle") -> bool:
        """Whether the two are one piece of copper."""
        return self.distance(other) <= 1e-9

    def distance(self, other: "Rectangle") -> float:
        """Gap between the two."""
        dx = max(other.x[0] - self.x[1], self.x[0] - other.x[1], 0.0)
        dy = max(other.y[0] - self.y[1], self.y[0] - other.y[1], 0.0)
        return math.hypot(dx, dy)

    @property
    def middle(self) -> tuple[float, float]:
        """Its centre."""
        return (self.x[0] + self.x[1]) / 2, (self.y[0] + self.y[1]) / 2

    @property
    def size(self) -> tuple[float, float]:
        """Its sides."""
        return self.x[1] - self.x[0], self.y[1] - self.y[0]

    def grown(self, by: float) -> "Rectangle":
        """The rectangle with ``by`` added on every side."""
        return Rectangle((self.x[0] - by, self.x[1] + by), (self.y[0] - by, self.y[1] + by))


@dataclass(frozen=True)
class Pad:
    """One pin of one component; with a hole it goes through the board."""

    component: str
    pin: str
    copper: Rectangle
    drill: float | None = None


@dataclass(frozen=True)
class Component:
    """What is soldered on, and where its middle is."""

    reference: str
    part: str
    """Id of the part in the bill."""
    value: str
    package: str
    middle: tuple[float, float]
    rotation_deg: float
    """Anticlockwise, from the footprint with pin 1, of a diode the cathode, on the left."""


@dataclass(frozen=True)
class Board:
    """A board of one copper layer, the nets that it must connect, and what is soldered on."""

    name: str
    size: tuple[float, float]
    thickness: float
    material: str
    pads: tuple[Pad, ...]
    tracks: tuple[Rectangle, ...]
    components: tuple[Component, ...]
    nets: dict[str, tuple[tuple[str, str], ...]]
    """Pins, as (component, pin), that each net joins."""


def boards(design: Wedge) -> list[Board]:
    """The resistor board and one array for each colour."""
    place = Layout(design)
    arrays = [_array(design, row, place) for row in place.light_rows()]
    return [_resistor_board(ballasts(design)), *arrays]


def _array(design: Wedge, row: LightRow, place: Layout) -> Board:
    """LEDs in parallel between two tracks, with pads for the wires at the tail."""
    lights = design.lights
    start, end = row.board
    length, height = end - start, place.flex_z[1] - place.flex_z[0]
    pad_height = min(_PAD_SHARE * lights.led_width_mm, height - 2 * (EDGE + TRACK + GAP))
    last = row.centers[-1] + lights.led_length_mm / 2 - start
    middle, half_gap = height / 2, _HALF_GAP * lights.led_length_mm
    rails = ((height - EDGE - TRACK, height - EDGE), (EDGE, EDGE + TRACK))
    tail = (length - min(1.6, length - last - 0.3), length - EDGE)
    tracks = [Rectangle((EDGE, length - EDGE), rail) for rail in rails]
    pads = [
        Pad("J1", "A", Rectangle(tail, (middle + GAP, height - EDGE))),
        Pad("J1", "K", Rectangle(tail, (EDGE, middle - GAP))),
    ]
    package = led_package(design)
    components = []
    nets: dict[str, list[tuple[str, str]]] = {"A": [("J1", "A")], "K": [("J1", "K")]}
    for index, center in enumerate(row.centers):
        name, u = f"D{index + 1}", center - start
        y = (middle - pad_height / 2, middle + pad_height / 2)
        anode = (u - lights.led_length_mm / 2, u - half_gap)
        cathode = (u + half_gap, u + lights.led_length_mm / 2)
        pads += [Pad(name, "A", Rectangle(anode, y)), Pad(name, "K", Rectangle(cathode, y))]
        tracks += [
            Rectangle(_narrow(anode), (middle, height - EDGE)),
            Rectangle(_narrow(cathode), (EDGE, middle)),
        ]
        part = f"led_{row.color}"
        turn = 180.0  # pick and place knows the cathode on the left at 0
        components.append(Component(name, part, row.color, package, (u, middle), turn))
        nets["A"].append((name, "A"))
        nets["K"].append((name, "K"))
    return Board(
        f"led_array_{row.color}", (length, height), FLEX_MM, "flexible polyimide", tuple(pads),
        tuple(tracks), tuple(components), {net: tuple(pins) for net, pins in nets.items()},
    )  # fmt: skip


def led_package(design: Wedge) -> str:
    """Length and width of the LEDs as their packages are named, in tenths of a mm: 3528."""
    lights = design.lights
    return "".join(f"{size * 10:02.0f}" for size in (lights.led_length_mm, lights.led_width_mm))


def _narrow(span: tuple[float, float]) -> tuple[float, float]:
    middle = (span[0] + span[1]) / 2
    return middle - TRACK / 2, middle + TRACK / 2


def _resistor_board(found: list[Ballast]) -> Board:
    """Supply in at J1; at J2 each array's anode, behind its resistor, and its cathode.

    Wires go straight into the holes: under the cover there is no height for connectors.
    """
    x0, low, high, rail = 3.0, 4.4, 7.6, 3.0
    pins_y, ground_y = 11.0, 13.4
    x_supply = x0 + 2 * len(found) * HOLE_PITCH + 2.3
    pads = [_hole("J1", "1", (x_supply, rail)), _hole("J1", "2", (x_supply, rail + HOLE_PITCH))]
    nets: dict[str, list[tuple[str, str]]] = {"supply": [("J1", "1")], "GND": [("J1", "2")]}
    tracks = [
        Rectangle((x0, x_supply), (rail - TRACK, rail + TRACK)),
        Rectangle((x0 + HOLE_PITCH, x_supply + TRACK), (ground_y - TRACK, ground_y + TRACK)),
        Rectangle((x_supply - TRACK, x_supply + TRACK), (rail + HOLE_PITCH, ground_y)),
    ]
    components = []
    for index, ballast in enumerate(found):
        name, x = f"R{index + 1}", x0 + 2 * index * HOLE_PITCH
        anode, cathode = str(2 * index + 1), str(2 * index + 2)
        pads += [
            Pad(name, "1", Rectangle((x - 0.9, x + 0.9), (low - 0.6, low + 0.6))),
            Pad(name, "2", Rectangle((x - 0.9, x + 0.9), (high - 0.6, high + 0.6))),
            _hole("J2", anode, (x, pins_y)),
            _hole("J2", cathode, (x + HOLE_PITCH, pins_y)),
        ]
        tracks += [
            Rectangle((x - TRACK, x + TRACK), (rail, low)),
            Rectangle((x - TRACK, x + TRACK), (high, pins_y)),
            Rectangle((x + HOLE_PITCH - TRACK, x + HOLE_PITCH + TRACK), (pins_y, ground_y)),
        ]
        part = f"resistor_{ballast.label}"
        components.append(Component(name, part, ballast.label, "1206", (x, (low + high) / 2), 90.0))
        nets["supply"].append((name, "1"))
        nets["GND"].append(("J2", cathode))
        nets[f"{ballast.color}_A"] = [(name, "2"), ("J2", anode)]
    return Board(
        "resistor_board", (x_supply + 3.0, 15.0), 1.6, "FR-4", tuple(pads), tuple(tracks),
        tuple(components), {net: tuple(pins) for net, pins in nets.items()},
    )  # fmt: skip


def _hole(component: str, pin: str, place: tuple[float, float]) -> Pad:
    x, y = place
    half = HOLE_PAD / 2
    return Pad(component, pin, Rectangle((x - half, x + half), (y - half, y + half)), HOLE)
