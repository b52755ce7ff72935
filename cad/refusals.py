# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Designs that cannot be built or cannot see their pad are refused before anything is made."""

import math

import numpy as np

from cad import layout
from cad.layout import MIN_WALL, RIB, Layout
from cad.optics import keystone, mirror_plane, pad_grid, pixel_margin, trace
from sensor.design import Wedge
from sensor.errors import WedgeError

PIXEL_MARGIN = 10.0
"""Every point of the pad must lie this far inside the picture, in px."""
MIRROR_MARGIN = 0.2
"""Light must strike the mirror this far from its edges, in mm."""
_EPSILON = 1e-6


def refuse_unbuildable(design: Wedge) -> None:
    """Raise if the design cannot be printed, put together or seen through.

    Raises:
        WedgeError: names the field, its value and the bound it breaks.
    """
    place = Layout(design)
    _refuse_case(place)
    _refuse_lights(place)
    _refuse_camera(place)
    _refuse_screws(place)
    _refuse_view(place)


def _at_least(field: str, value: float, bound: float, why: str) -> None:
    if value < bound - _EPSILON:
        raise WedgeError(f"{field} = {value:g} must be at least {_up(bound)}: {why}.")


def _at_most(field: str, value: float, bound: float, why: str) -> None:
    if value > bound + _EPSILON:
        raise WedgeError(f"{field} = {value:g} must be at most {_down(bound)}: {why}.")


def _up(bound: float) -> str:
    return f"{math.ceil(bound * 1000 - 1e-3) / 1000:g}"


def _down(bound: float) -> str:
    return f"{math.floor(bound * 1000 + 1e-3) / 1000:g}"


def _refuse_case(place: Layout) -> None:
    design = place.design
    mirror, acrylic, housing = design.mirror, design.acrylic, design.housing
    _at_least(
        "acrylic.tip_offset_mm",
        acrylic.tip_offset_mm,
        MIN_WALL + place.press,
        "the tip's wall would be thinner than 0.8 mm",
    )
    needed = place.mirror_top + (mirror.thickness_mm + MIN_WALL) / math.cos(place.tilt)
    _at_least(
        "housing.roof_z_mm", housing.roof_z_mm, needed, "0.8 mm of roof must cover the mirror"
    )
    _at_most(
        "mirror.width_mm",
        mirror.width_mm,
        acrylic.width_mm - 1.2 - 2 * place.slide,
        "the acrylic needs a ledge of 0.6 mm on either side of the mirror's window",
    )
    _at_least(
        "mirror.foot_x_mm",
        mirror.foot_x_mm,
        place.acrylic_x0 + 0.8 + place.slide + mirror.thickness_mm * math.sin(place.tilt),
        "the acrylic needs a ledge of 0.8 mm at the tip",
    )
    # Over the tip the roof is as thick as the seat's plane is low.
    _at_most(
        "mirror.length_mm",
        mirror.length_mm,
        (place.window_x1 - place.slide - mirror.foot_x_mm) / math.cos(place.tilt),
        "the mirror must go in through the window under it",
    )
    pin = place.pin_hole_radius
    _at_most(
        "fastening.pin_diameter_mm",
        design.fastening.pin_diameter_mm,
        2 * (min(0.9, layout.TIP_POST - 0.9) - place.press),
        "its hole must stay inside the post that grips the acrylic's tip",
    )
    _at_most(
        "gel.pad_width_mm",
        design.gel.pad_width_mm,
        acrylic.width_mm + 0.2 - 2 * pin,
        "the pins' notches in the acrylic would reach into the pad",
    )


def _refuse_lights(place: Layout) -> None:
    lights, wiring = place.design.lights, place.design.wiring
    _at_least(
        "lights.backing_thickness_mm",
        lights.backing_thickness_mm,
        layout.FLEX + 0.05,
        "the LEDs' flexible circuit lies there",
    )
    _at_least(
        "lights.led_height_mm + film + backing",
        place.light_depth,
        place.press + RIB + 0.6,
        "wires must pass behind the ribs at the acrylic's corners",
    )
    _at_least(
        "acrylic.thickness_mm",
        place.design.acrylic.thickness_mm,
        max(lights.led_width_mm + 0.2, 2.7),
        "the LED arrays must fit beside the acrylic",
    )
    _at_least(
        "wiring.led_pitch_mm",
        wiring.led_pitch_mm,
        lights.led_length_mm + 0.25,
        "neighbouring LEDs would touch",
    )
    low, high = place.side_lights
    for side, count, room in (
        ("red_side", lights.red_side_leds, high - low),
        ("blue_side", lights.blue_side_leds, high - low),
        ("green_base", lights.green_base_leds, 2 * place.base_lights_half),
    ):
        most = int((room - 0.4 - lights.led_length_mm) / wiring.led_pitch_mm + _EPSILON) + 1
        _at_most(f"lights.{side}_leds", count, most if room > lights.led_length_mm + 0.4 else 0,
                 f"at a pitch of {wiring.led_pitch_mm:g} mm no more fit")  # fmt: skip
    for colour in ("red", "green", "blue"):
        _at_most(
            f"wiring.{colour}_forward_v",
            getattr(wiring, f"{colour}_forward_v"),
            wiring.supply_v - 0.1,
            f"the supply of {wiring.supply_v:g} V leaves nothing for a resistor",
        )


