# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""The sensor, described once, in millimetres and degrees.

Coordinates of the body: x from the tip face to the base, y across the finger, z = 0 on the
acrylic face that looks at the mirror, z positive toward the mirror. The gel frame, in which
images, gradients and depth live, is another one: see ``docs/concepts/frames.md``.
"""

import hashlib
import json
import math
from dataclasses import dataclass, fields
from typing import Literal

from sensor.errors import WedgeError
from sensor.fabrication import (
    CO2_LASER,
    CSI_SUPPLY,
    DESKTOP_PRINTER,
    LAB_COMPARTMENT,
    Compartment,
    Fastening,
    Laser,
    Printing,
    Wiring,
    m2_fastening,
)
from sensor.marked import Bounded, bounded, chosen, datasheet, measured, paper

Channel = Literal["R", "G", "B"]


@dataclass(frozen=True, kw_only=True)
class Gel(Bounded):
    """The soft pad: an ellipsoid's cap (or a flat slab) of clear silicone under gray paint."""

    pad_length_mm: float = bounded(5, 80)
    pad_width_mm: float = bounded(4, 60)
    thickness_mm: float = bounded(0.5, 10)
    """Thickness at the centre of the pad."""
    curved: bool
    """False casts a flat slab; the semi-axes are then unused."""
    semi_axis_across_mm: float = bounded(10, 1000)
    semi_axis_normal_mm: float = bounded(10, 1000)
    semi_axis_along_mm: float = bounded(10, 1000)
    """The paper says a = b = 60 mm, c = 100 mm but not which is which: c lies along the finger."""
    refractive_index: float = bounded(1.0, 2.0)

    def __post_init__(self) -> None:
        """Check that the pad lies on the ellipsoid and is nowhere thinner than 0.3 mm."""
        super().__post_init__()
        if self.curved and self._radicand(self.pad_length_mm / 2, self.pad_width_mm / 2) <= 0:
            raise WedgeError(
                f"gel.pad_length_mm = {self.pad_length_mm:g} and gel.pad_width_mm = "
                f"{self.pad_width_mm:g} reach beyond the gel's ellipsoid: shrink the pad."
            )
        if self.corner_thickness_mm < 0.3:
            raise WedgeError(
                f"gel.thickness_mm = {self.thickness_mm:g} leaves {self.corner_thickness_mm:.2f} mm"
                " of gel at the corners of the pad; at least 0.3 mm must remain."
            )

    def thickness_at_mm(self, x_mm: float, y_mm: float) -> float:
        """Gel thickness at a point of the pad, measured from the pad's centre."""
        if not self.curved:
            return self.thickness_mm
        sag = self.semi_axis_normal_mm * (1 - math.sqrt(self._radicand(x_mm, y_mm)))
        return self.thickness_mm - sag

    @property
    def corner_thickness_mm(self) -> float:
        """Gel thickness at the corners of the pad, where a curved gel is thinnest."""
        return self.thickness_at_mm(self.pad_length_mm / 2, self.pad_width_mm / 2)

    def _radicand(self, x_mm: float, y_mm: float) -> float:
        return 1 - (x_mm / self.semi_axis_along_mm) ** 2 - (y_mm / self.semi_axis_across_mm) ** 2


@dataclass(frozen=True, kw_only=True)
class Acrylic(Bounded):
    """The clear block that carries the gel and guides the light of its three lit sides."""

    length_mm: float = bounded(6, 100)
    width_mm: float = bounded(5, 80)
    thickness_mm: float = bounded(1, 12)
    tip_offset_mm: float = bounded(0.5, 5)
    """From the tip face of the case to the block."""
    refractive_index: float = bounded(1.3, 1.8)


@dataclass(frozen=True, kw_only=True)
class Mirror(Bounded):
    """The front-surface mirror that folds the view of the pad into the camera."""

    angle_deg: float = bounded(20, 40)
    foot_x_mm: float = bounded(0.5, 20)
    foot_height_mm: float = bounded(0.1, 5)
    """Height of the reflecting face above the acrylic at the mirror's foot."""
    length_mm: float = bounded(5, 100)
    width_mm: float = bounded(4, 80)
    thickness_mm: float = bounded(0.5, 4)


