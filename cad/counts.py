# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""What one sensor takes: bodies of the assembly, components of the boards, and what both imply."""

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Any

from cad.electronics.boards import Board
from cad.electronics.resistors import takes_adapters_supply
from cad.layout import Layout
from cad.parts.gripper_adapter import GRIPPER_SCREW_LENGTH, WSG_50
from cad.wires import wire_length_mm
from sensor.design import Wedge

WIRE_M = 0.12
"""From the resistor board to the adapter, and at least from an array to the resistor board."""
CAST_SHARE = 2.0
"""Silicone mixed over the gel's volume: some stands above the rim, the rest stays in the cup."""


def bill_counts(
    design: Wedge,
    bodies: Mapping[str, int],
    boards: Sequence[Board],
    parts: Sequence[Mapping[str, Any]],
) -> dict[str, float]:
    """Quantities by id of all that is bought.

    Args:
        design: The sensor.
        bodies: How many of each part the assembly holds.
        boards: The boards, whose components are soldered on.
        parts: The manifest's parts; printed ones become grams of filament.
    """
    printed = {part["id"] for part in parts if "print" in part}
    counts: Counter[str] = Counter()
    for part_id, count in bodies.items():
        if part_id not in printed:  # the strips of a film are cut from one roll
            counts[part_id.removesuffix("_side").removesuffix("_base")] += count
    for board in boards:
        counts.update(component.part for component in board.components)
        if board.name not in bodies:
            counts[board.name] += 1
    arrays = sum(board.name.startswith("led_array") for board in boards)
    made = [part for part in parts if "print" in part]
    grams = sum(part["mass_g"] * part["quantity"] for part in made)
    balls = sum(part["quantity"] for part in made if part["id"] == "ball_jig")
    used_up = ("gel_paint", "gel_thinner", "gel_glue", "cover_tape", "black_tape", "abrasive")
    per_gel = {name: counts["gel"] for name in (*used_up, "degreaser")}
    behind = ("hdmi_cable", "raspberry_pi", "pi_power_supply", "microsd_card")
    links = {name: counts["csi_hdmi_board"] for name in behind}
    wrapped = {"insulating_tape": counts["resistor_board"]}
    gripper = f"screw_{WSG_50.screw.lower()}x{GRIPPER_SCREW_LENGTH:g}"
    counts[gripper] += len(WSG_50.places) * bodies["adapter_wsg50"]
    gel_ml = sum(part["volume_mm3"] / 1000 for part in parts if part["id"] == "gel")
    cast = {"gel": round(CAST_SHARE * gel_ml, 1)}
    wires_m = 2 * arrays * _array_wire_m(design) + 2 * WIRE_M
    glued = {"epoxy": counts["mirror"], "double_tape": arrays}
    implied = {"wire": round(wires_m, 3), "pla": round(grams, 1), "ball": balls}
    supply = {} if takes_adapters_supply(design) else {"light_supply": 1}
    return {**counts, **per_gel, **wrapped, **glued, **links, **supply, **cast, **implied}


def _array_wire_m(design: Wedge) -> float:
    """In whole centimetres."""
    return max(WIRE_M, math.ceil(wire_length_mm(Layout(design)) / 10) / 100)
