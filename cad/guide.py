# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""The building guide: its steps are the assembly's, its quantities the manifest's."""

from collections import Counter
from collections.abc import Mapping, Sequence
from importlib.resources import files
from typing import Any

from cad.assembly import Assembly, Step
from cad.catalogue import INFILL_PERCENT
from cad.electronics.boards import Board
from cad.electronics.files import board_note
from cad.electronics.resistors import ballasts
from cad.electronics.wiring import ARRAY_WORDS, BOARD_WORDS
from cad.exports.laser import sheets
from cad.optics import keystone, pad_grid, pixel_margin, trace
from sensor.design import Wedge

_HOW = {
    "case": "Clear the screw holes, and blow out the light pockets and the wire channels. Thread a"
    " screw once into each of the six holes.",
    "mirror": "Take off the film. Put three small drops of epoxy on the seat, never at its edges."
    " Hold the mirror by its sides, coated face toward you, some ten degrees steeper than its"
    " seat. Lift it through the window, top first, until the top is in its corner; then swing the"
    " foot up until the back lies flat. Check by eye that nothing lies behind it: one degree of"
    " tilt moves the picture by several pixels.",
    "lights": "Solder two wires to each array's tail first. Red goes to the left seen from the"
    " tip with the gel down, blue to the right, green to the base; none goes to the tip. Stick each"
    " array with double-sided tape to the outer wall of its pocket, LEDs toward the acrylic, and"
    " lead the wires behind the ribs into the channels.",
    "acrylic": "Peel off the film. From here on touch only the edges.",
    "gray_filter": "Stick each strip to its edge from one end to the other. There must be no"
    " bubble: the filter works only where it is optically coupled to the acrylic.",
    "diffuser": "Stick the diffuser over the gray filter.",
    "gel": "Degrease the acrylic's outer face and the gel's flat back. Spread a thin, even film of"
    " silicone adhesive, lower the gel from one end, centre it, press out the air, and let it"
    " cure.",
    "window": "Last look at the mirror: blow off dust. Press the window straight in until its"
    " corners rest on the ledges and its face is flush with the case.",
    "pins": "Push a pin into each notch at the tip. Instead, or for good, put a thin line of"
    " glue around the edge.",
    "camera_holder": "Check that the lens hole is clear of strings.",
    "camera": "Press the head in from the back, its lens first, with the ribbon leaving toward"
    " the back, until it stops at the front plate. It must not turn.",
    "camera_into_case": "Lead the wires through the notches of the flange and slide the holder in"
    " until the flange lies flat on the case.",
    "rear_screws": "Tighten by hand until they stop, no further: the thread is plastic.",
    "adapter": "Choose the adapter of your gripper; the plate's wide end points away from the tip.",
    "roof_screws": "Tighten crosswise. Bolt the plate to the gripper now, from below: later the"
    " cover is in the way.",
    "cover": "The compartment is closed by the gripper adapter, which is its lid.",
    "board": "One board of the pair belongs here, the other one to the Raspberry Pi (section 8)."
    " Solder the resistor board's supply wires to {supply} V and ground of the adapter first.",
    "board_screws": "The screws cut their own thread in the posts.",
    "resistor_board": "Wrap it in insulating tape, and solder the arrays' wires straight into its"
    " holes: the wires come in at the front notch.",
    "cover_into_place": "Lead the camera's ribbon through the front notch and plug it into the"
    " board: open the socket's latch, push the ribbon in straight, its bare contacts toward those"
    " of the socket, and close the latch. The board's HDMI socket then looks out at the back.",
    "cover_screws": "Use a driver with a long shaft: the heads sit deep.",
}

_MADE = {
    "mirror": "Mirror, cut",
    "acrylic": "Acrylic, cut",
    "gel": "Gel, cast",
    "led_array_red": "Red LED array",
    "led_array_blue": "Blue LED array",
    "led_array_green": "Green LED array",
    "resistor_board": "Resistor board, soldered",
}
"""What the bill calls by what it is made of."""


def guide_text(
    design: Wedge,
    assembly: Assembly,
    boards: Sequence[Board],
    parts: Sequence[Mapping[str, Any]],
    names: Mapping[str, str],
    order: Sequence[tuple[str, str]],
) -> str:
    """The guide as Markdown.

    Args:
        design: The sensor.
        assembly: Its steps.
        boards: Its boards.
        parts: The manifest's parts.
        names: What the bill calls each part, by id.
        order: The bill's lines: name, and quantity with its unit.
    """
    pixels = (paths := trace(design, pad_grid(design, 21))).pixels
    titles = {part["id"]: part["title"] for part in parts if "title" in part}
    template = files("cad").joinpath("data", "guide.md").read_text(encoding="utf-8")
    gel = next(part for part in parts if part["id"] == "gel")
    return template.format(
        name=design.name,
        hash=design.sha256[:8],
        width=f"{design.outer_width_mm:g}",
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
        molds="`mold_curved` (or `mold_flat`)" if design.gel.curved else "`mold_flat`",
        steps="\n".join(
            _step_text(number, step, assembly, {**names, **_MADE, **titles}, design)
            for number, step in enumerate(assembly.steps, start=1)
        ),
        supply=f"{design.wiring.supply_v:g}",
        wires_step=[step.id for step in assembly.steps].index("board") + 1,
        keystone=f"{keystone(pixels, 21):.2f}",
        margin=f"{pixel_margin(design.camera, pixels):.0f}",
        view=f"{design.camera.diagonal_view_deg:g}",
        distance=f"{paths.air_mm.min():.0f}-{paths.air_mm.max():.0f}",
    )


def _step_text(
    number: int, step: Step, assembly: Assembly, names: Mapping[str, str], design: Wedge
) -> str:
    taken = Counter(assembly.bodies[name].part for name in step.bodies)
    lines = [
        f"### Step {number}: {step.title}",
        "",
        f"![step {number}](pictures/step_{number:02d}.png)",
        "",
    ]
    if taken:
        listed = "; ".join(f"{count} × {names[part]} (`{part}`)" for part, count in taken.items())
        lines += [f"Take {listed}.", ""]
    how = _HOW[step.id].format(supply=f"{design.wiring.supply_v:g}")
    return "\n".join([*lines, how, ""])


def _print_table(parts: Sequence[Mapping[str, Any]]) -> str:
    rows = [
        "| part | quantity | for | stands | layer, mm | grams | note |",
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
        f"| {item.colour} | {item.leds} | {item.label} | {item.led_current_ma():.1f} mA |"
        f" {item.total_current_ma:.0f} mA |"
        for item in ballasts(design)
    ]
    return "\n".join(rows)
