# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Tools for calibration: a holder for the ball, and a guide for a caliper's jaws over the pad."""

import math

import cadquery as cq

from cad.features import box, cylinder, one_solid, union_of
from cad.layout import Layout
from sensor.design import Wedge

BALL_RADIUS = 2.4
"""The paper's calibration ball, in mm."""
BALL_SUNK = 2.9
"""Depth of the ball in its socket, past its middle."""
BALL_GAP = 0.1
"""Around the ball, whatever the fit: its socket must stay wide enough to lay it in for glue."""
STEM_RADIUS, STEM_LENGTH = 3.6, 20.0
GRIP_RADIUS, GRIP_LENGTH = 7.0, 8.0
JAW = 3.6
"""Width of the slots for a caliper's jaws."""
GUIDE = 3.0
LARGEST_GAP, GAP_SHARE = 5.0, 0.55
"""Between the jaws: the pad's slots must have room for the jaws on both sides of the gap."""


def ball_jig(_: Wedge) -> cq.Solid:
    """A stem with a socket at its top, into which the ball is glued; the same for every design."""
    grip = cylinder((0, 0, 0), (0, 0, 1), GRIP_RADIUS, GRIP_LENGTH)
    stem = cylinder((0, 0, GRIP_LENGTH), (0, 0, 1), STEM_RADIUS, STEM_LENGTH)
    top = GRIP_LENGTH + STEM_LENGTH
    radius = BALL_RADIUS + BALL_GAP
    socket = cq.Workplane().sphere(radius).translate((0, 0, top - BALL_SUNK + BALL_RADIUS))
    return one_solid(grip.union(stem).cut(socket), "the ball's jig")


def ball_jig_volume_mm3() -> float:
    """Closed form of the jig's volume: two cylinders less the sunk part of a sphere."""
    radius = BALL_RADIUS + BALL_GAP
    depth = BALL_SUNK + BALL_GAP
    cap = math.pi * depth**2 * (3 * radius - depth) / 3
    solid = GRIP_RADIUS**2 * GRIP_LENGTH + STEM_RADIUS**2 * STEM_LENGTH
    return math.pi * solid - cap


def caliper_gap_mm(design: Wedge) -> float:
    """How far apart the jaws are set, in half millimetres."""
    return min(LARGEST_GAP, math.floor(2 * GAP_SHARE * min(design.pad_size_mm)) / 2)


def caliper_jig(design: Wedge) -> cq.Solid:
    """A cap over the sensor's face with slots along and across the pad; slots face up."""
    place = Layout(design)
    gap, wall = 2 * place.slide, 1.6
    length, half = place.acrylic_x1 + place.light_depth, place.outer_half + gap
    skirt, over = 6.0, design.gel.thickness_mm + 1.0
    outer = box((-gap - wall, length), (-half - wall, half + wall), (-skirt, over + GUIDE))
    hollow = box((-gap, length + 1), (-half, half), (-skirt - 1, 0))
    gel_x = (place.acrylic_x0, place.acrylic_x1)
    gel = box(gel_x, (-place.acrylic_half, place.acrylic_half), (-1, over))
    middle = (place.acrylic_x0 + place.acrylic_x1) / 2
    x, y = design.gel.pad_length_mm / 2, design.gel.pad_width_mm / 2
    slots = union_of(
        [
            box((middle - x, middle + x), (-JAW / 2, JAW / 2), (-1, over + GUIDE + 1)),
            box((middle - JAW / 2, middle + JAW / 2), (-y, y), (-1, over + GUIDE + 1)),
        ]
    )
    return one_solid(outer.cut(hollow).cut(gel).cut(slots), "the caliper's jig")