def _refuse_camera(place: Layout) -> None:
    camera, housing = place.design.camera, place.design.housing
    lean = place.socket_half * math.sin(abs(place.pitch))
    reach = camera.barrel_length_mm * math.cos(place.pitch)
    lean += camera.barrel_diameter_mm / 2 * 0
    _at_least(
        "camera.pupil_x_mm",
        camera.pupil_x_mm,
        place.tunnel_x0 + place.slide + max(MIN_WALL + lean, reach + lean),
        "the camera must stand behind the lights at the base, not over the pad",
    )
    depth = camera.head_depth_mm * math.cos(place.pitch) + lean
    _at_least(
        "housing.case_length_mm",
        housing.case_length_mm,
        camera.pupil_x_mm + depth,
        "the camera's head must lie inside the case",
    )
    low, high = place.tunnel_z
    _at_least(
        "camera.pupil_z_mm",
        camera.pupil_z_mm,
        camera.pupil_z_mm + place.bottom + MIN_WALL - low,
        "0.8 mm of case must remain under the camera holder",
    )
    _at_least(
        "housing.roof_z_mm",
        housing.roof_z_mm,
        max(high + MIN_WALL, place.plug_z[1] + 1.0),
        "0.8 mm of roof must cover the camera holder",
    )
    over_lights = place.baffle_z(place.window_x1) - MIN_WALL
    if over_lights < -_EPSILON:
        raise WedgeError(
            f"camera.pupil_z_mm = {camera.pupil_z_mm:g} is too low by"
            f" {-over_lights * 1.3:.2f} or more: less than 0.8 mm would cover the lights at the"
            " base."
        )
    _at_least(
        "camera.barrel_diameter_mm",
        camera.head_size_mm,
        camera.barrel_diameter_mm + 0.6,
        "the holder's front needs a rim around the lens: camera.head_size_mm",
    )


def _refuse_screws(place: Layout) -> None:
    pitch = place.design.fastening.boss_pitch_mm
    edge = MIN_WALL + place.screw.tap_mm / 2
    _at_least("fastening.boss_pitch_mm", pitch, 2 * (place.tunnel_half + edge),
              "0.8 mm must remain between the screws and the camera holder")  # fmt: skip
    _at_most("fastening.boss_pitch_mm", pitch, 2 * (place.outer_half - edge),
             "0.8 mm must remain between the screws and the outside")  # fmt: skip
    _at_least("camera.pupil_z_mm", place.rear_screw_z, place.channel_top + edge,
              "the holder's screws would meet the wire channels")  # fmt: skip
    _at_least(
        "housing.roof_z_mm",
        place.design.housing.roof_z_mm,
        place.rear_screw_z + edge + place.roof_hole_depth,
        "the screws in the roof would meet those of the camera holder",
    )
    inner, outer = place.channel_y
    _at_least("housing.wall_mm or acrylic.width_mm", outer - inner, 0.8,
              "the wire channel beside the camera holder is too narrow for wires")  # fmt: skip
    first, second = place.roof_screw_x
    _at_least("housing.case_length_mm", second - first, place.screw.head_diameter_mm + 1.5,
              "the two rows of screws in the roof need their room")  # fmt: skip
    _at_least("housing.case_length_mm", place.rear - place.rear_hole_depth,
              place.acrylic_x1 + place.light_depth + MIN_WALL,
              "the camera holder's screws would reach the LED pockets")  # fmt: skip


def _refuse_view(place: Layout) -> None:
    design = place.design
    camera, mirror = design.camera, design.mirror
    grid = pad_grid(design, 21)
    paths = trace(design, grid)
    normal, foot = mirror_plane(design)
    pupil = np.array([camera.pupil_x_mm, 0.0, camera.pupil_z_mm])
    _at_most("camera.pupil_z_mm", camera.pupil_z_mm,
             place.mirror_z(camera.pupil_x_mm) - 1.0 + 0 * float((pupil - foot) @ normal),
             "the camera must look at the mirror's front")  # fmt: skip
    along = (paths.mirror[:, 0] - mirror.foot_x_mm) / math.cos(place.tilt)
    _at_least("mirror.foot_x_mm", -mirror.foot_x_mm,
              -mirror.foot_x_mm + MIRROR_MARGIN - float(along.min()),
              "the tip of the pad would be seen below the mirror's foot")  # fmt: skip
    _at_least("mirror.length_mm", mirror.length_mm, float(along.max()) + MIRROR_MARGIN,
              "the base of the pad would be seen past the mirror's top")  # fmt: skip
    _at_least("mirror.width_mm", mirror.width_mm,
              2 * (float(np.abs(paths.mirror[:, 1]).max()) + MIRROR_MARGIN),
              "the sides of the pad would be seen past the mirror")  # fmt: skip
    window = paths.acrylic
    _at_most("gel.pad_width_mm", float(np.abs(window[:, 1]).max()), place.cavity_half - 0.1,
             "the light from its sides must pass between the ledges")  # fmt: skip
    _at_least("gel.pad_length_mm", float(window[:, 0].min()), place.window_x0 + 0.1,
              "the light from the tip must pass the ledge")  # fmt: skip
    _at_most("gel.pad_length_mm", float(window[:, 0].max()), place.window_x1 - 0.1,
             "the light from the base must pass the baffle")  # fmt: skip
    margin = pixel_margin(camera, paths.pixels)
    if margin < PIXEL_MARGIN:
        raise WedgeError(
            f"camera.diagonal_view_deg = {camera.diagonal_view_deg:g} shows the pad with a margin"
            f" of {margin:.1f} px; at least {PIXEL_MARGIN:g} px are needed: take a wider lens,"
            " another camera.pitch_deg or a smaller pad."
        )
    if not keystone(paths.pixels, 21) > 0.3:
        raise WedgeError(
            f"camera.pitch_deg = {camera.pitch_deg:g} shrinks the tip of the pad to"
            f" {keystone(paths.pixels, 21):.2f} of its base in the picture; at least 0.3 is needed."
        )
