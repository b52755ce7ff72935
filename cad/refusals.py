# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Designs that cannot be built or cannot see their pad are refused before anything is made."""

import math

import numpy as np

from cad.electronics.boards import LEAST_LED_LENGTH, LEAST_LED_WIDTH
from cad.layout import FLEX, MIN_WALL, PIN_OUTWARD, Layout
from cad.optics import Paths, faulty_pictures, keystone, pad_grid, pixel_margin, trace
from cad.parts.bought import compartment_height_mm, compartment_length_mm
from cad.wires import by_side, ribbon_bend_mm, rooms, thickest_wire_mm
from sensor.design import Wedge
from sensor.errors import WedgeError

PIXEL_MARGIN = 10.0
"""Every point of the pad must lie this far inside the picture, in px."""
KEYSTONE = 0.3
"""The tip edge of the pad must be seen at least this wide, relative to its base edge."""
BEND_THICKNESSES = 10.0
"""Least radius of the ribbon's bend: a common rule for a flexible circuit that is bent once."""
NOTCH_MARGIN = 0.05
"""The kerf must be this much narrower, in mm, than where it closes a pin's notch."""
MIRROR_MARGIN = 0.2
"""Light must strike the mirror this far from its edges, in mm."""
_LIGHT_MARGIN = 0.1
_EPSILON = 1e-6


def refuse_unbuildable(design: Wedge) -> None:
    """Raise if the design cannot be printed, put together or seen through.

    Raises:
        WedgeError: names the field, its value and the bound it breaks.
    """
    place = Layout(design)
    _refuse_mirror(place)
    _refuse_window(place)
    _refuse_lights(place)
    _refuse_camera(place)
    _refuse_screws(place)
    _refuse_compartment(place)
    _refuse_wires(place)
    _refuse_view(place)


def _at_least(field: str, value: float, bound: float, why: str) -> None:
    if value < bound - _EPSILON:
        shown = math.ceil(bound * 1000 - 1e-3) / 1000
        raise WedgeError(f"{field} = {value:g} must be at least {shown:g}: {why}.")


def _at_most(field: str, value: float, bound: float, why: str) -> None:
    if value > bound + _EPSILON:
        shown = math.floor(bound * 1000 + 1e-3) / 1000
        raise WedgeError(f"{field} = {value:g} must be at most {shown:g}: {why}.")


def _refuse_mirror(place: Layout) -> None:
    design = place.design
    mirror, acrylic, roof_z = design.mirror, design.acrylic, design.housing.roof_z_mm
    cosine = math.cos(place.tilt)
    _at_least(
        "housing.roof_z_mm",
        roof_z,
        place.mirror_top + (mirror.thickness_mm + MIN_WALL) / cosine,
        "0.8 mm of roof must cover the mirror",
    )
    _at_most(
        "mirror.width_mm",
        mirror.width_mm,
        acrylic.width_mm - 1.2 - 2 * place.slide,
        "the acrylic needs a ledge of 0.6 mm on either side of the window",
    )
    _at_least(
        "mirror.foot_x_mm",
        mirror.foot_x_mm,
        place.acrylic_x0 + 0.8 + place.slide + mirror.thickness_mm * math.sin(place.tilt),
        "the acrylic needs a ledge of 0.8 mm at the tip",
    )
    _at_most(
        "mirror.length_mm",
        mirror.length_mm,
        (place.window_x1 - place.slide - mirror.foot_x_mm) / cosine,
        "the mirror must go in through the window under it",
    )


def _refuse_window(place: Layout) -> None:
    design = place.design
    _at_least(
        "acrylic.tip_offset_mm",
        design.acrylic.tip_offset_mm,
        max(MIN_WALL + place.press, MIN_WALL + place.acrylic_x0 - _pin_reach(place)),
        "the tip's wall would be thinner than 0.8 mm",
    )
    _at_least(
        "housing.wall_mm",
        place.wall,
        MIN_WALL + 0.1 + place.pin_hole_radius - place.light_depth,
        "0.8 mm must remain outside the pins",
    )
    _at_most(
        "gel.pad_width_mm",
        design.gel.pad_width_mm,
        design.acrylic.width_mm + 0.2 - 2 * place.pin_hole_radius,
        "the pins' notches in the acrylic would reach into the pad",
    )
    # Grown by half the kerf g, the edge cuts the notch's circle while hole - g > g - outward.
    _at_most(
        "laser.acrylic_kerf_mm",
        design.laser.acrylic_kerf_mm,
        place.pin_hole_radius + PIN_OUTWARD - NOTCH_MARGIN,
        "a wider cut closes the pins' notches in the acrylic",
    )


def _pin_reach(place: Layout) -> float:
    """Tip-most x of the pins' holes."""
    return place.pin_places[0][0] - place.pin_hole_radius