@dataclass(frozen=True, kw_only=True)
class Camera(Bounded):
    """The Raspberry Pi mini camera: its place, its lens and its picture."""

    pupil_x_mm: float = bounded(5, 150)
    pupil_z_mm: float = bounded(0, 60)
    pitch_deg: float = bounded(-20, 40)
    diagonal_view_deg: float = bounded(40, 170)
    projection: Literal["equidistant", "pinhole"]
    width_px: int = bounded(64, 4096)
    height_px: int = bounded(48, 4096)
    frames_per_second: float = bounded(1, 240)
    head_size_mm: float = bounded(4, 30)
    """Side of the square camera head."""
    head_depth_mm: float = bounded(2, 30)
    """Behind the pupil; the lens barrel stands out in front of it."""
    barrel_diameter_mm: float = bounded(1, 30)
    barrel_length_mm: float = bounded(0.2, 10)

    def __post_init__(self) -> None:
        """Check the projection's name."""
        super().__post_init__()
        if self.projection not in ("equidistant", "pinhole"):
            raise WedgeError(
                f"camera.projection = {self.projection!r} must be 'equidistant' or 'pinhole'."
            )

    @property
    def focal_length_px(self) -> float:
        """Focal length at the picture's centre: pixels per radian, or per unit of tangent."""
        half_diagonal_px = math.hypot(self.width_px, self.height_px) / 2
        half_view = math.radians(self.diagonal_view_deg / 2)
        if self.projection == "equidistant":
            return half_diagonal_px / half_view
        return half_diagonal_px / math.tan(half_view)


@dataclass(frozen=True, kw_only=True)
class Lights(Bounded):
    """LED arrays on three sides of the acrylic, none at the tip."""

    red_side_leds: int = bounded(0, 40)
    blue_side_leds: int = bounded(0, 40)
    green_base_leds: int = bounded(0, 40)
    led_length_mm: float = bounded(0.5, 10)
    led_width_mm: float = bounded(0.5, 10)
    led_height_mm: float = bounded(0.2, 5)
    film_thickness_mm: float = bounded(0, 2)
    """Gray filter and diffuser together, between LED and acrylic."""
    backing_thickness_mm: float = bounded(0, 3)
    """Tape and wires behind the LEDs."""
    gray_filter_transmission: float = bounded(0.01, 1)
    """Of one pass; internal reflections pass twice. 1 means no gray filter."""
    diffuser: bool

    @property
    def azimuths_deg(self) -> dict[Channel, float]:
        """The azimuth each lit colour comes from, in the gel frame (x to the tip, y down)."""
        counts: dict[Channel, tuple[int, float]] = {
            "R": (self.red_side_leds, 90.0),
            "G": (self.green_base_leds, 180.0),
            "B": (self.blue_side_leds, -90.0),
        }
        return {channel: azimuth for channel, (count, azimuth) in counts.items() if count}


@dataclass(frozen=True, kw_only=True)
class Housing(Bounded):
    """The printed case."""

    wall_mm: float = bounded(0.8, 5)
    case_length_mm: float = bounded(10, 150)
    roof_z_mm: float = bounded(3, 60)
    """Height of the case's outer top above the acrylic's inner face."""


