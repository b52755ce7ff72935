# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""The tables that holes, screws and masses are taken from, one for all parts."""

import csv
from dataclasses import dataclass
from functools import cache
from importlib.resources import files


@dataclass(frozen=True)
class Fastener:
    """One size of screw and the holes it goes into, in mm."""

    screw: str
    thread_mm: float
    pitch_mm: float
    core_mm: float
    tap_mm: float
    clearance_mm: float
    head_diameter_mm: float
    head_height_mm: float


@cache
def fastener(screw: str) -> Fastener:
    """The row of the fastener table for a size such as ``M2``."""
    for row in _rows("fasteners.csv"):
        if row["screw"] == screw:
            return Fastener(screw, *(float(row[key]) for key in list(row)[1:]))
    raise KeyError(screw)


@cache
def density_g_cm3(material: str) -> float:
    """Density of a material of the materials table."""
    for row in _rows("materials.csv"):
        if row["material"] == material:
            return float(row["density_g_cm3"])
    raise KeyError(material)


def _rows(name: str) -> list[dict[str, str]]:
    text = files("cad").joinpath("data", name).read_text(encoding="utf-8")
    return list(csv.DictReader(line for line in text.splitlines() if not line.startswith("#")))
