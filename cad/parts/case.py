# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""The case: a hollow wedge that holds mirror, acrylic, lights and camera holder."""

import math

import cadquery as cq

from cad import layout
from cad.features import (
    both_sides,
    box,
    cylinder,
    digits,
    digits_width,
    one_solid,
    prism_xz,
    union_of,
)
from cad.layout import BASE_POST, FLANGE, TIP_POST, Layout
from sensor.design import Wedge

MARK_DEPTH = 0.3
MARK_STROKE = 0.15
"""Width of the strokes over the height of a digit."""
_THROUGH = 1.0
"""Cuts reach this far beyond the faces that they open."""


def case(design: Wedge) -> cq.Solid:
    """The printed case, with the design's hash sunk into its roof."""
    place = Layout(design)
    body = _hull(place)
    for cut in (_cavity, _acrylic_pocket, _light_pockets, _tunnel, _wire_channels):
        body = body.cut(cut(place))
    body = body.union(_corner_ribs(place)).cut(_holes(place))
    return one_solid(body.cut(_mark(place)), "the case")


def _hull(place: Layout) -> cq.Workplane:
    """Outer shape: the roof runs parallel to the mirror, then flat to the back."""
    roof_z = place.design.housing.roof_z_mm
    tip_z = max(1.2, place.seat_z(0) + place.roof / math.cos(place.tilt))
    lift = (place.design.mirror.thickness_mm + place.roof) / math.cos(place.tilt)
    slope_x0 = (tip_z - lift - place.mirror_z(0)) / math.tan(place.tilt)
    outline = [(0.0, place.bottom), (0.0, tip_z)]
    if slope_x0 > 1e-6:
        outline.append((slope_x0, tip_z))
    outline += [
        (place.roof_flat_x0, roof_z),
        (place.rear, roof_z),
        (place.rear, place.bottom),
    ]
    return prism_xz(outline, place.outer_half)


def _cavity(place: Layout) -> cq.Workplane:
    """Room for the mirror and the light; open below, so that the mirror goes in from there."""
    x0, slope = place.window_x0, math.tan(place.tilt)
    end = place.mirror_x1 - place.design.mirror.thickness_mm * math.sin(place.tilt) + place.slide
    beyond = place.mirror_x1 + place.slide
    outline = [
        (x0, -_THROUGH),
        (x0, place.seat_z(x0)),
        (end, place.seat_z(end)),
        (beyond, place.seat_z(end) - (beyond - end) / slope),
        # No further: wider than the tunnel, it would thin the wall before the roof's screws.
        (place.tunnel_x0, min(place.mirror_top, place.plug_z[1])),
        (place.tunnel_x0, place.baffle_z(place.tunnel_x0)),
        (place.window_x1, place.baffle_z(place.window_x1)),
        (place.window_x1, -_THROUGH),
    ]
    return prism_xz(outline, place.cavity_half)


def _acrylic_pocket(place: Layout) -> cq.Workplane:
    half = place.acrylic_half + place.press
    return box(
        (place.acrylic_x0 - place.press, place.acrylic_x1 + place.press),
        (-half, half),
        (place.bottom - _THROUGH, 0),
    )


def _light_pockets(place: Layout) -> cq.Workplane:
    """One pocket around three sides, open below; none at the tip."""
    x1 = place.acrylic_x1 + place.light_depth
    half = place.acrylic_half + place.light_depth
    return box((place.acrylic_x0 + TIP_POST, x1), (-half, half), (place.bottom - _THROUGH, 0))


def _corner_ribs(place: Layout) -> cq.Workplane:
    """Ribs that grip the acrylic's corners at the base; wires pass behind them."""
    outer = place.rib_out
    rib = box(
        (place.acrylic_x1 - BASE_POST, place.acrylic_x1 + outer),
        (place.acrylic_half - BASE_POST, place.acrylic_half + outer),
        (place.bottom, 0),
    )
    return both_sides(rib).cut(_acrylic_pocket(place))


def _tunnel(place: Layout) -> cq.Workplane:
    half = place.tunnel_half
    return box((place.tunnel_x0, place.rear + _THROUGH), (-half, half), place.tunnel_z)


def _wire_channels(place: Layout) -> cq.Workplane:
    x0 = place.acrylic_x1 + place.light_depth - 0.5
    return both_sides(wire_channel(place, (x0, place.rear + FLANGE + _THROUGH)))


def wire_channel(place: Layout, x: tuple[float, float]) -> cq.Workplane:
    """The channel at y > 0, open below."""
    return box(x, place.channel_y, (place.bottom - _THROUGH, place.channel_top))


def _holes(place: Layout) -> cq.Workplane:
    """Holes for the screws at the back and in the roof, and for the pins."""
    tap = place.screw.tap_mm / 2
    roof_z = place.design.housing.roof_z_mm
    holes = [
        cylinder((place.rear, y, place.rear_screw_z), (-1, 0, 0), tap, place.rear_hole_depth)
        for y in (-place.screw_y, place.screw_y)
    ]
    holes += [
        cylinder((x, y, roof_z), (0, 0, -1), tap, place.roof_hole_depth)
        for x in place.roof_screw_x
        for y in (-place.screw_y, place.screw_y)
    ]
    holes += [
        cylinder((x, y, place.bottom), (0, 0, 1), place.pin_hole_radius, -place.bottom)
        for x, y in place.pin_places
    ]
    return union_of(holes)


def _mark(place: Layout) -> cq.Workplane:
    """The first digits of the design's hash, in lines across the flat of the roof."""
    per_line, lines, height = _mark_size(place)
    stroke, roof_z = MARK_STROKE * height, place.design.housing.roof_z_mm
    width = digits_width(per_line, height, stroke)
    middle = (place.roof_flat_x0 + place.rear) / 2
    strokes = []
    for line in range(lines):
        text = place.design.sha256[line * per_line : (line + 1) * per_line]
        end = middle + (1.4 * (line + 1 - lines / 2) - 0.2) * height
        for across, along in digits(text, height, stroke):
            x = (end - along[1], end - along[0])
            y = (across[0] - width / 2, across[1] - width / 2)
            strokes.append(box(x, y, (roof_z - MARK_DEPTH, roof_z + _THROUGH)))
    return union_of(strokes)


def _mark_size(place: Layout) -> tuple[int, int, float]:
    """Digits a line, lines, and their height: as many digits, then as tall, as there is room."""
    across = 2 * (place.screw_y - place.screw.tap_mm / 2 - layout.MIN_WALL)
    along = place.rear - place.roof_flat_x0 - 1
    for per_line, lines in ((8, 1), (4, 2), (2, 4), (2, 2), (1, 2)):
        width_of_one = digits_width(per_line, 1.0, MARK_STROKE)
        height = min(4.0, across / width_of_one, along / (1.4 * lines))
        if height * (1 - 3 * MARK_STROKE) / 2 > layout.MIN_WALL:
            return per_line, lines, height
    return 1, 1, min(4.0, along / 1.4)
