# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""The gel's mold: a cavity, curved or flat, and the lid that makes the gel's flat back.

The mold has its own frame: origin at the centre of the pad's back, z up, cavity downward. Four
notches lead through the rim, and through the lid's ridge, which would close them, to the outside.
"""

from dataclasses import replace

import cadquery as cq

from cad.features import Point, box, ellipsoid_cap, one_solid, union_of, workplane
from cad.layout import Layout
from sensor.design import Gel, Wedge

RIM = 6.0
"""Width of the mold around the pad."""
FLOOR = 4.0
GROOVE_INSIDE, GROOVE_OUTSIDE, GROOVE_DEPTH = 1.6, 3.8, 1.2
"""The locating groove, measured outward from the pad's edge."""
OVERFLOW_WIDTH = 2.0
"""Of the four notches through the rim, by which the excess silicone leaves."""
GATE_DEPTH = 0.6
"""Of a notch between pad and groove, shallow so that its flash trims off; then as the groove."""
LID = 3.0


def gel_pad(gel: Gel) -> cq.Solid:
    """The gel in the mold's frame: back at z = 0, apex at z = -thickness."""
    length, width, depth = gel.pad_length_mm, gel.pad_width_mm, gel.thickness_mm
    below = 0.5 if gel.curved else 0.0
    body = box((-length / 2, length / 2), (-width / 2, width / 2), (-depth - below, 0))
    if gel.curved:
        axes = (gel.semi_axis_along_mm, gel.semi_axis_across_mm, gel.semi_axis_normal_mm)
        body = body.intersect(ellipsoid_cap(axes, length / 2, width / 2, -depth))
    return one_solid(body, "the gel")


def mold_curved(design: Wedge) -> cq.Solid:
    """The half with the ellipsoid's cavity."""
    return _cavity_half(replace(design.gel, curved=True))


def mold_flat(design: Wedge) -> cq.Solid:
    """The half with a flat cavity of the same depth."""
    return _cavity_half(replace(design.gel, curved=False))


def _cavity_half(gel: Gel) -> cq.Solid:
    x, y = gel.pad_length_mm / 2, gel.pad_width_mm / 2
    block = box((-x - RIM, x + RIM), (-y - RIM, y + RIM), (-gel.thickness_mm - FLOOR, 0))
    body = (
        block.edges("|Z")
        .fillet(2)
        .cut(_ring(gel, 0, GROOVE_DEPTH).translate((0, 0, -GROOVE_DEPTH)))
        .cut(_notches(gel, (0, GROOVE_INSIDE), (-GATE_DEPTH, 0)))
        .cut(_notches(gel, (GROOVE_OUTSIDE, RIM), (-GROOVE_DEPTH, 0)))
    )
    return one_solid(body.cut(workplane(gel_pad(gel))), "the mold")


def mold_lid(design: Wedge) -> cq.Solid:
    """The half that closes either cavity; modelled as it is printed, its ridge upward."""
    gel, gap = design.gel, Layout(design).slide
    x, y = gel.pad_length_mm / 2, gel.pad_width_mm / 2
    plate = box((-x - RIM, x + RIM), (-y - RIM, y + RIM), (-LID, 0)).edges("|Z").fillet(2)
    height = GROOVE_DEPTH - 0.2
    ridge = _ring(gel, gap, height).cut(_notches(gel, (0, RIM), (0, height)))
    return one_solid(plate.union(ridge), "the mold's lid")


def _notches(gel: Gel, outward: Point, z: Point) -> cq.Workplane:
    """What the notches take out between two distances from the pad's edge, on all four sides."""
    x, y, half = gel.pad_length_mm / 2, gel.pad_width_mm / 2, OVERFLOW_WIDTH / 2
    near, far = outward
    across = (-half, half)
    return union_of(
        [
            box((x + near, x + far), across, z),
            box((-x - far, -x - near), across, z),
            box(across, (y + near, y + far), z),
            box(across, (-y - far, -y - near), z),
        ]
    )


def _ring(gel: Gel, gap: float, height: float) -> cq.Workplane:
    inner, outer = GROOVE_INSIDE + gap, GROOVE_OUTSIDE - gap
    x, y = gel.pad_length_mm / 2, gel.pad_width_mm / 2
    ring = box((-x - outer, x + outer), (-y - outer, y + outer), (0, height))
    return ring.cut(box((-x - inner, x + inner), (-y - inner, y + inner), (-1, height + 1)))
