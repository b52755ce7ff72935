# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""What a workshop adds to the design: its printer's fit, its laser's kerf, screws, LED currents."""

from dataclasses import dataclass
from typing import Literal

from sensor.errors import WedgeError
from sensor.marked import Bounded, bounded, chosen, datasheet, measured, paper

SCREWS = ("M2", "M2.5")
FLEX_MM = 0.2
"""Thickness of the flexible circuit that carries an LED array, a part of the lights' backing."""


@dataclass(frozen=True, kw_only=True)
class Printing(Bounded):
    """Gaps between printed parts, per side, and the settings a part is printed with."""

    sliding_clearance_mm: float = bounded(0.05, 0.5)
    """Between parts that slide past each other."""
    press_clearance_mm: float = bounded(0.0, 0.2)
    """Between parts that hold each other; printed holes shrink, so a small gap presses."""
    layer_mm: float = bounded(0.05, 0.3)


@dataclass(frozen=True, kw_only=True)
class Laser(Bounded):
    """Width of the laser's cut in what it cuts; measure yours with the kerf comb."""

    acrylic_kerf_mm: float = bounded(0, 0.6)
    mirror_kerf_mm: float = bounded(0, 0.6)


@dataclass(frozen=True, kw_only=True)
class Fastening(Bounded):
    """Screws and pins."""

    screw: Literal["M2", "M2.5"]
    boss_pitch_mm: float = bounded(8, 100)
    """Between the two rows of screws, left and right of the camera."""
    pin_diameter_mm: float = bounded(0.6, 2)

    def __post_init__(self) -> None:
        """Check the screw's name."""
        super().__post_init__()
        if self.screw not in SCREWS:
            raise WedgeError(
                f"fastening.screw = {self.screw!r} must be one of {', '.join(SCREWS)}."
            )


@dataclass(frozen=True, kw_only=True)
class Wiring(Bounded):
    """The LEDs' supply, what sets the resistors, and what runs to the camera and the LEDs."""

    supply_v: float = bounded(3, 12)
    led_current_ma: float = bounded(0.5, 30)
    red_forward_v: float = bounded(1.5, 4)
    green_forward_v: float = bounded(1.5, 4)
    blue_forward_v: float = bounded(1.5, 4)
    led_pitch_mm: float = bounded(1, 15)
    """Between the centres of two neighbours in an array."""
    wire_diameter_mm: float = bounded(0.1, 1.5)
    """Over the insulation."""
    ribbon_width_mm: float = bounded(2, 20)
    """Of the camera's ribbon, between head and plug."""
    ribbon_thickness_mm: float = bounded(0.05, 0.5)


@dataclass(frozen=True, kw_only=True)
class Compartment(Bounded):
    """The box behind the sensor that covers the CSI-to-HDMI adapter."""

    length_mm: float = bounded(34, 80)
    width_mm: float = bounded(34, 80)
    height_mm: float = bounded(10, 40)


DESKTOP_PRINTER = Printing(
    sliding_clearance_mm=chosen(0.15),
    press_clearance_mm=chosen(0.10),
    layer_mm=chosen(0.12),
)
CO2_LASER = Laser(acrylic_kerf_mm=chosen(0.18), mirror_kerf_mm=chosen(0.18))
CSI_SUPPLY = Wiring(
    supply_v=paper(3.3),
    led_current_ma=chosen(5.0),
    red_forward_v=chosen(1.9),  # typical of the colour at this current: measure your reel
    green_forward_v=chosen(2.8),
    blue_forward_v=chosen(2.8),
    led_pitch_mm=chosen(3.8),
    wire_diameter_mm=datasheet(0.5),  # wrapping wire, AWG 30
    ribbon_width_mm=chosen(8.0),  # no drawing found: measure yours
    ribbon_thickness_mm=chosen(0.2),
)
LAB_COMPARTMENT = Compartment(
    length_mm=measured(42.0), width_mm=measured(34.0), height_mm=measured(14.5)
)


def m2_fastening(boss_pitch_mm: float, pin_diameter_mm: float) -> Fastening:
    """M2 screws in two rows, and pins of drawn wire."""
    return Fastening(
        screw="M2",
        boss_pitch_mm=chosen(boss_pitch_mm),
        pin_diameter_mm=datasheet(pin_diameter_mm),
    )
