# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Designs that cannot be built or cannot see their pad are refused before anything is made."""

import math

from cad.bounds import EPSILON, Bounds, Other
from cad.electronics.boards import LEAST_LED_LENGTH, LEAST_LED_WIDTH
from cad.electronics.resistors import (
    ADAPTER_MA,
    ADAPTER_V,
    LEAST_DROP_V,
    LEAST_OHM,
    RATED_W,
    ballasts,
    takes_adapters_supply,
)
from cad.layout import MIN_WALL, PIN_OUTWARD, Layout
from cad.parts.bought import compartment_height_mm, compartment_length_mm
from cad.parts.case import MARK_DEPTH
from cad.sight_refusals import refuse_view
from cad.wires import by_side, ribbon_bend_mm, rooms, thickest_wire_mm
from sensor.design import Wedge
from sensor.fabrication import FLEX_MM, SCREWS

BEND_THICKNESSES = 10.0
"""Least radius of the ribbon's bend: a common rule for a flexible circuit that is bent once."""
LEAST_FILM = 0.02
"""Thickness of all films together, in mm: no film is thinner."""
NOTCH_MARGIN = 0.05
"""The kerf must be this much narrower, in mm, than where it closes a pin's notch."""


def refuse_unbuildable(design: Wedge) -> None:
    """Raise if the design cannot be printed, put together or seen through.

    Raises:
        WedgeError: names the field, its value and the bound it breaks.
    """
    place = Layout(design)
    _refuse_mirror(place)
    _refuse_window(place)
    _refuse_lights(place)
    _refuse_currents(place)
    _refuse_camera(place)
    _refuse_screws(place)
    _refuse_compartment(place)
    _refuse_wires(place)
    refuse_view(place)


def _refuse_mirror(place: Layout) -> None:
    design, bounds = place.design, Bounds(place.design)
    mirror = design.mirror
    bounds.at_least(
        "housing.roof_z_mm",
        place.mirror_top + (mirror.thickness_mm + MIN_WALL) / math.cos(place.tilt),
        "0.8 mm of roof must cover the mirror",
    )
    bounds.at_most(
        "mirror.width_mm",
        design.acrylic.width_mm - 1.2 - 2 * place.slide,
        "the acrylic needs a ledge of 0.6 mm on either side of the window",
    )
    bounds.at_least(
        "mirror.foot_x_mm",
        place.acrylic_x0 + 0.8 + place.slide + mirror.thickness_mm * math.sin(place.tilt),
        "the acrylic needs a ledge of 0.8 mm at the tip",
    )
    bounds.at_most(
        "mirror.length_mm",
        place.longest_mirror,
        "the mirror, from foot_x_mm on, is inserted through the window below it",
    )


def _refuse_window(place: Layout) -> None:
    bounds = Bounds(place.design)
    pins_x0 = place.pin_places[0][0] - place.pin_hole_radius
    bounds.at_least(
        "acrylic.tip_offset_mm",
        max(MIN_WALL + place.press, MIN_WALL + place.acrylic_x0 - pins_x0),
        "the tip's wall would be thinner than 0.8 mm",
    )
    bounds.at_least(
        "housing.wall_mm",
        MIN_WALL + 0.1 + place.pin_hole_radius - place.light_depth,
        "0.8 mm of wall must remain outside the pins",
    )
    bounds.at_most(
        "gel.pad_width_mm",
        place.design.acrylic.width_mm + 0.2 - 2 * place.pin_hole_radius,
        "the pins' notches in the acrylic would reach into the pad",
    )
    # Grown by half the kerf g, the edge cuts the notch's circle while hole - g > g - outward.
    bounds.at_most(
        "laser.acrylic_kerf_mm",
        place.pin_hole_radius + PIN_OUTWARD - NOTCH_MARGIN,
        "a wider kerf closes the pins' notches in the acrylic",
    )


