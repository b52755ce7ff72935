# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""The building guide: its steps are the assembly's, its quantities the manifest's."""

import shlex
from collections import Counter
from collections.abc import Mapping, Sequence
from importlib.resources import files
from typing import Any

from cad.catalogue import INFILL_PERCENT
from cad.electronics.boards import Board
from cad.electronics.files import board_note
from cad.electronics.resistors import ballasts
from cad.electronics.wiring import ARRAY_WORDS, BOARD_WORDS
from cad.exports.laser import sheets
from cad.guide_words import design_words
from cad.manifest import size_words
from cad.optics import keystone, pad_grid, pixel_margin, trace
from cad.steps import Assembly, Step
from sensor.design import Wedge
from sensor.design_file import DESIGNS
from sensor.wire import SIZES_PX

_HOW = {
    "case": "Compare the digits in its roof with the first ones of this guide's design, {hash}:"
    " step {adapter_step} covers them. Clear the screw holes, and blow out the light pockets and"
    " the wire channels. Drive a screw once into each of the six holes to cut its thread.",
    "mirror": "Take off the film. Put three small drops of epoxy on the seat, never at its edges."
    " Hold the mirror by its sides, coated face toward you, about ten degrees steeper than"
    " its seat. Lift it through the window, top first, until its top is in the corner of the seat;"
    " then swing its foot up until the back lies flat. Check by eye that nothing lies behind it:"
    " one degree of tilt moves the picture by several pixels.",
    "lights": "First solder two wires to the tail of each array. Seen from the tip with the gel"
    " down, {sides}; none goes to the tip. Stick each array to the outer wall of its pocket with"
    " double-sided tape, LEDs toward the acrylic, and lead the wires behind the ribs into the"
    " channels.",
    "acrylic": "Peel off the film. From now on touch only the edges.",
    "gray_filter": "Stick each strip to its edge, from one end to the other and without bubbles:"
    " the filter works only where it is optically coupled to the acrylic.",
    "diffuser": "{strips}",
    "gel": "Degrease the acrylic's outer face and the gel's flat back: wipe them with a lint-free"
    " cloth, damp with water and a little dish soap, then with clean water, and let them dry. Use"
    " no alcohol or other solvent: it crazes the acrylic's edges."
    " Spread a thin, even film of silicone adhesive, lower the gel from one end, centre it,"
    " press out the air, and let it cure.",
    "window": "Take a last look at the mirror and blow off dust. Press the window straight in"
    " until its corners rest on the ledges and its face is flush with the case.",
    "pins": "Cut two pins of {pin_length} mm and push one into each notch at the tip. Instead, or"
    " to fix the window for good, put a thin line of glue around its edge.",
    "camera_holder": "Check that the lens hole is free of strings.",
    "camera": "Focus it first: these heads come focused at a distance, and the lens cannot be"
    " reached later. Connect it to a Raspberry Pi as in section 8, break the glue at the lens's"
    " thread, and turn the lens until small print {focus} mm in front of it is sharp: that is"
    " where the camera will see the skin ({seen} mm away). Fix the thread with a speck of glue."
    " Find out which way round the head goes in, for it fits in four ways: the picture's"
    " {finger_side} side must stand at a right angle to the acrylic. Hold head and holder as they"
    " will be in the sensor, gel down, and move a finger up and down before the lens: in the"
    " picture it must move along the {finger_side} side; which end of the picture is up does not"
    " matter."
    " Then press the head into the holder from the back, lens first, with the ribbon leaving"
    " toward the back, until it stops at the front plate. It must not turn in the holder.",
    "camera_into_case": "Lead the wires through the notches in the flange and slide the holder in"
    " until the flange lies flat on the case.",
    "rear_screws": "Tighten them by hand until they stop, no further: the thread is plastic.",
    "adapter": "Take the adapter for your gripper, its four small recesses up and toward the tip:"
    " they are for the screws of the next step.",
    "roof_screws": "Tighten them crosswise. Bolt the plate to the gripper now, from below, with the"
    " heads sunk in the plate: later the cover is in the way. It takes {gripper_screws}. Take"
    " shorter ones if the gripper's holes are less deep.",
    "cover": "The gripper adapter is the lid of the compartment. Once in place, the cover's bottom"
    " is {cover_gap} mm further back than the gel's highest point: a flat object that reaches"
    " under the cover touches it when pressed deeper than that.",
    "board": "One board of the pair goes here, the other one to the Raspberry Pi (section 8). First"
    " solder the resistor board's supply wires to {supply}.",
    "board_screws": "The screws cut their own thread in the posts.",
    "resistor_board": "Hold the cover just below its place and lead the arrays' wires and the"
    " camera's ribbon in through its front notch. Solder the wires straight into the holes of the"
    " resistor board. Plug the ribbon into the adapter: open the socket's latch, push the ribbon"
    " in straight, with its bare contacts toward those of the socket, and close the latch. Only"
    " then wrap the resistor board in insulating tape and lay it on the socket, between the"
    " adapter's screws: it covers the latch.",
    "cover_into_place": "Fold wires and ribbon into the compartment without pinching any between"
    " cover and adapter. The board's HDMI socket then faces out at the back.",
    "cover_screws": "Use a screwdriver with a long shaft: the heads sit deep.",
}

