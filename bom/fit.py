# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""The parts table for one design: its sizes in the rows' words, and no product of another size."""

from collections.abc import Sequence
from dataclasses import fields, replace

from bom.bill import BoughtPart
from sensor.design import Wedge

SHEETS_MM = (100, 200)
"""Sides of the square sheets of acrylic and mirror, of which the bill orders the least that holds a
piece beside its kerf comb."""
CUT_GAP_MM = 4.0
"""Between what is cut from one sheet."""
SHEET_HEAD_MM = 34.0
"""Of a sheet's depth, for what is engraved and for the kerf comb, with a gap beside each."""

CUT = ("acrylic", "mirror")

GUESSED = "2026-11"
"""Month of the guess that a product which fits costs as much as the one that does not."""


def parts_for(design: Wedge, parts: Sequence[BoughtPart]) -> list[BoughtPart]:
    """The rows with the design's sizes; a row whose product has another size says so.

    Args:
        design: The sensor.
        parts: The table, with fields such as ``{mirror.thickness_mm:g}`` in its words.
    """
    groups = {item.name: getattr(design, item.name) for item in fields(design)}
    groups |= {"pin_length_mm": design.pin_length_mm}
    rows = [_as_sheet(part, design) if part.id in CUT else part for part in parts]
    return [_without_misfit(_filled(part, groups), groups) for part in rows]


def _as_sheet(part: BoughtPart, design: Wedge) -> BoughtPart:
    """The row of the least sheet, at the price of its area."""
    side_mm, pieces = sheet_of(design, part.id)
    return replace(
        part,
        name=part.name.replace("{sheet_mm}", f"{side_mm}"),
        pack_size=pieces,
        price_usd=part.price_usd * (side_mm / SHEETS_MM[0]) ** 2,
    )


def sheet_of(design: Wedge, name: str) -> tuple[int, int]:
    """Side of the sheet that blocks (``acrylic``) or mirrors are cut from, and how many it holds.

    They lie in rows, beside the kerf comb.
    """
    part, kerf_mm = getattr(design, name), getattr(design.laser, f"{name}_kerf_mm")
    length, width = (side + kerf_mm + CUT_GAP_MM for side in (part.length_mm, part.width_mm))
    held = {
        side: int((side + CUT_GAP_MM) // length * ((side - SHEET_HEAD_MM + CUT_GAP_MM) // width))
        for side in SHEETS_MM
    }
    return next((side, pieces) for side, pieces in held.items() if pieces)


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
