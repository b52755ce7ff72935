# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Every place in the body that more than one part must agree on, derived from the design.

Body frame in mm: x from the tip face to the base, y across, z = 0 on the acrylic's inner face.
"""

import math
from dataclasses import dataclass
from functools import cached_property

from cad.tables import Fastener, fastener
from sensor.design import Wedge

MIN_WALL = 0.8
TIP_POST = 1.8
"""Length of acrylic, from its tip end, that the case grips on both sides."""
BASE_POST = 1.2
"""The same at its base end."""
RIB = 0.9
"""Thickness of the ribs that hold the acrylic's corners at the base."""
FLANGE = 2.0
PLATE = 6.0
"""Thickness of the gripper adapters."""
PLATE_UNDER_HEAD = 3.0
CHANNEL = 2.0
"""Width and height of the wire channels, where there is room for them."""
BAFFLE_GAP = 0.25
"""Between the baffle and the lowest light that it must let pass."""
PIN_OUTWARD = 0.1
"""From the acrylic's side edge outward to the pins' middle."""
REAR_SCREW_LENGTH = 6.0
ROOF_SCREW_LENGTH = 8.0


@dataclass(frozen=True)
class LightRow:
    """One LED array: places along its side of the acrylic, x for a side and y for the base."""

    color: str
    centers: tuple[float, ...]
    board: tuple[float, float]
    """From the end of the flexible circuit to the end of its tail, where the wires are soldered."""


