# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""What the guide says differently of each design: its lights, films, distances and screws."""

from collections.abc import Sequence

from cad.bounds import EPSILON, own_range
from cad.electronics.resistors import ADAPTER_V, supply_words, takes_adapters_supply
from cad.layout import Layout
from cad.optics import pad_grid, seen_mm, trace
from cad.parts.coupons import STEPS
from cad.parts.electronics_cover import POSTS
from cad.parts.gripper_adapter import (
    GRIPPER_SCREW_LENGTH,
    LAB,
    WSG_50,
    Pattern,
    under_gripper_head_mm,
)
from cad.parts.jigs import caliper_gap_mm
from cad.steps import Assembly
from cad.wires import ribbon_length_mm
from sensor.design import Camera, Wedge

_SIDES = {
    "red": "to the left",
    "blue": "to the right",
    "green": "to the base",
}
"""Where each array goes, seen from the tip with the gel down."""
_FILMS = {"gray_filter": "gray filter", "diffuser": "diffuser"}


def design_words(design: Wedge, assembly: Assembly) -> dict[str, str]:
    """Words by the name under which the guide's texts ask for them."""
    place = Layout(design)
    lights, paths = design.lights, trace(design, pad_grid(design, 21))
    (front_x, front_y), *_, (back_x, back_y) = POSTS
    seen, films = seen_mm(design, paths), [_FILMS[film] for film in place.films]
    colors = [row.color for row in place.light_rows()]
    step = {step.id: f"{number}" for number, step in enumerate(assembly.steps, start=1)}
    return {
        "hash": design.sha256[:8],
        "film_fault": _FILM_FAULT if films else "",
        "supply": supply_words(design),
        "cable": f" and the lights' supply of {ADAPTER_V:g} V"
        if takes_adapters_supply(design)
        else "",
        "lights_power": "" if takes_adapters_supply(design) else ", and the one for the lights",
        "post_front": f"{2 * abs(front_y):g}",
        "post_back": f"{2 * abs(back_y):g}",
        "post_rows": f"{back_x - front_x:g}",
        "led_room": f"{lights.led_height_mm + lights.backing_thickness_mm:.2f}",
        "head": f"{design.camera.head_size_mm:g}",
        "barrel": f"{design.camera.barrel_diameter_mm:g}",
        "acrylic_kerf": f"{design.laser.acrylic_kerf_mm:g}",
        "mirror_kerf": f"{design.laser.mirror_kerf_mm:g}",
        **_fits(place.press),
        "finger_side": _finger_side(design.camera),
        "caliper": f"{caliper_gap_mm(design):g}",
        "ribbon_length": f"{ribbon_length_mm(place):.0f}",
        "sides": _sides(colors),
        "lit": _lit(colors),
        "strips": "Stick each strip over the gray filter." if len(films) > 1 else _EACH_STRIP,
        "film_warning": _film_warning(films),
        "pin_length": f"{design.pin_length_mm:.1f}",
        "focus": f"{seen.mean():.0f}",
        "seen": f"{seen.min():.0f}-{seen.max():.0f}",
        "gripper_screws": f"{_screws(WSG_50)} for the WSG-50 (those in the bill), or"
        f" {_screws(LAB)} for the lab's pattern",
        "cover_gap": f"{design.total_thickness_mm - design.compartment.height_mm:.1f}",
        "camera_step": step["camera"],
        "holder_step": step["camera_into_case"],
        "holder_screws_step": step["rear_screws"],
        "ribbon_step": step["resistor_board"],
        "adapter_step": step["adapter"],
        "cover_screws_step": step["cover_screws"],
        "wires_step": step["board"],
    }


def _finger_side(camera: Camera) -> str:
    """Which side of the picture lies along the finger: its columns' (``cad.optics.project``)."""
    if camera.width_px == camera.height_px:
        return "horizontal"
    return "long" if camera.width_px > camera.height_px else "short"


def _fits(press_mm: float) -> dict[str, str]:
    """The coupons' fits: the loosest that can be set, and what each number of dots stands for."""
    low, high = own_range("printing.press_clearance_mm")
    tighter, _, looser = (press_mm + step for step in STEPS)
    three = "three dots"
    if looser > high + EPSILON:
        three = f"the most; three dots, {looser:.2f}, cannot be set"
    one = f"{tighter:.2f}"
    if tighter < low - EPSILON:
        one = f"{tighter:.2f}, which cannot be set: {low:.2f} is the least"
    return {
        "fit": f"{min(looser, high):.2f}",
        "fits": f"{three}; two dots are {press_mm:.2f}, one dot {one}",
    }


_FILM_FAULT = (
    "\n| bright lines along an edge |"
    " air between film and acrylic, or a film that ends before the pocket does |"
)
_EACH_STRIP = "Stick each strip to its edge, from one end to the other and without bubbles."


def _sides(colors: Sequence[str]) -> str:
    """``red goes to the left, green to the base``."""
    first, *rest = [f"{color} {where}" for color, where in _SIDES.items() if color in colors]
    return ", ".join([first.replace(" ", " goes ", 1), *rest])


def _lit(colors: Sequence[str]) -> str:
    """From where each colour comes in the picture: ``red from one side, green from the base``."""
    sides = [color for color in ("red", "blue") if color in colors]
    said = [f"{c} from {'the other' if i else 'one side'}" for i, c in enumerate(sides)]
    said += ["green from the base"] if "green" in colors else []
    return ", ".join(said)


def _film_warning(films: Sequence[str]) -> str:
    if not films:
        return "Cut acrylic and mirror with a laser."
    return (
        f"Cut acrylic and mirror with a laser. **Never put {' or '.join(films)} into it**: these"
        " films are usually vinyl (PVC),\nas those in the bill are, and burning vinyl gives off"
        " hydrogen chloride, which harms lungs and machine. Cut them with a\nknife or a cutting"
        " plotter, from their `nominal` files. Only films known to be free of PVC may be cut with a"
        " laser."
    )


def _screws(pattern: Pattern) -> str:
    return (
        f"{len(pattern.places)} × {pattern.screw}x{GRIPPER_SCREW_LENGTH:g}"
        f" ({under_gripper_head_mm(pattern):.1f} mm of plate under the head)"
    )
