# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Where and how deep things are pressed, and the skin that results."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Final

import numpy as np

from sensor.design import Gel, Wedge
from sensor.errors import WedgeError
from simulation.indenters import Indenter, refuse_depth, refuse_size
from simulation.skin import Map, Skin, View, pressed, refuse_reach, rest_height_mm

BALL_DEPTHS: Final = (0.2, 0.42)
"""Shallowest and deepest press of a ball, of its radius."""
DEEPEST: Final = 0.4
"""Share of the gel's thickness that a press may take."""
MARGIN_MM: Final = 0.5
"""Between a contact and the pad's edge."""
PAINT_MM: Final = 0.03
"""Thickness of the paint, below which detail is lost."""
CORNERS: Final = {
    "top_left": (-1, -1),
    "top_right": (1, -1),
    "bottom_left": (-1, 1),
    "bottom_right": (1, 1),
}
"""Of the pad as a frame shows it, along x and y."""
HAIR_MM: Final = 1e-4
"""Over which the untouched skin's slope is told."""
DOT_RADIUS, DOT_PITCH, DOT_INK = 0.2, 1.5, 0.1
"""Markers: radius and pitch in mm, and the share of light they leave."""


@dataclass(frozen=True, kw_only=True)
class Press:
    """One object pressed at one place."""

    name: str
    indenter: Indenter
    center_mm: tuple[float, float]
    """On the skin, from the pad's centre."""
    depth_mm: float


def ball_presses(design: Wedge, ball: Indenter, count: int, seed: int) -> list[Press]:
    """Presses of a ball spread evenly over the pad, at random depths.

    Places follow the R2 sequence (additive recurrence by the plastic number), shifted at random.

    Raises:
        WedgeError: no presses are asked for, or the ball does not suit the pad.
    """
    if count < 1:
        raise WedgeError(f"--presses {count} must be at least 1.")
    refuse_size(ball, design.pad_size_mm)
    rng = np.random.default_rng(seed)
    radius = ball.size_mm[0] / 2
    shallow, deep = (share * radius for share in BALL_DEPTHS)
    reach = np.sqrt(2 * radius * deep - deep**2) + MARGIN_MM
    room = [size / 2 - reach for size in design.pad_size_mm]
    if min(room) <= 0:
        raise WedgeError(
            f"a ball of {radius:g} mm in radius leaves no room on the pad of "
            f"{design.pad_size_mm[0]:g} x {design.pad_size_mm[1]:g} mm: take a smaller ball."
        )
    plastic = 1.32471795724474602596
    steps = np.arange(1, count + 1)[:, None] * np.array([1 / plastic, 1 / plastic**2])
    places = (2 * ((rng.random(2) + steps) % 1) - 1) * room
    presses = []
    for index, (x, y) in enumerate(places):
        deepest = min(deep, DEEPEST * design.gel.thickness_at_mm(x, y))
        depth = rng.uniform(min(shallow, deepest / 2), deepest)
        presses.append(
            Press(name=f"ball_{index:02d}", indenter=ball, center_mm=(float(x), float(y)),
                  depth_mm=float(depth))
        )  # fmt: skip
    return presses


def placed_presses(design: Wedge, thing: Indenter, off_center: float = 0.0) -> list[Press]:
    """Presses of one thing: in the pad's middle, or one toward each of its corners.

    Args:
        design: the sensor.
        thing: pressed in as deep as it says.
        off_center: share of the room between the thing and the pad's border, along both axes, by
            which it is moved.

    Raises:
        WedgeError: the share is not from 0 to 1.
    """
    if not 0 <= off_center <= 1:
        raise WedgeError(f"--off-center {off_center:g} must be from 0 (middle) to 1 (border).")
    at = {f"_{name}": toward for name, toward in CORNERS.items()} if off_center else {"": (0, 0)}
    rooms_mm = [
        max(0.0, pad - size) / 2
        for pad, size in zip(design.pad_size_mm, thing.size_mm, strict=True)
    ]
    presses = []
    for name, toward in at.items():
        x_mm, y_mm = (
            off_center * room_mm * side for room_mm, side in zip(rooms_mm, toward, strict=True)
        )
        presses.append(
            Press(
                name=thing.name + name,
                indenter=thing,
                center_mm=(x_mm, y_mm),
                depth_mm=thing.depth_mm,
            )
        )
    return presses