def _refuse_lights(place: Layout) -> None:
    bounds = Bounds(place.design)
    lights, wiring = place.design.lights, place.design.wiring
    bounds.at_least(
        "lights.backing_thickness_mm",
        FLEX_MM + 0.05,
        "it must hold the LEDs' flexible circuit",
    )
    if lights.gray_filter_transmission < 1 or lights.diffuser:
        bounds.at_least(
            "lights.film_thickness_mm",
            LEAST_FILM,
            "gray filter and diffuser are films; without them, set gray_filter_transmission to 1"
            " and diffuser to false",
        )
    other = lights.film_thickness_mm + lights.backing_thickness_mm
    bounds.at_least(
        "lights.led_height_mm",
        place.rib_out + 0.6 - other,
        "wires must pass behind the ribs at the acrylic's corners",
    )
    bounds.at_least(
        "acrylic.thickness_mm",
        max(lights.led_width_mm + 0.2, 2.7),
        "the LED arrays must fit beside the acrylic",
    )
    bounds.at_least(
        "wiring.led_pitch_mm",
        lights.led_length_mm + 0.25,
        "neighbouring LEDs would touch",
    )
    bounds.at_least(
        "lights.led_width_mm",
        LEAST_LED_WIDTH,
        "its solder pads would be less than 0.6 mm wide",
    )
    bounds.at_least(
        "lights.led_length_mm",
        LEAST_LED_LENGTH,
        "the tracks to its two ends would be too close together",
    )
    low, high = place.side_lights
    rooms = {
        "red_side": high - low,
        "blue_side": high - low,
        "green_base": 2 * place.base_lights_half,
    }
    for side, room in rooms.items():
        spare = room - 0.4 - lights.led_length_mm
        most = int(spare / wiring.led_pitch_mm + EPSILON) + 1 if spare >= -EPSILON else 0
        bounds.at_most(
            f"lights.{side}_leds",
            most,
            f"at a pitch of {wiring.led_pitch_mm:g} mm no more fit",
        )


def _refuse_currents(place: Layout) -> None:
    design, bounds = place.design, Bounds(place.design)
    wiring = design.wiring
    for color in ("red", "green", "blue"):
        bounds.at_most(
            f"wiring.{color}_forward_v",
            wiring.supply_v - LEAST_DROP_V,
            f"the supply of {wiring.supply_v:g} V would leave too little voltage for a resistor",
        )
    found = ballasts(design)
    arrays_ma = wiring.led_current_ma * sum(ballast.leds for ballast in found)
    if takes_adapters_supply(design) and arrays_ma > ADAPTER_MA:
        bounds.at_most(
            "wiring.led_current_ma",
            ADAPTER_MA * wiring.led_current_ma / arrays_ma,
            f"the adapter's {ADAPTER_V:g} V supply gives all arrays together {ADAPTER_MA:g} mA",
        )
    for ballast in found:
        if ballast.ohm < LEAST_OHM:
            bounds.at_most(
                "wiring.led_current_ma",
                1000 * (wiring.supply_v - ballast.forward_v) / LEAST_OHM / ballast.leds,
                f"the {ballast.color} array's resistor would have less than {LEAST_OHM:g} ohm",
            )
        if ballast.power_w > RATED_W:
            bounds.at_most(
                "wiring.led_current_ma",
                1000 * RATED_W / (wiring.supply_v - ballast.forward_v) / ballast.leds,
                f"the {ballast.color} array's resistor is rated for {RATED_W:g} W, and the supply"
                f" has {wiring.supply_v:g} V",
            )


def _refuse_camera(place: Layout) -> None:
    bounds, camera = Bounds(place.design), place.design.camera
    lean = place.socket_half * math.sin(abs(place.pitch))
    base = "lights at the base" if place.design.lights.green_base_leds else "acrylic's base"
    bounds.at_least(
        "camera.pupil_x_mm",
        place.tunnel_x0 + place.slide + max(MIN_WALL, camera.barrel_length_mm) + lean,
        f"the camera must stand behind the {base}, not over the pad",
    )
    bounds.at_least(
        "housing.case_length_mm",
        camera.pupil_x_mm + camera.head_depth_mm * math.cos(place.pitch) + lean,
        "the camera's head must lie inside the case",
    )
    low, high = place.tunnel_z
    most = _before_mirror(place)
    bounds.at_least(
        "camera.pupil_z_mm",
        camera.pupil_z_mm + place.bottom + MIN_WALL - low,
        "0.8 mm of case must remain under the camera holder",
        most,
    )
    bounds.at_least(
        "housing.roof_z_mm",
        max(high + MIN_WALL + MARK_DEPTH, place.plug_z[1] + 1.0),
        "0.8 mm of roof must cover the camera holder below the engraved mark",
    )
    reach = (place.window_x1 - place.design.mirror.foot_x_mm) / (
        camera.pupil_x_mm - place.design.mirror.foot_x_mm
    )
    bounds.at_least(
        "camera.pupil_z_mm",
        camera.pupil_z_mm + (MIN_WALL - place.baffle_z(place.window_x1)) / reach,
        f"0.8 mm of wall must fit over the {base}, below the light that the camera sees",
        most,
    )
    bounds.at_most(
        "camera.pupil_z_mm",
        most.bound,
        "the camera must look at the mirror's front",
    )
    bounds.at_most(
        "camera.barrel_diameter_mm",
        place.widest_barrel,
        "the holder's front needs a rim that stops the camera's head",
    )


