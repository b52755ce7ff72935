# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""The parts table for one design: its sizes in the rows' words, and no product of another size."""

from collections.abc import Sequence
from dataclasses import fields, replace

from bom.bill import BoughtPart
from sensor.design import Wedge

SHEET_MM = 100
"""Side of the square sheets of acrylic and mirror that the bill orders; what is cut fits on one."""
CUT_GAP_MM = 4.0
"""Between what is cut from one sheet."""
SHEET_HEAD_MM = 34.0
"""Of a sheet's depth, for what is engraved and for the kerf comb, with a gap beside each."""

GUESSED = "2026-11"
"""Month of the guess that a product which fits costs as much as the one that does not."""


def parts_for(design: Wedge, parts: Sequence[BoughtPart]) -> list[BoughtPart]:
    """The rows with the design's sizes; a row whose product has another size says so.

    Args:
        design: The sensor.
        parts: The table, with fields such as ``{mirror.thickness_mm:g}`` in its words.
    """
    groups = {item.name: getattr(design, item.name) for item in fields(design)}
    groups |= {"sheet_mm": SHEET_MM, "pin_length_mm": design.pin_length_mm}
    packs = _pieces_per_sheet(design)
    rows = [replace(part, pack_size=packs.get(part.id, part.pack_size)) for part in parts]
    return [_without_misfit(_filled(part, groups), groups) for part in rows]


def _pieces_per_sheet(design: Wedge) -> dict[str, int]:
    """How many blocks and mirrors lie in rows on a sheet, beside its kerf comb."""
    packs = {}
    for name in ("acrylic", "mirror"):
        part, kerf_mm = getattr(design, name), getattr(design.laser, f"{name}_kerf_mm")
        columns = (SHEET_MM + CUT_GAP_MM) // (part.length_mm + kerf_mm + CUT_GAP_MM)
        deep = SHEET_MM - SHEET_HEAD_MM
        packs[name] = int(columns * ((deep + CUT_GAP_MM) // (part.width_mm + kerf_mm + CUT_GAP_MM)))
    return {name: max(1, pieces) for name, pieces in packs.items()}


def _filled(part: BoughtPart, groups: dict[str, object]) -> BoughtPart:
    return replace(
        part,
        name=part.name.format(**groups),
        alternative=part.alternative.format(**groups),
    )


def _without_misfit(part: BoughtPart, groups: dict[str, object]) -> BoughtPart:
    """The row itself, or one that names no product and says why the usual one does not fit."""
    misfits = []
    for field, size in part.made_for_sizes:
        group, _, name = field.partition(".")
        wanted = getattr(groups[group], name)
        if abs(wanted - size) > 1e-9:
            misfits.append(f"its {field} is {size:g}, not {wanted:g}")
    if not misfits:
        return part
    usual = f"{part.brand} {part.number}".removeprefix("any ")
    reason = f"not {usual}: {' and '.join(misfits)}; {part.alternative}"
    return replace(
        part,
        brand="any",
        number="of this size",
        distributor_brand="",
        distributor_number="",
        basis="estimate",
        date=GUESSED,
        alternative=reason,
    )
