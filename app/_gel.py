# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""The design on whose curved gel a unit's skin is laid: that of `--design` or its own."""

from pathlib import Path
from typing import TYPE_CHECKING

from app._pad import refuse_other_pad
from sensor.design_file import known_design, load_design
from sensor.unit import UNIT_FILE

if TYPE_CHECKING:
    from sensor.design import Wedge
    from sensor.unit import UnitCard


def laid_on(design: str, unit: Path, card: "UnitCard") -> "tuple[Wedge, list[str]]":
    """A design by name or file, and what to say of it.

    Raises:
        WedgeError: there is no such design, or its pad is not the unit's.
    """
    wanted = load_design(design)
    refuse_other_pad(card.pad_size_mm, wanted, str(unit / UNIT_FILE), "calibrate it anew")
    if card.design_sha256 in (None, wanted.sha256):
        return wanted, []
    return wanted, [
        f"Unit {card.serial} was built from another design than {wanted.name}, according to the "
        "hash in its unit.toml: on that gel its skin is in the wrong place."
    ]


def flat_remarks(card: "UnitCard") -> list[str]:
    """A sentence where a unit's gel counts as flat although the unit names a design."""
    if card.design_sha256 is None or known_design(card.design_sha256) is not None:
        return []
    return [
        f"The gel of unit {card.serial} counts as flat, as its design is neither standard nor "
        "finger: `wedge track --design FILE.toml` lays what is touched on the gel of its file."
    ]
