# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Channels hold the wires that the netlists count; the ribbon's bend is two arcs that meet."""

import math
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cad.checks import check_wires
from cad.electronics.boards import boards
from cad.layout import Layout
from cad.refusals import refuse_unbuildable
from cad.wires import bend_radius_mm, by_side, rooms, thickest_wire_mm, wires_that_fit
from sensor.design import FINGER, STANDARD, Wedge
from sensor.errors import WedgeError

BOTH = pytest.mark.parametrize("design", [STANDARD, FINGER], ids=lambda design: design.name)


@given(st.floats(0.3, 5), st.floats(0.3, 5), st.integers(1, 9))
def test_the_thickest_wire_fits_and_a_thicker_does_not(wide: float, high: float, n: int) -> None:
    thickest = thickest_wire_mm((wide, high), n)
    assert wires_that_fit((wide, high), thickest * (1 - 1e-6)) >= n
    assert wires_that_fit((wide, high), thickest * (1 + 1e-6)) < n


@BOTH
def test_wires_are_those_of_the_netlist_and_fit(design: Wedge) -> None:
    results = check_wires(design, boards(design))
    assert all(result.passed for result in results)
    counts = {result.subject: result.bound for result in results if result.unit == "wires fit"}
    assert counts["channel, y > 0"] == 4
    assert counts["channel, y < 0"] == 2
    assert by_side({"blue": 2}) == {"y < 0": 2}


@BOTH
def test_wires_too_thick_for_their_channel_are_found_and_refused(design: Wedge) -> None:
    room = min(thickest_wire_mm(room, 4) for room in rooms(Layout(design)).values())
    for wire, fits in ((room - 1e-3, True), (room + 1e-3, False)):
        wiring = replace(design.wiring, wire_diameter_mm=wire)
        changed = replace(design, wiring=wiring)
        found = [r.subject for r in check_wires(changed, boards(design)) if not r.passed]
        assert bool(found) is not fits
        if fits:
            refuse_unbuildable(changed)
        else:
            with pytest.raises(WedgeError, match=r"wiring\.wire_diameter_mm = .* must be at most"):
                refuse_unbuildable(changed)


def test_a_ribbon_too_thick_for_its_bend_is_found_and_refused() -> None:
    stiff = replace(STANDARD, wiring=replace(STANDARD.wiring, ribbon_thickness_mm=0.4))
    found = [r.subject for r in check_wires(stiff, boards(stiff)) if not r.passed]
    assert found == ["ribbon's bend"]
    with pytest.raises(WedgeError, match=r"wiring\.ribbon_thickness_mm = 0\.4 must be at most"):
        refuse_unbuildable(stiff)
    wide = replace(STANDARD, wiring=replace(STANDARD.wiring, ribbon_width_mm=9.0))
    found = [r.subject for r in check_wires(wide, boards(wide)) if not r.passed]
    assert found == ["ribbon in the camera's socket"]
    with pytest.raises(WedgeError, match=r"wiring\.ribbon_width_mm = 9 must be at most 8\.8"):
        refuse_unbuildable(wide)


@given(st.floats(0.5, 20), st.floats(0.0, 0.5), st.floats(0.05, 1.4))
def test_the_bend_is_two_arcs_that_meet(radius: float, fall: float, more: float) -> None:
    steepest = min(fall + more, 1.5)
    run = radius * (math.sin(fall) + 2 * math.sin(steepest))
    rise = radius * (1 + math.cos(fall) - 2 * math.cos(steepest))
    assert bend_radius_mm(rise, run, fall) == pytest.approx(radius, rel=1e-6)


def test_a_ribbon_that_need_not_rise_is_straight() -> None:
    assert bend_radius_mm(0.0, 4.0, 0.0) > 1e3