_MADE = {
    "mirror": "Mirror, cut",
    "acrylic": "Acrylic, cut",
    "gel": "Gel, cast",
    "gray_filter_side": "Gray filter on the sides",
    "gray_filter_base": "Gray filter at the base",
    "diffuser_side": "Diffuser on the sides",
    "diffuser_base": "Diffuser at the base",
    "led_array_red": "Red LED array",
    "led_array_blue": "Blue LED array",
    "led_array_green": "Green LED array",
    "resistor_board": "Resistor board, soldered",
}
"""What the bill calls by what it is made of."""


def part_names(parts: Sequence[Mapping[str, Any]], billed: Mapping[str, str]) -> dict[str, str]:
    """What people call each part, by id.

    Args:
        parts: The manifest's, of which the printed ones have titles.
        billed: What the bill calls each part, by id.
    """
    titles = {part["id"]: part["title"] for part in parts if "title" in part}
    return {**billed, **_MADE, **titles}


def guide_text(
    design: Wedge,
    assembly: Assembly,
    boards: Sequence[Board],
    manifest: Mapping[str, Any],
    names: Mapping[str, str],
    order: Sequence[tuple[str, str]],
    failed: Sequence[str] = (),
) -> str:
    """The guide as Markdown.

    Args:
        design: The sensor.
        assembly: Its steps.
        boards: Its boards.
        manifest: Its size and its parts.
        names: What people call each part, by id (``part_names``).
        order: The bill's lines: name, and quantity with its unit.
        failed: The checks that failed, by name; the guide begins with them.
    """
    pixels = trace(design, pad_grid(design, 21)).pixels
    words = design_words(design, assembly)
    template = files("cad").joinpath("data", "guide.md").read_text(encoding="utf-8")
    parts = manifest["parts"]
    gel = next(part for part in parts if part["id"] == "gel")
    frame_px = design.camera.width_px, design.camera.height_px
    sent_px = " or ".join(map(_by, SIZES_PX))
    included = design == DESIGNS.get(design.name)
    file = f"{design.name}.toml"
    typed = design.name if included else shlex.quote(file)
    return template.format(
        name=design.name,
        width=f"{design.outer_width_mm:g}",
        size=size_words(manifest["bounding_box_mm"]),
        infill=f"{INFILL_PERCENT:g}",
        order_table="\n".join(f"| {part} | {quantity} |" for part, quantity in order),
        board_words=BOARD_WORDS,
        array_words=ARRAY_WORDS,
        wire=f"{design.wiring.wire_diameter_mm:g}",
        print_table=_print_table(parts),
        laser_table=_laser_table(design),
        boards="\n".join(f"- {board_note(board)}" for board in boards),
        resistors=_resistor_table(design),
        current=f"{design.wiring.led_current_ma:g}",
        gel_ml=f"{gel['volume_mm3'] / 1000:.1f}",
        gel_mixed_ml=f"{manifest['bill']['gel']:g}",
        molds="`mold_curved` (or `mold_flat`)" if design.gel.curved else "`mold_flat`",
        steps="\n".join(
            _step_text(number, step, assembly, names, words)
            for number, step in enumerate(assembly.steps, start=1)
        ),
        warning=_warning(failed),
        **words,
        keystone=f"{keystone(pixels, 21):.2f}",
        margin=f"{pixel_margin(design.camera, pixels):.0f}",
        view=f"{design.camera.diagonal_view_deg:g}",
        frame=_by(frame_px),
        sent=""
        if frame_px in SIZES_PX
        else f" (The server sends {sent_px} pixels only: others need a program of your own.)",
        base=f'base = "{design.name}"\nname = "mine"\n\n' if included else "",
        typed=typed,
        fit_file="write a design file, such as `mine.toml`"
        if included
        else f"set this in your design file, `{file}`",
        fit_typed="mine.toml" if included else typed,
        own="" if included else " (the path of your design's file)",
    )


