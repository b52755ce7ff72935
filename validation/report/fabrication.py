# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""The files to build the sensor, as a section of the page."""

import html
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from bom.bill import make_bill, read_parts, totals_text
from bom.fit import parts_for
from sensor.design import Wedge
from validation.report.page import (
    Picture,
    Section,
    code,
    figure_html,
    gallery_html,
    links_html,
    paragraph,
    table_html,
)

TITLE = "Files to build the sensor"
LINKS = {
    "index.html": "page with every picture, drawing, download and check",
    "guide.html": "guide, step by step",
    "drawing.svg": "drawing with the main dimensions",
    "step/assembly.step": "assembly as STEP",
    "electronics/wiring.svg": "wiring",
    "bill/bill.md": "bill",
    "bill/distributor.csv": "order table for an electronics distributor",
    "manifest.json": "manifest",
}


def fabrication_section(designs: Mapping[Path, Wedge], page_folder: Path) -> Section:
    """Each design's pictures, checks and cost, with links to its folder.

    Args:
        designs: by the folder that `wedge fabricate` wrote for each, below the page's folder.
        page_folder: where the page will lie; links are relative to it.
    """
    folders = list(designs)
    manifests = [json.loads((folder / "manifest.json").read_bytes()) for folder in folders]
    failed = [
        f"{manifest['design']}, {check['check']} of {check['subject']}"
        for manifest in manifests
        for check in manifest["checks"]
        if not check["passed"]
    ]
    parts = [
        paragraph(
            "Solids, sheets, boards, bill and guide, generated and checked in this run. Nobody has "
            "built a sensor from them yet; most outer dimensions are our choice, because the "
            "paper does not give them, and nearly all prices are estimates."
        ),
        table_html(
            "The designs: checks measured on the files, and cost in whole packs.",
            ["design", "files", "checks passed", "checks failed", "for 1 sensor", "for 10 sensors"],
            map(_row, manifests, designs.values()),
            of_words=True,
        ),
    ]
    if failed:
        parts.append(paragraph(f"Failed: {'; '.join(failed)}."))
    for manifest, folder in zip(manifests, folders, strict=True):
        address = folder.relative_to(page_folder).as_posix()
        parts += [
            f"<h3>{html.escape(manifest['design'])}</h3>\n",
            _view(manifest["design"], address),
            gallery_html(_pictures(manifest["design"], folder)),
            _drawing(manifest["design"], folder),
            links_html((words, f"{address}/{name}") for name, words in LINKS.items()),
        ]
    if folders:
        viewer = f"{folders[0].relative_to(page_folder).as_posix()}/view/viewer.js"
        parts.append(f'<script src="{html.escape(viewer)}"></script>\n')
    parts.append(
        code("\n".join(f"wedge fabricate --design {each['design']}" for each in manifests))
    )
    return Section(title=TITLE, html="".join(parts))


def _view(design: str, address: str) -> str:
    """Where the view to turn is set up, once it is scrolled to; its model lies in the folder."""
    return (
        f'<div class="wedge-view" data-name="{html.escape(design)}"'
        f' data-model="{html.escape(address)}/view/model.js">'
        "<p>The 3D view needs JavaScript and the folder next to this page.</p></div>\n"
        '<p class="wedge-view-use">Drag to rotate, click and scroll to zoom, untick a part to '
        "hide it; the slider pulls the sensor apart.</p>\n"
    )


def _drawing(design: str, folder: Path) -> str:
    """The drawing, inside the page."""
    return figure_html(
        Picture(
            content=(folder / "drawing.svg").read_bytes(),
            alt=f"Drawing of the {design} sensor: section and face with the main "
            "dimensions, in millimetres",
            caption="The main dimensions, in millimetres.",
            wide=True,
        )
    )


def no_fabrication_section(reason: str) -> Section:
    """The sentence that stands where the files are missing."""
    return Section(title=TITLE, html=paragraph(f"Left out on this machine: {reason}"))


def _row(manifest: dict[str, Any], design: Wedge) -> list[str]:
    passed = sum(check["passed"] for check in manifest["checks"])
    lines = make_bill(manifest["bill"], parts_for(design, read_parts()))
    costs = [
        totals_text(lines, count).partition(": ")[2].strip().removesuffix(".") for count in (1, 10)
    ]
    counts = (len(manifest["files"]), passed, len(manifest["checks"]) - passed)
    return [manifest["design"], *map(str, counts), *costs]


def _pictures(design: str, folder: Path) -> list[Picture]:
    pictures = folder / "pictures"
    return [
        Picture(
            content=(pictures / "assembled_below.png").read_bytes(),
            alt=f"The assembled {design} sensor, seen from below: case, gel, adapter and cover",
            caption=f"The assembled {design} sensor, the gel toward you.",
            wordless=True,
        ),
        Picture(
            content=(pictures / "section.png").read_bytes(),
            alt=f"Section through the {design} sensor: rays from the camera via the mirror and "
            "through the acrylic to the gel",
            caption="Section along the finger, with rays from the camera via the mirror and "
            "through the acrylic to the gel.",
            wordless=True,
        ),
    ]
