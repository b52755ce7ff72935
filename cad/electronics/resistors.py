# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""One resistor for each LED array, from supply, forward voltage and current.

The LEDs of an array are in parallel: the supply of the camera's cable, 3.3 V, leaves no room for
two in series. They share the current evenly only if they come from one reel.
"""

import math
from dataclasses import dataclass

from cad.layout import Layout
from sensor.design import Wedge

E24 = (10, 11, 12, 13, 15, 16, 18, 20, 22, 24, 27, 30,
       33, 36, 39, 43, 47, 51, 56, 62, 68, 75, 82, 91)  # fmt: skip
RATED_W = 0.25
"""Of a resistor in a 1206 package."""
LEAST_OHM = 1.0
"""Where the bill's series of resistors begins."""
LEAST_DROP_V = 0.3
"""Over a resistor: LEDs of one reel differ by a tenth of a volt, which then is a third of it."""
ADAPTER_V = 3.3
"""What the camera's connector has, and so the adapter."""
ADAPTER_MA = 250.0
"""Taken from it by all arrays at most: as much as the camera itself takes there."""


@dataclass(frozen=True)
class Ballast:
    """The resistor of one array and the current that follows from it."""

    color: str
    leds: int
    forward_v: float
    ohm: float
    """The next larger value of the E24 series."""
    supply_v: float

    @property
    def led_current_ma(self) -> float:
        """Current of each LED, at the typical forward voltage."""
        return (self.supply_v - self.forward_v) / self.ohm / self.leds * 1000

    @property
    def total_current_ma(self) -> float:
        """Current of the array."""
        return self.led_current_ma * self.leds

    @property
    def power_w(self) -> float:
        """Heat in the resistor."""
        return self.ohm * (self.total_current_ma / 1000) ** 2

    @property
    def label(self) -> str:
        """The value as boards and part numbers have it, without a last zero: 12R, 2R, 4R7, 2K4."""
        kilo = self.ohm >= 1000
        whole, _, tenths = f"{self.ohm / 1000 if kilo else self.ohm:g}".partition(".")
        return whole + ("K" if kilo else "R") + tenths


def ballasts(design: Wedge) -> list[Ballast]:
    """The resistor of every array that has LEDs."""
    wiring = design.wiring
    found = []
    for row in Layout(design).light_rows():
        forward = float(getattr(wiring, f"{row.color}_forward_v"))
        current = wiring.led_current_ma * len(row.centers) / 1000
        exact = (wiring.supply_v - forward) / current
        found.append(
            Ballast(row.color, len(row.centers), forward, next_e24(exact), wiring.supply_v)
        )
    return found


def takes_adapters_supply(design: Wedge) -> bool:
    """Whether the LEDs' voltage is that of the camera's connector."""
    return design.wiring.supply_v == ADAPTER_V


def supply_words(design: Wedge) -> str:
    """Where the LEDs are fed from."""
    if takes_adapters_supply(design):
        return f"{ADAPTER_V:g} V and ground of the adapter"
    return (
        f"{design.wiring.supply_v:g} V of a supply of your own, led in next to the HDMI socket,"
        f" and connect its ground to that of the adapter (which provides {ADAPTER_V:g} V only)"
    )


def next_e24(ohm: float) -> float:
    """The smallest value of the E24 series that is no smaller than ``ohm``."""
    decade = 10.0 ** (math.floor(math.log10(ohm)) - 1)
    for scale in (decade, 10 * decade):
        for value in E24:
            if value * scale >= ohm * (1 - 1e-9):
                return round(value * scale, 6)
    raise AssertionError(ohm)