def _by(size_px: tuple[int, int]) -> str:
    return f"{size_px[0]} × {size_px[1]}"


def _warning(failed: Sequence[str]) -> str:
    if not failed:
        return ""
    count = f"{len(failed)} check{'s' if len(failed) > 1 else ''}"
    return (
        f"\n> **Do not build from this folder: {count} failed** ({'; '.join(failed)})."
        " The table at the end of [index.html](index.html) shows their figures.\n"
    )


def _step_text(
    number: int,
    step: Step,
    assembly: Assembly,
    names: Mapping[str, str],
    words: Mapping[str, str],
) -> str:
    taken = Counter(assembly.bodies[name].part for name in step.bodies)
    shown = "; what goes in is drawn just short of its place" if assembly.standing(step) else ""
    lines = [
        f"### Step {number}: {step.title}",
        "",
        f"![{step.title}{shown}](pictures/step_{number:02d}.png)",
        "",
    ]
    if taken:
        listed = "; ".join(f"{count} × {names[part]} (`{part}`)" for part, count in taken.items())
        lines += [f"Take {listed}.", ""]
    return "\n".join([*lines, _HOW[step.id].format(**words), ""])


def _print_table(parts: Sequence[Mapping[str, Any]]) -> str:
    rows = [
        "| part | quantity | used for | orientation | layer, mm | grams | note |",
        "|---|---|---|---|---|---|---|",
    ]
    for part in parts:
        if "print" in part:
            how = part["print"]
            rows.append(
                f"| `{part['id']}` | {part['quantity']} | {part['use']} | {how['orientation']} |"
                f" {how['layer_mm']:g} | {part['mass_g']:.1f} | {how['note']} |"
            )
    return "\n".join(rows)


def _laser_table(design: Wedge) -> str:
    rows = [
        "| sheet | cut by | thickness, mm | piece | size, mm | quantity |",
        "|---|---|---|---|---|---|",
    ]
    rows += [
        f"| {sheet.material} | {'knife' if sheet.kerf_mm is None else 'laser'} |"
        f" {sheet.thickness_mm:g} | {piece.id} |"
        f" {piece.length:.2f} x {piece.width:.2f} | {piece.quantity} |"
        for sheet in sheets(design)
        for piece in sheet.pieces
    ]
    return "\n".join(rows)


def _resistor_table(design: Wedge) -> str:
    rows = ["| array | LEDs | resistor | each LED | whole array |", "|---|---|---|---|---|"]
    rows += [
        f"| {item.color} | {item.leds} | {item.label} | {item.led_current_ma:.1f} mA |"
        f" {item.total_current_ma:.0f} mA |"
        for item in ballasts(design)
    ]
    return "\n".join(rows)