def _before_mirror(place: Layout) -> Other:
    """Highest pupil."""
    bound = place.mirror_z(place.design.camera.pupil_x_mm) - 1.0
    return Other(
        bound,
        "to look at the mirror's front",
        "move the camera back, or take one with a smaller head",
    )


def _refuse_screws(place: Layout) -> None:
    bounds = Bounds(place.design)
    edge = MIN_WALL + place.screw.tap_mm / 2
    low, high = 2 * (place.tunnel_half + edge), 2 * (place.outer_half - edge)
    thinner = " or thinner screws" if place.screw.screw != SCREWS[0] else ""
    way_out = f"take a wider acrylic, a thicker wall{thinner}, or a smaller camera head"
    bounds.at_least(
        "fastening.boss_pitch_mm",
        low,
        "0.8 mm of wall must remain between the screws and the camera holder",
        Other(high, "to fit in the case", way_out),
    )
    bounds.at_most(
        "fastening.boss_pitch_mm",
        high,
        "0.8 mm of wall must remain between the screws and the outside",
        Other(low, "to clear the camera holder", way_out),
    )
    bounds.at_least(
        "camera.pupil_z_mm",
        place.channel_top + edge,
        "the holder's screws would run into the wire channels",
        _before_mirror(place),
    )
    bounds.at_least(
        "housing.roof_z_mm",
        place.rear_screw_z + edge + place.roof_hole_depth,
        "the screws in the roof would run into those of the camera holder",
    )
    lights = place.design.lights
    why = "the wire channels beside the camera holder must be 0.8 mm wide"
    # Beside the acrylic's ribs, where a wider acrylic moves both of a channel's walls...
    bounds.at_least(
        "lights.led_height_mm",
        place.rib_out + 0.8 - lights.film_thickness_mm - lights.backing_thickness_mm,
        why,
    )
    # ...and beside the tunnel.
    bounds.at_least(
        "acrylic.width_mm",
        2 * (place.tunnel_half + MIN_WALL + 0.8 - place.light_depth),
        why,
    )
    first, second = place.roof_screw_x
    bounds.at_least(
        "housing.case_length_mm",
        place.rear + place.screw.head_diameter_mm + 1.5 - (second - first),
        "the two rows of screws in the roof need more room between them",
    )
    bounds.at_least(
        "housing.case_length_mm",
        place.acrylic_x1 + place.light_depth + MIN_WALL + place.rear_hole_depth,
        "the camera holder's screws would reach the light pockets",
    )


def _refuse_compartment(place: Layout) -> None:
    bounds = Bounds(place.design)
    bounds.at_least(
        "compartment.height_mm",
        compartment_height_mm(),
        "it must hold the boards and the plug on top of each other",
    )
    bounds.at_most(
        "compartment.height_mm",
        place.design.total_thickness_mm,
        "the electronics cover would stick out past the gel and touch objects first",
    )
    bounds.at_least(
        "compartment.length_mm",
        compartment_length_mm(),
        "it must hold the boards behind the space in which the wires bend",
    )


def _refuse_wires(place: Layout) -> None:
    bounds = Bounds(place.design)
    for count in by_side({row.color: 2 for row in place.light_rows()}).values():
        for name, room in rooms(place).items():
            bounds.at_most(
                "wiring.wire_diameter_mm",
                thickest_wire_mm(room, count),
                f"{count} wires pass through the {name}",
            )
    bounds.at_most(
        "wiring.ribbon_width_mm",
        2 * place.socket_half,
        "the ribbon must pass through the camera's socket",
    )
    bounds.at_most(
        "wiring.ribbon_thickness_mm",
        ribbon_bend_mm(place) / BEND_THICKNESSES,
        "its bend between camera holder and cover would be too tight",
    )
