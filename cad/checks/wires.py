# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Wires and ribbon have their room: as many wires as the netlists count, a bend not too tight."""

from collections.abc import Sequence

from cad.bounds import EPSILON
from cad.electronics.boards import Board
from cad.layout import Layout
from cad.refusals import BEND_THICKNESSES
from cad.result import Result
from cad.wires import by_side, ribbon_bend_mm, rooms, wires_that_fit
from sensor.design import Wedge


def check_wires(design: Wedge, boards: Sequence[Board]) -> list[Result]:
    """Each way takes the wires of the arrays that end beside it, and the ribbon's bend is wide."""
    place, wiring = Layout(design), design.wiring
    ends = {
        board.name.removeprefix("led_array_"): sum(pad.component == "J1" for pad in board.pads)
        for board in boards
        if board.name.startswith("led_array_")
    }
    results = []
    for side, count in by_side(ends).items():
        for name, (wide, high) in rooms(place).items():
            fit = wires_that_fit((wide, high), wiring.wire_diameter_mm)
            thick = wiring.wire_diameter_mm
            detail = f"{count} of {thick:g} mm pass through {wide:.2f} x {high:.2f} mm"
            results.append(
                Result("wires", f"{name}, {side}", fit, "wires fit", count, "at least", detail)
            )
    strain = 50 * wiring.ribbon_thickness_mm / (radius := ribbon_bend_mm(place))
    bend = f"radius {radius:.1f} mm" if radius < 1e3 else "straight"
    room = 2 * place.socket_half + EPSILON
    return [
        *results,
        Result("wires", "ribbon's bend", strain, "% strain", 50 / BEND_THICKNESSES, "at most",
               f"{bend} between camera holder and cover"),
        Result("wires", "ribbon in the camera's socket", room, "mm", wiring.ribbon_width_mm,
               "at least", "width"),
    ]  # fmt: skip