@dataclass(frozen=True, kw_only=True)
class Wedge:
    """One sensor design; derived values are properties, never stored."""

    name: str
    gel: Gel
    acrylic: Acrylic
    mirror: Mirror
    camera: Camera
    lights: Lights
    housing: Housing
    printing: Printing
    laser: Laser
    fastening: Fastening
    wiring: Wiring
    compartment: Compartment

    def __post_init__(self) -> None:
        """Check what must hold between the parts.

        Raises:
            WedgeError: names the fields and the bound that fails.
        """
        for field, part, whole in (
            ("gel.pad_length_mm", self.gel.pad_length_mm, self.acrylic.length_mm),
            ("gel.pad_width_mm", self.gel.pad_width_mm, self.acrylic.width_mm),
        ):
            if part > whole:
                other = field.replace("gel.pad_", "acrylic.")
                raise WedgeError(
                    f"{field} = {part:g} is larger than {other} = {whole:g}: the gel must fit on"
                    " the acrylic."
                )
        if self.lights.led_width_mm > self.acrylic.thickness_mm:
            raise WedgeError(
                f"lights.led_width_mm = {self.lights.led_width_mm:g} is larger than "
                f"acrylic.thickness_mm = {self.acrylic.thickness_mm:g}: part of the light would"
                " miss it."
            )
        for name, count, side_mm in self._light_rows():
            if count * self.lights.led_length_mm > side_mm:
                raise WedgeError(
                    f"lights.{name} = {count} LEDs of {self.lights.led_length_mm:g} mm do not fit"
                    f" on a side of {side_mm:g} mm: take fewer."  # how many, the pitch tells
                )
        if not self.lights.azimuths_deg:
            raise WedgeError("lights has no LED on any side: set the count of at least one side.")

    def _light_rows(self) -> tuple[tuple[str, int, float], ...]:
        return (
            ("red_side_leds", self.lights.red_side_leds, self.acrylic.length_mm),
            ("blue_side_leds", self.lights.blue_side_leds, self.acrylic.length_mm),
            ("green_base_leds", self.lights.green_base_leds, self.acrylic.width_mm),
        )

    @property
    def outer_width_mm(self) -> float:
        """Width of the finger: acrylic, and on both sides films, LEDs, backing and wall."""
        lights = self.lights
        side = lights.film_thickness_mm + lights.led_height_mm + lights.backing_thickness_mm
        return self.acrylic.width_mm + 2 * (side + self.housing.wall_mm)

    @property
    def pin_length_mm(self) -> float:
        """Of the two pins that hold the window: a little shorter than the acrylic is thick."""
        return self.acrylic.thickness_mm - 0.5

    @property
    def total_thickness_mm(self) -> float:
        """From the apex of the gel to the top of the case."""
        return self.gel.thickness_mm + self.acrylic.thickness_mm + self.housing.roof_z_mm

    @property
    def pad_size_mm(self) -> tuple[float, float]:
        """Sensed pad, along x and y of the gel frame."""
        return self.gel.pad_length_mm, self.gel.pad_width_mm

    @property
    def sha256(self) -> str:
        """Hash of every number of the design; the name is not part of it."""
        numbers = {
            part.name: _numbers(getattr(self, part.name))
            for part in fields(self)
            if part.name != "name"
        }
        text = json.dumps(numbers, sort_keys=True, default=float)
        return hashlib.sha256(text.encode()).hexdigest()


def _numbers(part: Bounded) -> dict[str, object]:
    """What a part's fields hold; 3 is 3.0 and -0.0 is 0.0, as equal designs have one hash."""
    held = ((item.name, item.type, getattr(part, item.name)) for item in fields(part))
    return {name: value + 0.0 if kind is float else value for name, kind, value in held}


