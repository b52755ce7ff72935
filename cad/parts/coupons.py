# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Fit coupons: small prints with the fits of the parts, to be tried before the parts are printed.

Each coupon repeats a pressed fit three times: tighter by 0.05 mm a side (one dot), as designed
(two dots) and looser (three dots). Change ``printing.press_clearance_mm`` to the one that fits.
Holes for screws come once: ``fastening.screw`` sets them, and no clearance changes them.
"""

import cadquery as cq

from cad.features import box, cylinder, one_solid, union_of
from cad.layout import PIN_OUTWARD, Layout
from sensor.design import Wedge

STEPS = (-0.05, 0.0, 0.05)
WALL = 2.7
THICK = 5.0


def camera_coupon(design: Wedge) -> cq.Solid:
    """Three sockets for the camera's head; a hole for a screw's thread and one to clear it."""
    place = Layout(design)
    head = design.camera.head_size_mm
    cell = head + 2 * WALL
    cuts = []
    for index, step in enumerate(STEPS):
        half = head / 2 + place.press + step
        x = (index + 0.5) * cell
        cuts.append(box((x - half, x + half), (cell / 2 - half, cell / 2 + half), (-1, THICK + 1)))
        cuts += _dots(index, x, 1.25)
    middle = 1.5 * cell
    for x, width in ((middle - 3, place.screw.tap_mm), (middle + 3, place.screw.clearance_mm)):
        cuts.append(cylinder((x, cell + 2, -1), (0, 0, 1), width / 2, THICK + 2))
    body = box((0, 3 * cell), (0, cell + 5), (0, THICK))
    return one_solid(body.cut(union_of(cuts)), "the camera's fit coupon")


def acrylic_coupon(design: Wedge) -> cq.Solid:
    """Three gauges as wide as the acrylic's seat at the tip, with the pins' notches."""
    place = Layout(design)
    depth, length = 5.0, design.acrylic.width_mm + 2 * WALL
    radius = place.pin_hole_radius
    cuts = []
    for index, step in enumerate(STEPS):
        y = index * (depth + 2.5) + 2.5
        half = place.acrylic_half + place.press + step
        middle = length / 2
        cuts.append(box((middle - half, middle + half), (y, y + depth), (-1, THICK + 1)))
        for sign in (-1, 1):
            at = middle + sign * (place.acrylic_half + PIN_OUTWARD)
            cuts.append(cylinder((at, y + 1.5, -1), (0, 0, 1), radius + step, THICK + 2))
        cuts += _dots(index, middle, y - 1.25)
    body = box((0, length), (0, 3 * (depth + 2.5) + 2.5), (0, THICK))
    return one_solid(body.cut(union_of(cuts)), "the acrylic's fit coupon")


def _dots(index: int, x: float, y: float) -> list[cq.Workplane]:
    """One to three shallow dots that tell the fits apart."""
    start = x - 0.9 * index
    return [
        cylinder((start + 1.8 * number, y, THICK - 0.5), (0, 0, 1), 0.4, 1.0)
        for number in range(index + 1)
    ]
