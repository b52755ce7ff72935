# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""The few shapes that parts are made of. Arguments in mm in the body's frame."""

import math
from collections.abc import Iterable, Sequence

import cadquery as cq

from cad.motions import Vector
from sensor.errors import WedgeError

Point = tuple[float, float]

SEGMENTS = {
    "0": "abcdef", "1": "bc", "2": "abged", "3": "abgcd", "4": "fgbc", "5": "afgcd",
    "6": "afgedc", "7": "abc", "8": "abcdefg", "9": "abcdfg", "a": "abcefg", "b": "cdefg",
    "c": "adef", "d": "bcdeg", "e": "adefg", "f": "aefg",
}  # fmt: skip


_XY = cq.Plane((0.0, 0.0, 0.0))
"""Made once: to find a plane by its name, cadquery makes all that have one."""


def workplane(shape: cq.Shape) -> cq.Workplane:
    """A shape to which others are added, and from which they are cut."""
    return cq.Workplane(_XY, obj=shape)


def box(x: Point, y: Point, z: Point) -> cq.Workplane:
    """A box from its three ranges."""
    size = (x[1] - x[0], y[1] - y[0], z[1] - z[0])
    return workplane(cq.Solid.makeBox(*size, cq.Vector(x[0], y[0], z[0])))


def both_sides(half: cq.Workplane) -> cq.Workplane:
    """A feature at y > 0 and its mirror image at y < 0."""
    return half.union(half.mirror("XZ"))


def prism_xz(outline: Sequence[Point], half_width: float) -> cq.Workplane:
    """A polygon in x and z, extruded to both sides of y = 0."""
    return cq.Workplane("XZ").polyline(list(outline)).close().extrude(half_width, both=True)


def cylinder(start: Vector, direction: Vector, radius: float, length: float) -> cq.Workplane:
    """A cylinder from the centre of its first face."""
    return workplane(
        cq.Solid.makeCylinder(radius, length, cq.Vector(*start), cq.Vector(*direction))
    )


def turned(shape: cq.Workplane, angle_deg: float, through: Vector) -> cq.Workplane:
    """A shape turned about the line through a point along y, from z toward x."""
    x, y, z = through
    return shape.rotate((x, y, z), (x, y + 1, z), angle_deg)


def one_solid(shape: cq.Workplane, name: str) -> cq.Solid:
    """The single solid of a shape; an OCCT boolean that failed in silence is caught here.

    Raises:
        WedgeError: the shape is empty, in pieces or not valid.
    """
    solids = [solid for solid in shape.solids().vals() if isinstance(solid, cq.Solid)]
    if len(solids) == 1 and solids[0].isValid() and solids[0].Volume() > 0:
        return solids[0]
    raise WedgeError(
        f"{name} came out as {len(solids)} bodies instead of one solid: change the dimensions"
        " nearest to it a little."
    )


def digits(text: str, height: float, stroke: float) -> list[tuple[Point, Point]]:
    """Rectangles (x range, y range) that draw hexadecimal digits, the first at the origin.

    A font of our own: fonts of the system would make the solid differ between machines.
    """
    width = 0.6 * height
    middle, reach = height / 2, stroke / 2
    rectangles = {
        "a": ((0, width), (height - stroke, height)),
        "b": ((width - stroke, width), (middle, height)),
        "c": ((width - stroke, width), (0, middle)),
        "d": ((0, width), (0, stroke)),
        "e": ((0, stroke), (0, middle)),
        "f": ((0, stroke), (middle, height)),
        "g": ((0, width), (middle - reach, middle + reach)),
    }
    drawn = []
    for index, character in enumerate(text):
        shift = index * (width + 2 * stroke)
        for segment in sorted(SEGMENTS[character]):
            (x0, x1), y = rectangles[segment]
            drawn.append(((x0 + shift, x1 + shift), (float(y[0]), float(y[1]))))
    return drawn


def digits_width(count: int, height: float, stroke: float) -> float:
    """Width of a line of digits."""
    return count * (0.6 * height + 2 * stroke) - 2 * stroke


def union_of(shapes: Iterable[cq.Workplane]) -> cq.Workplane:
    """All shapes in one."""
    first, *rest = [_shape(shape) for shape in shapes]
    return workplane(first.fuse(*rest))


def _shape(workplane: cq.Workplane) -> cq.Shape:
    shape = workplane.val()
    assert isinstance(shape, cq.Shape)
    return shape


def ellipsoid_cap(
    semi_axes: Vector, half_length: float, half_width: float, apex_z: float
) -> cq.Workplane:
    """The lowest part of an ellipsoid of revolution about x, its apex at (0, 0, apex_z).

    A narrow sector is revolved: booleans with the whole spheroid come out empty in OCCT. An
    ellipsoid with three different axes is made from it by stretching y.
    """
    along, across, normal = semi_axes
    reach_x, reach_y = half_length + 1.0, (half_width + 1.0) * normal / across
    start = math.degrees(math.asin(min(reach_x / along, 0.999)))
    sector = 2 * math.degrees(math.asin(min(reach_y / normal, 0.999)))
    top = -0.5 * normal * math.sqrt(1 - min(reach_x / along, 0.999) ** 2)
    cap = (
        cq.Workplane("XZ")
        .ellipseArc(along, normal, 270 - start, 270 + start, startAtCurrent=False)
        .lineTo(along * math.sin(math.radians(start)), top)
        .lineTo(-along * math.sin(math.radians(start)), top)
        .close()
        .revolve(sector, (0, 0, 0), (1, 0, 0))
    )
    box_of_cap = _shape(cap).BoundingBox()
    sign = -1 if box_of_cap.ymax > -box_of_cap.ymin else 1
    cap = cap.rotate((0, 0, 0), (1, 0, 0), sign * sector / 2)
    if abs(across - normal) > 1e-9:
        stretch = cq.Matrix([[1, 0, 0, 0], [0, across / normal, 0, 0], [0, 0, 1, 0]])
        cap = workplane(_shape(cap).transformGeometry(stretch))
    return cap.translate((0, 0, apex_z + normal))
