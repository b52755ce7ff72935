# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""The curved gel of `--design`, on which a unit's skin is laid."""

from pathlib import Path
from typing import TYPE_CHECKING

from app._pad import refuse_other_pad
from sensor.design_file import DESIGNS, load_design
from sensor.unit import UNIT_FILE

if TYPE_CHECKING:
    from sensor.design import Gel
    from sensor.unit import UnitCard


def design_gel(design: str | None, unit: Path, card: "UnitCard") -> "tuple[Gel | None, list[str]]":
    """The gel of a design by name or file, and what to say of it; without one the gel is flat.

    Raises:
        WedgeError: there is no such design, or its pad is not the unit's.
    """
    if design is None:
        return None, []
    built_from = load_design(design)
    refuse_other_pad(card.pad_size_mm, built_from, str(unit / UNIT_FILE), "calibrate it anew")
    if card.design_sha256 in (None, built_from.sha256):
        return built_from.gel, []
    return built_from.gel, [
        f"Unit {card.serial} was built from another design than {built_from.name}, according to "
        "the hash in its unit.toml: on that gel its skin is in the wrong place."
    ]


def flat_remarks(card: "UnitCard") -> list[str]:
    """What to say where a gel is taken for flat that is known to be curved."""
    return [
        f"Unit {card.serial} was built from the design {name}, whose gel is curved, and is taken "
        f"for flat: with --design {name}, what travels over the pad does not seem to tilt."
        for name, known in DESIGNS.items()
        if known.sha256 == card.design_sha256 and known.gel.curved
    ]