@dataclass(frozen=True)
class Layout:
    """Derived places of one design."""

    design: Wedge

    @property
    def slide(self) -> float:
        """Gap between sliding parts, per side."""
        return self.design.printing.sliding_clearance_mm

    @property
    def press(self) -> float:
        """Gap between pressed parts, per side."""
        return self.design.printing.press_clearance_mm

    @property
    def wall(self) -> float:
        """Outer wall of the case."""
        return self.design.housing.wall_mm

    @cached_property
    def screw(self) -> Fastener:
        """The size of every screw of the sensor."""
        return fastener(self.design.fastening.screw)

    # The acrylic and the lights around it.

    @property
    def acrylic_x0(self) -> float:
        """Tip end of the acrylic."""
        return self.design.acrylic.tip_offset_mm

    @property
    def acrylic_x1(self) -> float:
        """Base end of the acrylic."""
        return self.acrylic_x0 + self.design.acrylic.length_mm

    @property
    def acrylic_half(self) -> float:
        """Half the acrylic's width."""
        return self.design.acrylic.width_mm / 2

    @property
    def bottom(self) -> float:
        """Height (z) of the acrylic's outer face, flush with the case."""
        return -self.design.acrylic.thickness_mm

    @property
    def light_depth(self) -> float:
        """From the acrylic's edge to the back of an LED pocket."""
        lights = self.design.lights
        return lights.film_thickness_mm + lights.led_height_mm + lights.backing_thickness_mm

    @property
    def outer_half(self) -> float:
        """Half the case's width."""
        return self.design.outer_width_mm / 2

    @property
    def side_lights(self) -> tuple[float, float]:
        """Range of x along which light enters from the sides."""
        return self.acrylic_x0 + TIP_POST, self.acrylic_x1 - BASE_POST

    @property
    def rib_out(self) -> float:
        """How far the ribs at the acrylic's corners stand out from its edge."""
        return self.press + RIB

    @property
    def base_lights_half(self) -> float:
        """Half the y range along which light enters from the base."""
        return self.acrylic_half - BASE_POST

    def light_rows(self) -> list[LightRow]:
        """The arrays that have LEDs: red at y > 0, blue at y < 0, green at the base."""
        lights = self.design.lights
        low, high = self.side_lights
        middle, tail = (low + high) / 2, self.acrylic_x1 + self.light_depth - 0.7
        base_tail = self.acrylic_half + self.light_depth - 0.7
        rows = [
            self._row("red", lights.red_side_leds, middle, tail),
            self._row("blue", lights.blue_side_leds, middle, tail),
            self._row("green", lights.green_base_leds, 0.0, base_tail),
        ]
        return [row for row in rows if row.centers]

    def _row(self, color: str, count: int, middle: float, tail: float) -> LightRow:
        pitch, length = self.design.wiring.led_pitch_mm, self.design.lights.led_length_mm
        centers = tuple(middle + (index - (count - 1) / 2) * pitch for index in range(count))
        start = middle - (count - 1) / 2 * pitch - length / 2 - 0.2
        return LightRow(color, centers, (start, tail))

    @property
    def flex_z(self) -> tuple[float, float]:
        """Range of z of the flexible circuits."""
        return self.bottom + 0.2, -0.2

    @property
    def films(self) -> dict[str, float]:
        """Thickness of each film between LEDs and acrylic, from the acrylic outward."""
        lights = self.design.lights
        names = ["gray_filter"] if lights.gray_filter_transmission < 1 else []
        names += ["diffuser"] if lights.diffuser else []
        if not lights.film_thickness_mm:
            return {}
        return {name: lights.film_thickness_mm / len(names) for name in names}

    @property
    def film_ranges(self) -> dict[str, tuple[float, float]]:
        """Where films go: x range on the sides, y range on the base."""
        low, high = self.side_lights
        half = self.base_lights_half - 0.1
        return {"side": (low + 0.1, high - 0.1), "base": (-half, half)}

    @property
    def pin_places(self) -> list[tuple[float, float]]:
        """(x, y) of the pins that hold the acrylic at its tip."""
        x = self.acrylic_x0 + TIP_POST - MIN_WALL - self.pin_hole_radius - 0.05
        return [(x, sign * (self.acrylic_half + PIN_OUTWARD)) for sign in (-1.0, 1.0)]

    @property
    def pin_hole_radius(self) -> float:
        """Half in the acrylic's notch, half in the case."""
        return self.design.fastening.pin_diameter_mm / 2 + self.press

    # The mirror.

    @property
    def tilt(self) -> float:
        """Mirror angle in radians."""
        return math.radians(self.design.mirror.angle_deg)

    def mirror_z(self, x: float) -> float:
        """Height of the reflecting plane above x."""
        mirror = self.design.mirror
        return mirror.foot_height_mm + (x - mirror.foot_x_mm) * math.tan(self.tilt)

    def seat_z(self, x: float) -> float:
        """Height of the plane that the mirror's back lies on."""
        return self.mirror_z(x) + self.design.mirror.thickness_mm / math.cos(self.tilt)

    @property
    def mirror_x0(self) -> float:
        """Tip-most x of the mirror: the lower edge of its back."""
        mirror = self.design.mirror
        return mirror.foot_x_mm - mirror.thickness_mm * math.sin(self.tilt)

    @property
    def mirror_x1(self) -> float:
        """Base-most x of the mirror: the upper edge of its reflecting face."""
        mirror = self.design.mirror
        return mirror.foot_x_mm + mirror.length_mm * math.cos(self.tilt)

    @property
    def mirror_top(self) -> float:
        """Height of that edge."""
        return self.mirror_z(self.mirror_x1)

    @property
    def longest_mirror(self) -> float:
        """From its foot on, it is inserted through the window below it."""
        foot = self.design.mirror.foot_x_mm
        return (self.window_x1 - self.slide - foot) / math.cos(self.tilt)

    @property
    def roof(self) -> float:
        """Thickness of the roof over the mirror's seat."""
        design = self.design
        rise = design.housing.roof_z_mm - self.mirror_top
        return rise * math.cos(self.tilt) - design.mirror.thickness_mm

    @property
    def cavity_half(self) -> float:
        """Half the width of the space under the mirror."""
        return self.design.mirror.width_mm / 2 + self.slide

    @property
    def window_x0(self) -> float:
        """Tip end of the window through which the mirror goes in."""
        return self.mirror_x0 - self.slide

    @property
    def window_x1(self) -> float:
        """Base end of the window; the baffle stands behind it."""
        return self.acrylic_x1 - (self.acrylic_half - self.cavity_half)

    def baffle_z(self, x: float) -> float:
        """Top of the baffle: all light below the line from mirror foot to pupil is direct."""
        camera, mirror = self.design.camera, self.design.mirror
        slope = (camera.pupil_z_mm - mirror.foot_height_mm) / (camera.pupil_x_mm - mirror.foot_x_mm)
        return mirror.foot_height_mm + (x - mirror.foot_x_mm) * slope - BAFFLE_GAP

    # The camera, its holder and the tunnel that takes it.

    @property
    def pitch(self) -> float:
        """Camera pitch in radians."""
        return math.radians(self.design.camera.pitch_deg)

    @property
    def rear(self) -> float:
        """Place (x) of the case's back face."""
        return self.design.housing.case_length_mm

    @property
    def tunnel_x0(self) -> float:
        """Front of the tunnel, behind the wall of the base lights."""
        return self.acrylic_x1 + self.light_depth + MIN_WALL

    @property
    def socket_half(self) -> float:
        """Half the camera's square socket in the holder."""
        return self.design.camera.head_size_mm / 2 + self.press

    @property
    def widest_barrel(self) -> float:
        """Its holder keeps a rim that stops the camera's head."""
        return self.design.camera.head_size_mm - 0.8

    @property
    def plug_half(self) -> float:
        """Half the holder's width inside the tunnel."""
        return self.socket_half + MIN_WALL

    @property
    def tunnel_half(self) -> float:
        """Half the tunnel's width."""
        return self.plug_half + self.slide

    @property
    def plug_z(self) -> tuple[float, float]:
        """Bottom and top of the holder inside the tunnel, around the pitched socket."""
        camera = self.design.camera
        fall = (self.rear + FLANGE - camera.pupil_x_mm) * math.tan(self.pitch)
        half = self.socket_half / math.cos(self.pitch)
        low = camera.pupil_z_mm - half - max(fall, 0) - MIN_WALL
        return low, camera.pupil_z_mm + half + max(-fall, 0) + MIN_WALL

    @property
    def tunnel_z(self) -> tuple[float, float]:
        """Bottom and top of the tunnel: the holder lies on its floor, all play is above."""
        low, high = self.plug_z
        return low, high + 2 * self.slide

    @property
    def channel_y(self) -> tuple[float, float]:
        """Range of |y| of the wire channels."""
        outer = self.outer_half - self.wall
        inner = max(self.tunnel_half + MIN_WALL, self.acrylic_half + self.press + RIB)
        return max(inner, outer - CHANNEL), outer

    @property
    def channel_top(self) -> float:
        """Height (z) of the wire channels' top."""
        return self.bottom + CHANNEL

    # Screws.

    @property
    def screw_y(self) -> float:
        """|y| of every screw of the case."""
        return self.design.fastening.boss_pitch_mm / 2

    @property
    def rear_screw_z(self) -> float:
        """Height (z) of the screws that hold the camera holder."""
        return float(self.design.camera.pupil_z_mm)

    @property
    def rear_hole_depth(self) -> float:
        """One millimetre deeper than the screw reaches."""
        return REAR_SCREW_LENGTH - FLANGE + 1.0

    @property
    def roof_hole_depth(self) -> float:
        """One millimetre deeper than the screw reaches."""
        return ROOF_SCREW_LENGTH - PLATE_UNDER_HEAD + 1.0

    @property
    def roof_screw_x(self) -> tuple[float, float]:
        """Place (x) of the two rows of screws in the roof."""
        edge = MIN_WALL + self.screw.tap_mm / 2
        return self.tunnel_x0 + edge, self.rear - edge - 0.4

    @property
    def roof_flat_x0(self) -> float:
        """Where the sloped roof ends."""
        mirror = self.design.mirror
        return mirror.foot_x_mm + (self.mirror_top - mirror.foot_height_mm) / math.tan(self.tilt)

    @property
    def plate_x1(self) -> float:
        """Base end of the gripper adapter: it covers the compartment."""
        return self.cover_x0 + self.design.compartment.length_mm

    @property
    def cover_x0(self) -> float:
        """Front of the electronics cover, clear of the screw heads and of the cable's bend."""
        return self.rear + FLANGE + self.screw.head_height_mm + 2.0