def _refuse_lights(place: Layout) -> None:
    design = place.design
    lights, wiring = design.lights, design.wiring
    _at_least(
        "lights.backing_thickness_mm",
        lights.backing_thickness_mm,
        FLEX + 0.05,
        "the LEDs' flexible circuit lies there",
    )
    other = lights.film_thickness_mm + lights.backing_thickness_mm
    _at_least(
        "lights.led_height_mm",
        lights.led_height_mm,
        place.rib_out + 0.6 - other,
        "wires must pass behind the ribs at the acrylic's corners",
    )
    _at_least(
        "acrylic.thickness_mm",
        design.acrylic.thickness_mm,
        max(lights.led_width_mm + 0.2, 2.7),
        "the LED arrays must fit beside the acrylic",
    )
    _at_least(
        "wiring.led_pitch_mm",
        wiring.led_pitch_mm,
        lights.led_length_mm + 0.25,
        "neighbouring LEDs would touch",
    )
    _at_least(
        "lights.led_width_mm",
        lights.led_width_mm,
        LEAST_LED_WIDTH,
        "its solder pads would be less than 0.6 mm wide",
    )
    _at_least(
        "lights.led_length_mm",
        lights.led_length_mm,
        LEAST_LED_LENGTH,
        "the tracks to its two ends would lie too close",
    )
    low, high = place.side_lights
    rooms = {
        "red_side": high - low,
        "blue_side": high - low,
        "green_base": 2 * place.base_lights_half,
    }
    for side, room in rooms.items():
        spare = room - 0.4 - lights.led_length_mm
        most = int(spare / wiring.led_pitch_mm + _EPSILON) + 1 if spare >= -_EPSILON else 0
        _at_most(
            f"lights.{side}_leds",
            getattr(lights, f"{side}_leds"),
            most,
            f"at a pitch of {wiring.led_pitch_mm:g} mm no more fit",
        )
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
    _at_least(
        "camera.pupil_x_mm",
        camera.pupil_x_mm,
        place.tunnel_x0 + place.slide + max(MIN_WALL, camera.barrel_length_mm) + lean,
        "the camera must stand behind the lights at the base, not over the pad",
    )
    _at_least(
        "housing.case_length_mm",
        housing.case_length_mm,
        camera.pupil_x_mm + camera.head_depth_mm * math.cos(place.pitch) + lean,
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
    reach = (place.window_x1 - place.design.mirror.foot_x_mm) / (
        camera.pupil_x_mm - place.design.mirror.foot_x_mm
    )
    _at_least(
        "camera.pupil_z_mm",
        camera.pupil_z_mm,
        camera.pupil_z_mm + (MIN_WALL - place.baffle_z(place.window_x1)) / reach,
        "0.8 mm must cover the lights at the base, below the light that the camera sees",
    )
    _at_most(
        "camera.pupil_z_mm",
        camera.pupil_z_mm,
        place.mirror_z(camera.pupil_x_mm) - 1.0,
        "the camera must look at the mirror's front",
    )
    _at_most(
        "camera.barrel_diameter_mm",
        camera.barrel_diameter_mm,
        camera.head_size_mm - 0.8,
        "the holder's front needs a rim that stops the camera's head",
    )


def _refuse_screws(place: Layout) -> None:
    housing, pitch = place.design.housing, place.design.fastening.boss_pitch_mm
    edge = MIN_WALL + place.screw.tap_mm / 2
    _at_least(
        "fastening.boss_pitch_mm",
        pitch,
        2 * (place.tunnel_half + edge),
        "0.8 mm must remain between the screws and the camera holder",
    )
    _at_most(
        "fastening.boss_pitch_mm",
        pitch,
        2 * (place.outer_half - edge),
        "0.8 mm must remain between the screws and the outside",
    )
    _at_least(
        "camera.pupil_z_mm",
        place.rear_screw_z,
        place.channel_top + edge,
        "the holder's screws would meet the wire channels",
    )
    _at_least(
        "housing.roof_z_mm",
        housing.roof_z_mm,
        place.rear_screw_z + edge + place.roof_hole_depth,
        "the screws in the roof would meet those of the camera holder",
    )
    inner, outer = place.channel_y
    _at_least(
        "acrylic.width_mm",
        place.design.acrylic.width_mm,
        place.design.acrylic.width_mm + 2 * (0.8 - (outer - inner)),
        "the wire channels beside the camera holder must be 0.8 mm wide",
    )
    first, second = place.roof_screw_x
    _at_least(
        "housing.case_length_mm",
        housing.case_length_mm,
        housing.case_length_mm + place.screw.head_diameter_mm + 1.5 - (second - first),
        "the two rows of screws in the roof need their room",
    )
    _at_least(
        "housing.case_length_mm",
        housing.case_length_mm,
        place.acrylic_x1 + place.light_depth + MIN_WALL + place.rear_hole_depth,
        "the camera holder's screws would reach the light pockets",
    )


def _refuse_compartment(place: Layout) -> None:
    _at_least(
        "compartment.height_mm",
        place.design.compartment.height_mm,
        compartment_height_mm(place),
        "the boards and the plug lie in it on top of each other",
    )
    _at_least(
        "compartment.length_mm",
        place.design.compartment.length_mm,
        compartment_length_mm(),
        "the plug lies in it behind the resistor board",
    )


def _refuse_wires(place: Layout) -> None:
    wiring = place.design.wiring
    for count in by_side({row.colour: 2 for row in place.light_rows()}).values():
        for name, room in rooms(place).items():
            _at_most(
                "wiring.wire_diameter_mm",
                wiring.wire_diameter_mm,
                thickest_wire_mm(room, count),
                f"{count} wires pass through the {name}",
            )
    _at_most(
        "wiring.ribbon_width_mm",
        wiring.ribbon_width_mm,
        2 * place.socket_half,
        "the ribbon leaves through the camera's socket",
    )
    _at_most(
        "wiring.ribbon_thickness_mm",
        wiring.ribbon_thickness_mm,
        ribbon_bend_mm(place) / BEND_THICKNESSES,
        "its bend between camera holder and cover would be too tight",
    )


def _refuse_view(place: Layout) -> None:
    design = place.design
    camera = design.camera
    paths = trace(design, pad_grid(design, 21))
    _refuse_missed_mirror(place, paths)
    _refuse_blocked_window(place, paths)
    margin = pixel_margin(camera, paths.pixels)
    if not margin >= PIXEL_MARGIN:
        raise WedgeError(
            f"camera.diagonal_view_deg = {camera.diagonal_view_deg:g} shows the pad with a margin"
            f" of {margin:.1f} px, which must be at least {PIXEL_MARGIN:g}: take a wider lens,"
            " another camera.pitch_deg or a smaller pad."
        )
    worst = min(faulty_pictures(design), key=lambda fault: fault.margin_px)
    if not worst.margin_px >= 0:
        raise WedgeError(
            f"camera.diagonal_view_deg = {camera.diagonal_view_deg:g} leaves the pad a margin of"
            f" {worst.margin_px:.1f} px with {worst.name}, which must be at least 0: take a wider"
            " lens or a smaller pad."
        )
    narrowing = keystone(paths.pixels, 21)
    if not narrowing >= KEYSTONE:
        raise WedgeError(
            f"camera.pitch_deg = {camera.pitch_deg:g} shrinks the tip of the pad in the picture to"
            f" {narrowing:.2f} of its base, which must be at least {KEYSTONE:g}."
        )


def _refuse_missed_mirror(place: Layout, paths: Paths) -> None:
    mirror = place.design.mirror
    along = (paths.mirror[:, 0] - mirror.foot_x_mm) / math.cos(place.tilt)
    _at_most(
        "mirror.foot_x_mm",
        mirror.foot_x_mm,
        mirror.foot_x_mm - MIRROR_MARGIN + float(along.min()),
        "the tip of the pad would be seen below the mirror's foot",
    )
    _at_least(
        "mirror.length_mm",
        mirror.length_mm,
        float(along.max()) + MIRROR_MARGIN,
        "the base of the pad would be seen past the mirror's top",
    )
    _at_least(
        "mirror.width_mm",
        mirror.width_mm,
        2 * (float(np.abs(paths.mirror[:, 1]).max()) + MIRROR_MARGIN),
        "the sides of the pad would be seen past the mirror",
    )


def _refuse_blocked_window(place: Layout, paths: Paths) -> None:
    """Light must pass between the ledges, and on its way up past the baffle's face."""
    gel, glass = place.design.gel, paths.acrylic
    across = float(np.abs(glass[:, 1]).max()) + _LIGHT_MARGIN
    _at_most(
        "gel.pad_width_mm",
        gel.pad_width_mm,
        gel.pad_width_mm - 2 * (across - place.cavity_half),
        "the light from its sides must pass between the ledges",
    )
    short = place.window_x0 + _LIGHT_MARGIN - float(glass[:, 0].min())
    beyond = np.maximum(glass[:, 0], paths.mirror[:, 0]).max()
    short = max(short, float(beyond) + _LIGHT_MARGIN - place.window_x1)
    _at_most(
        "gel.pad_length_mm",
        gel.pad_length_mm,
        gel.pad_length_mm - 2 * short,
        "the light from its ends must pass the ledge at the tip and the baffle at the base",
    )