def skin_under(design: Wedge, view: View, press: Press, *, cover_mm: float = 0.0) -> Skin:
    """The skin under a press; the object stands upright above the normal of its place.

    Args:
        design: the sensor.
        view: the pixels.
        press: object, place and depth.
        cover_mm: thickness of a glove over the paint.

    Raises:
        WedgeError: as ``reach_under``; or paint and glove hide all of the dent.
    """
    reach_mm = reach_under(design, view, press)
    with told_of(press):
        return pressed(view, design.gel, reach_mm, PAINT_MM + cover_mm)


def reach_under(design: Wedge, view: View, press: Press) -> Map:
    """How far the object of a press reaches below the untouched skin, in mm; quickly told.

    Raises:
        WedgeError: the object is larger than the pad, off it, without a height at a pixel or
            reaches the skin at none, or the depth is not finite, not positive, past a round
            object's middle or through the gel.
    """
    refuse_depth(press.indenter, press.depth_mm)
    refuse_size(press.indenter, design.pad_size_mm)
    _refuse_off_pad(design, press)
    x, y = view.grid_mm
    rest = rest_height_mm(design.gel, x, y)
    object_x, object_y, lowest = _placed(design, press)
    if lowest <= -design.gel.thickness_mm:
        raise WedgeError(
            f"{press.name}: a press of {press.depth_mm:g} mm goes through the gel, which is"
            f" {design.gel.thickness_at_mm(*press.center_mm):.3g} mm thick there: press less deep."
        )
    reach: Map = rest - lowest - press.indenter.profile(x - object_x, y - object_y)
    with told_of(press):
        refuse_reach(reach)
    return reach


def _refuse_off_pad(design: Wedge, press: Press) -> None:
    length_mm, width_mm = design.pad_size_mm
    x_mm, y_mm = press.center_mm
    if not (abs(x_mm) <= length_mm / 2 and abs(y_mm) <= width_mm / 2):
        raise WedgeError(
            f"{press.name}: its place ({x_mm:g}, {y_mm:g}) mm from the middle lies off the pad of "
            f"{length_mm:g} x {width_mm:g} mm: press on the pad."
        )


@contextmanager
def told_of(press: Press) -> Iterator[None]:
    """Let what cannot be be told of a press."""
    try:
        yield
    except WedgeError as error:
        raise WedgeError(f"{press.name}: {error}") from error


def _placed(design: Wedge, press: Press) -> tuple[float, float, float]:
    """Centre of the object in x and y, and z of its lowest point.

    An object with a round underside of radius R touches first where its normal is the skin's: its
    centre stands R - depth above the touched point, along the skin's normal.
    """
    x, y = press.center_mm
    height = rest_height_mm(design.gel, np.array(x), np.array(y))
    slope = np.array(rest_slope(design.gel, x, y))
    normal = np.array([-slope[0], -slope[1], 1]) / np.sqrt(1 + slope @ slope)
    radius = press.indenter.round_mm
    if not radius:
        return x, y, float(height - press.depth_mm)
    center = np.array([x, y, height]) + normal * (radius - press.depth_mm)
    lowest = center[2] - radius
    return float(center[0]), float(center[1]), float(lowest)


def rest_slope(gel: Gel, x_mm: float, y_mm: float) -> tuple[float, float]:
    """The untouched skin's slopes dz/dx and dz/dy at a place."""
    x, y = np.array([x_mm, x_mm + HAIR_MM, x_mm]), np.array([y_mm, y_mm, y_mm + HAIR_MM])
    height, *beside = rest_height_mm(gel, x, y)
    along_x, along_y = ((other - height) / HAIR_MM for other in beside)
    return float(along_x), float(along_y)


def contact_circle_px(skin: Skin) -> tuple[float, float, float]:
    """Centre and radius of the circle that fits a round contact: what a careful eye would label.

    Raises:
        WedgeError: no pixel shows a contact.
    """
    rows, columns = np.nonzero(skin.contact)
    if not len(rows):
        raise WedgeError("no pixel shows the contact: press deeper, or take a larger --width-px.")
    return (
        float(columns.mean()), float(rows.mean()), float(np.sqrt(len(rows) / np.pi))
    )  # fmt: skip


def marker_ink(view: View) -> Map:
    """Dots on a square lattice, as the share of light that the skin still reflects."""
    x, y = view.grid_mm
    from_dot = np.hypot(*((along + DOT_PITCH / 2) % DOT_PITCH - DOT_PITCH / 2 for along in (x, y)))
    edge = view.mm_per_px[0] / 2
    covered = np.clip((DOT_RADIUS + edge - from_dot) / (2 * edge), 0, 1)
    return 1 - (1 - DOT_INK) * covered
