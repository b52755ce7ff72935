# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""`wedge fabricate`: every file to build a sensor, checked before it is cut."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from app._fabricate import MANIFEST, fabricate
from app._output import OutputFile, keep_inputs, print_table
from sensor.design_file import load_design
from sensor.errors import WedgeError
from sensor.files import check_outputs, write_json


def main(design: str = "standard", out: Path | None = None, json: OutputFile = None) -> int:
    """Make everything that a workshop needs: print, laser and board files, bill, guide, pictures.

    All of it is checked: that each part can be printed and inserted, that no parts collide,
    that the camera sees the whole pad, and that the boards connect what they must. The folder
    appears only when it is complete. If a check fails, guide and page begin with a warning, and the
    exit status is 1. A design that cannot be built is refused, with the field and its bound.

    Example: wedge fabricate --design finger --out build/finger

    Args:
        design: standard, finger, or a TOML file that changes some numbers of one of them.
        out: Folder for the files; build/fabrication/NAME by default.
        json: Write the results of the checks here as JSON.
    """
    wanted = load_design(design)
    folder = out or Path("build", "fabrication", wanted.name)
    check_outputs(folder / MANIFEST, json)
    keep_inputs([design], [json])
    if json is not None and (folder / MANIFEST).resolve().is_relative_to(json.resolve()):
        raise WedgeError(f"{json} cannot be written: {folder} needs its place; name another file.")
    manifest = fabricate(wanted, folder)
    print_table(("check", "of", "figure", "bound", "", "detail"), map(_row, manifest["checks"]))
    write_json(json, {key: manifest[key] for key in ("design", "design_sha256", "checks")})
    failed = [check for check in manifest["checks"] if not check["passed"]]
    for change in _changes(manifest):
        print(f"changed since it was last kept: {change}")
    print(f"{len(manifest['checks'])} checks, {len(failed)} failed. Files: {folder}")
    return 1 if failed else 0


def _changes(manifest: dict[str, Any]) -> list[str]:
    """How a known design differs from the figures in the repository."""
    from cad.golden import differences, golden_of, read_golden

    kept = read_golden(manifest["design"], manifest["design_sha256"])
    return differences(golden_of(manifest), kept) if kept else []


def _row(check: Mapping[str, Any]) -> tuple[str, ...]:
    figure = f"{check['value']:.4g} {check['unit']}".strip()
    mark = "ok" if check["passed"] else "FAILED"
    return check["check"], check["subject"], figure, check["bound"], mark, check["detail"]
