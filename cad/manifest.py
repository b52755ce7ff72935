# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""The manifest: every part with its figures and every file with its hash."""

import hashlib
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import cadquery as cq
from OCP.Bnd import Bnd_Box
from OCP.BRepBndLib import BRepBndLib

from cad.catalogue import BACK_DOWN, INFILL_PERCENT, UPSIDE_DOWN, printed_parts
from cad.result import Result
from cad.tables import density_g_cm3
from sensor.design import Wedge

REVISION = 3
"""Of the parts' shapes: raised by whoever changes one."""
_TURNS = {BACK_DOWN: "back face on the bed", UPSIDE_DOWN: "top face on the bed"}


def part_entries(
    design: Wedge,
    printed: Mapping[str, cq.Solid],
    bought: Mapping[str, tuple[cq.Solid, str]],
    counts: Mapping[str, int],
) -> list[dict[str, Any]]:
    """One entry a part: printed ones first, then those of the assembly that are bought or cut."""
    entries = []
    for part in printed_parts(design):
        entry = _figures(part.id, printed[part.id], part.material)
        entry["title"], entry["use"] = part.title, part.use
        entry["quantity"] = counts.get(part.id, 0 if part.use == "alternative" else 1)
        entry["print"] = {
            "orientation": _TURNS.get(part.turn, "as modelled"),
            "layer_mm": float(design.printing.layer_mm),
            "infill_percent": INFILL_PERCENT,
            "supports": "none",
            "note": part.note,
        }
        entries.append(entry)
    for part_id, (solid, material) in bought.items():
        entry = _figures(part_id, solid, material)
        entries.append({**entry, "use": "assembly", "quantity": counts[part_id]})
    return entries


def _figures(part_id: str, solid: cq.Solid, material: str) -> dict[str, Any]:
    volume = solid.Volume()
    return {
        "id": part_id,
        "revision": REVISION,
        "material": material,
        "volume_mm3": round(volume, 3),
        "mass_g": round(volume * density_g_cm3(material) / 1000, 3),
        "bounding_box_mm": bounding_box_mm([solid]),
    }


def bounding_box_mm(solids: Iterable[cq.Solid]) -> list[float]:
    """What solids measure together along x, y and z, in mm to three digits."""
    box = Bnd_Box()
    for solid in solids:  # without the tolerances that cadquery's own box adds at curved faces
        BRepBndLib.AddOptimal_s(solid.wrapped, box, useTriangulation=False, useShapeTolerance=False)
    x0, y0, z0, x1, y1, z1 = box.Get()
    return [round(size, 3) for size in (x1 - x0, y1 - y0, z1 - z0)]


def size_words(sizes_mm: Iterable[float]) -> str:
    """``78.5 x 34 x 21.9``."""
    return " x ".join(f"{round(size, 1):g}" for size in sizes_mm)


def check_entries(results: list[Result]) -> list[dict[str, Any]]:
    """The checks as data, in the order they ran."""
    return [
        {
            "check": result.check,
            "subject": result.subject,
            "value": round(result.value, 6) + 0.0,
            "unit": result.unit,
            "bound": f"{result.sense} {result.bound:g}"
            if result.sense != "for information"
            else result.sense,
            "passed": result.passed,
            "detail": result.detail,
        }
        for result in results
    ]


def with_hashes(content: Mapping[str, Any], folder: Path) -> dict[str, Any]:
    """The manifest with the sha256 of every file that lies in the folder."""
    files = sorted(path for path in folder.rglob("*") if path.is_file())
    hashes = {
        path.relative_to(folder).as_posix(): hashlib.sha256(path.read_bytes()).hexdigest()
        for path in files
    }
    return {**content, "files": hashes}