STANDARD = Wedge(
    name="standard",
    gel=Gel(
        pad_length_mm=chosen(34.0),  # of a 35 x 25.5 mm window measured on a lab's unit
        pad_width_mm=measured(25.5),
        thickness_mm=chosen(3.5),
        curved=True,
        semi_axis_across_mm=paper(60.0),
        semi_axis_normal_mm=paper(60.0),
        semi_axis_along_mm=paper(100.0),
        refractive_index=datasheet(1.41),  # PDMS at 550-600 nm
    ),
    acrylic=Acrylic(
        length_mm=chosen(36.0),
        width_mm=measured(27.0),  # makes the 34.0 mm of a lab's case
        thickness_mm=paper(4.5),
        tip_offset_mm=chosen(1.2),
        refractive_index=datasheet(1.49),
    ),
    mirror=Mirror(
        angle_deg=paper(30.0),
        foot_x_mm=chosen(4.4),
        foot_height_mm=chosen(0.3),
        length_mm=chosen(32.6),
        width_mm=chosen(25.0),
        thickness_mm=chosen(1.0),
    ),
    camera=Camera(
        pupil_x_mm=chosen(42.5),
        pupil_z_mm=chosen(7.0),
        pitch_deg=chosen(8.0),
        diagonal_view_deg=paper(120.0),  # the paper does not say "diagonal"
        projection="equidistant",
        width_px=paper(640),
        height_px=paper(480),
        frames_per_second=paper(60.0),
        head_size_mm=chosen(8.6),  # no sheet found: measure yours
        head_depth_mm=chosen(4.2),
        barrel_diameter_mm=chosen(7.0),
        barrel_length_mm=chosen(1.0),
    ),
    lights=Lights(
        red_side_leds=chosen(7),
        blue_side_leds=chosen(7),
        green_base_leds=chosen(5),
        led_length_mm=paper(3.5),
        led_width_mm=paper(2.8),
        led_height_mm=chosen(1.9),
        film_thickness_mm=chosen(0.25),
        backing_thickness_mm=chosen(0.35),
        gray_filter_transmission=paper(0.25),
        diffuser=True,
    ),
    housing=Housing(wall_mm=chosen(1.0), case_length_mm=chosen(52.0), roof_z_mm=chosen(19.4)),
    printing=DESKTOP_PRINTER,
    laser=CO2_LASER,
    fastening=m2_fastening(23.0, 1.0),
    wiring=CSI_SUPPLY,
    compartment=LAB_COMPARTMENT,
)
"""The sensor whose case is 34 mm wide."""

FINGER = Wedge(
    name="finger",
    gel=Gel(
        pad_length_mm=chosen(13.0),
        pad_width_mm=chosen(9.4),
        thickness_mm=chosen(2.0),
        curved=True,
        semi_axis_across_mm=paper(60.0),
        semi_axis_normal_mm=paper(60.0),
        semi_axis_along_mm=paper(100.0),
        refractive_index=datasheet(1.41),
    ),
    acrylic=Acrylic(
        length_mm=chosen(14.6),
        width_mm=chosen(10.4),
        thickness_mm=paper(4.5),
        tip_offset_mm=chosen(1.0),
        refractive_index=datasheet(1.49),
    ),
    mirror=Mirror(
        angle_deg=paper(30.0),
        foot_x_mm=chosen(3.5),
        foot_height_mm=chosen(0.3),
        length_mm=chosen(13.0),
        width_mm=chosen(8.8),
        thickness_mm=chosen(1.0),
    ),
    camera=Camera(
        pupil_x_mm=chosen(21.5),
        pupil_z_mm=chosen(1.6),
        pitch_deg=chosen(0.0),
        diagonal_view_deg=paper(120.0),
        projection="equidistant",
        width_px=paper(640),
        height_px=paper(480),
        frames_per_second=paper(60.0),
        head_size_mm=chosen(8.6),
        head_depth_mm=chosen(4.2),
        barrel_diameter_mm=chosen(7.0),
        barrel_length_mm=chosen(1.0),
    ),
    lights=Lights(
        red_side_leds=chosen(3),
        blue_side_leds=chosen(3),
        green_base_leds=chosen(2),
        led_length_mm=paper(3.5),
        led_width_mm=paper(2.8),
        led_height_mm=chosen(1.9),
        film_thickness_mm=chosen(0.25),
        backing_thickness_mm=chosen(0.35),
        gray_filter_transmission=paper(0.25),
        diffuser=True,
    ),
    housing=Housing(wall_mm=chosen(0.9), case_length_mm=chosen(30.5), roof_z_mm=chosen(9.4)),
    printing=DESKTOP_PRINTER,
    laser=CO2_LASER,
    fastening=m2_fastening(14.0, 0.8),
    wiring=CSI_SUPPLY,
    compartment=LAB_COMPARTMENT,
)
"""The sensor whose case is of the size of a human finger, 17.2 mm wide."""
