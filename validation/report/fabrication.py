# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""The files to build the sensor, as a section of the page."""

import html
import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from bom.bill import make_bill, read_parts, totals_text
from validation.report.page import (
    Picture,
    Section,
    code,
    gallery_html,
    links_html,
    paragraph,
    table_html,
)

TITLE = "Files to build the sensor"
LINKS = {
    "index.html": "page with the view to turn, drawings, downloads and checks",
    "guide.html": "guide",
    "bill/bill.md": "bill",
    "manifest.json": "manifest",
}


def fabrication_section(folders: Sequence[Path], page_folder: Path) -> Section:
    """Each design's pictures, checks and cost, with links to its folder.

    Args:
        folders: written by `wedge fabricate`, below the page's folder.
        page_folder: where the page will lie; links are relative to it.
    """
    manifests = [json.loads((folder / "manifest.json").read_bytes()) for folder in folders]
    failed = [
        f"{manifest['design']}, {check['check']} of {check['subject']}"
        for manifest in manifests
        for check in manifest["checks"]
        if not check["passed"]
    ]
    parts = [
        paragraph(
            "Solids, sheets, boards, bill and guide, made and checked in this run. Nobody has "
            "built a sensor from them yet, most outer sizes are choices that the paper leaves "
            "open, and nearly all prices are estimates."
        ),
        table_html(
            "The designs: checks measured on the files, and cost in whole packs.",
            ["design", "files", "checks passed", "checks failed", "for 1 sensor", "for 10 sensors"],
            map(_row, manifests),
            of_words=True,
        ),
    ]
    if failed:
        parts.append(paragraph(f"Failed: {'; '.join(failed)}."))
    for manifest, folder in zip(manifests, folders, strict=True):
        address = folder.relative_to(page_folder).as_posix()
        parts += [
            f"<h3>{html.escape(manifest['design'])}</h3>\n",
            gallery_html(_pictures(manifest["design"], folder)),
            links_html((words, f"{address}/{name}") for name, words in LINKS.items()),
        ]
    parts.append(
        code("\n".join(f"wedge fabricate --design {each['design']}" for each in manifests))
    )
    return Section(title=TITLE, html="".join(parts))


def no_fabrication_section(reason: str) -> Section:
    """The sentence that stands where the files are missing."""
    return Section(title=TITLE, html=paragraph(f"Left out on this machine: {reason}"))


def _row(manifest: dict[str, Any]) -> list[str]:
    passed = sum(check["passed"] for check in manifest["checks"])
    lines = make_bill(manifest["bill"], read_parts())
    costs = [
        totals_text(lines, count).partition(": ")[2].strip().removesuffix(".") for count in (1, 10)
    ]
    counts = (len(manifest["files"]), passed, len(manifest["checks"]) - passed)
    return [manifest["design"], *map(str, counts), *costs]


def _pictures(design: str, folder: Path) -> list[Picture]:
    pictures = folder / "pictures"
    return [
        Picture(
            png=(pictures / "assembled_below.png").read_bytes(),
            alt=f"The {design} sensor put together, seen from below: case, gel, adapter and cover",
            caption=f"The {design} sensor put together, the gel toward you.",
        ),
        Picture(
            png=(pictures / "section.png").read_bytes(),
            alt=f"Section through the {design} sensor: rays from the camera over the mirror and "
            "through the acrylic to the gel",
            caption="Section along the finger, with rays from the camera over the mirror and "
            "through the acrylic to the gel.",
        ),
    ]
