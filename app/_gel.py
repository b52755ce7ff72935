# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""The design on whose curved gel a unit's skin is laid: that of `--design` or its own."""

from pathlib import Path
from typing import TYPE_CHECKING

from app._pad import refuse_other_pad
from sensor.design_file import load_design
from sensor.unit import DESIGN_FILE, UNIT_FILE

if TYPE_CHECKING:
    from recon.calibration import Calibration
    from sensor.design import Wedge


def laid_on(
    design: str | None, unit: Path, calibration: "Calibration"
) -> "tuple[Wedge | None, list[str]]":
    """The design named by name or file, by default the unit's own, and what to say of it.

    Raises:
        WedgeError: there is no such design, or its pad is not the unit's.
    """
    if design is None:
        return calibration.design, flat_remarks(calibration)
    card, wanted = calibration.card, load_design(design)
    refuse_other_pad(card.pad_size_mm, wanted, str(unit / UNIT_FILE), "calibrate it anew")
    if card.design_sha256 in (None, wanted.sha256):
        return wanted, []
    return wanted, [
        f"Unit {card.serial} was built from another design than {wanted.name}, according to the "
        "hash in its unit.toml: on that gel its skin is in the wrong place."
    ]


def flat_remarks(unit: "Calibration") -> list[str]:
    """A sentence where a unit's gel counts as flat although the unit names a design."""
    if unit.card.design_sha256 is None or unit.design is not None:
        return []
    return [
        f"The gel of unit {unit.card.serial} counts as flat, as its folder holds no {DESIGN_FILE} "
        "of the design that it was built from: calibrate it again with `--design FILE.toml`."
    ]
