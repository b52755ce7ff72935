# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""What the known designs measured when they were last looked at, kept in the repository.

``python -m cad.golden`` writes ``cad/data/golden_NAME.json`` again; its diff shows a reviewer what
a change does to every part. `wedge fabricate` prints the differences in words.
"""

import json
from collections.abc import Mapping
from importlib.resources import files
from pathlib import Path
from typing import Any

from cad.build import manifest_of, model, run_checks
from sensor.design_file import DESIGNS

_KEYS = ("id", "material", "quantity", "volume_mm3", "mass_g", "bounding_box_mm")
_FIGURES = ("sight", "tolerance")


def golden_of(manifest: Mapping[str, Any]) -> dict[str, Any]:
    """The figures of a manifest that a reviewer compares; no hashes, which any change moves."""
    return {
        "design": manifest["design"],
        "parts": [{key: part[key] for key in _KEYS} for part in manifest["parts"]],
        "bill": manifest["bill"],
        "figures": {
            f"{check['check']}: {check['subject']}": round(check["value"], 2)
            for check in manifest["checks"]
            if check["check"] in _FIGURES
        },
    }


def read_golden(name: str, sha256: str) -> dict[str, Any] | None:
    """The kept figures of a design by its name and hash, or None for one that is not kept.

    A design of one's own may have the name of a known one.
    """
    source = files("cad").joinpath("data", f"golden_{name}.json")
    if name not in DESIGNS or DESIGNS[name].sha256 != sha256 or not source.is_file():
        return None
    content: dict[str, Any] = json.loads(source.read_text(encoding="utf-8"))
    return content


def differences(now: Mapping[str, Any], kept: Mapping[str, Any]) -> list[str]:
    """What moved, one sentence a change: ``case volume +3.1 %``."""
    said = []
    before = {part["id"]: part for part in kept["parts"]}
    after = {part["id"]: part for part in now["parts"]}
    said += [f"{part} is gone" for part in before if part not in after]
    said += [f"{part} is new" for part in after if part not in before]
    for part in [part for part in after if part in before]:
        old, new = before[part], after[part]
        change = 100 * (new["volume_mm3"] / old["volume_mm3"] - 1)
        if abs(change) >= 0.05:
            said.append(f"{part} volume {change:+.1f} %")
        if new["quantity"] != old["quantity"]:
            said.append(f"{part} quantity {old['quantity']} to {new['quantity']}")
        moved = zip(old["bounding_box_mm"], new["bounding_box_mm"], strict=True)
        if any(abs(a - b) > 0.015 for a, b in moved):
            sizes = " x ".join(f"{size:g}" for size in new["bounding_box_mm"])
            said.append(f"{part} now measures {sizes} mm")
    for name, value in now["figures"].items():
        old_value = kept["figures"].get(name)
        if old_value is None or abs(value - old_value) > 0.02 * max(1.0, abs(old_value)):
            said.append(f"{name} {old_value} to {value}")
    for part in sorted({*kept["bill"], *now["bill"]}):
        if kept["bill"].get(part, 0) != now["bill"].get(part, 0):
            said.append(f"bill: {part} {kept['bill'].get(part, 0)} to {now['bill'].get(part, 0)}")
    return said


def write_golden(folder: Path) -> None:
    """Measure the known designs and keep their figures."""
    for name, design in DESIGNS.items():
        built = model(design)
        content = golden_of(manifest_of(built, run_checks(built)))
        text = json.dumps(content, indent=1, ensure_ascii=False) + "\n"
        (folder / f"golden_{name}.json").write_text(text, encoding="utf-8", newline="\n")


if __name__ == "__main__":
    write_golden(Path(__file__).parent / "data")
