# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Pages that work offline: the sensor to turn around with files and checks, and the guide."""

import base64
import json
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from html import escape
from importlib.resources import files
from typing import Any

import numpy as np
import trimesh
from markdown_it import MarkdownIt

from cad.exports.views import color_of, pulled_apart
from cad.manifest import size_words
from cad.steps import Assembly
from sensor.design import Wedge

_STEPS = 65_000
"""Steps that the sensor's longest side is divided into: some micrometres each."""
_SHOWN = {
    "assembled_above": "The assembled sensor from above",
    "assembled_below": "The assembled sensor from below, the gel toward you",
    "drawing": "The main dimensions, in millimetres",
    "exploded": "Exploded view: every part moved out along its assembly path",
    "section": "Section along the finger, with rays from the camera via the mirror to the gel",
    "wiring": "The wiring: supply, resistor board and LED arrays",
}
"""What the pictures show, by their files' names; others are of a part or a step."""


def view_files(
    design: Wedge, assembly: Assembly, meshes: Mapping[str, trimesh.Trimesh]
) -> Iterator[tuple[str, bytes]]:
    """(name, content) of the view to turn: the model, and the script that shows it.

    Both are scripts, which a page may take from the disk, where it may not fetch data.
    """
    corners = np.array([mesh.bounds for mesh in meshes.values()])
    low, high = corners[:, 0].min(axis=0), corners[:, 1].max(axis=0)
    step = float((high - low).max()) / _STEPS
    shift = pulled_apart(assembly)
    bodies = [
        {
            "name": name,
            "color": color_of(assembly.bodies[name].part),
            "apart": [round(float(value), 3) for value in shift[name]],
            "points": _base64(np.round((mesh.vertices - low) / step).astype("<u2")),
            "corners": _base64(_corners(mesh)),
        }
        for name, mesh in meshes.items()
    ]
    model = {"low": low.tolist(), "high": high.tolist(), "step": step, "bodies": bodies}
    name = json.dumps(design.name)
    text = f"(window.wedgeModels = window.wedgeModels || {{}})[{name}] = {json.dumps(model)};\n"
    yield "model.js", text.encode("ascii")
    yield "viewer.js", files("cad").joinpath("data", "viewer.js").read_bytes()


def _corners(mesh: trimesh.Trimesh) -> np.ndarray:
    assert len(mesh.vertices) <= 65_536, "a body of the assembly has too many points to be shown"
    return np.asarray(mesh.faces, "<u2")


def page_html(
    design: Wedge,
    manifest: Mapping[str, Any],
    names: Mapping[str, str],
    steps: Sequence[str],
    paths: Sequence[str],
) -> str:
    """The page.

    Args:
        design: The sensor.
        manifest: Its size, parts and checks.
        names: What people call each part, by id.
        steps: The titles of the guide's steps.
        paths: The files of the folder that the page shows and links.
    """
    template = files("cad").joinpath("data", "page.html").read_text(encoding="utf-8")
    shown = [path for path in paths if path.endswith((".png", ".svg"))]
    linked = [
        path
        for path in paths
        if path not in shown and not path.startswith(("print", "step")) and not path.endswith(".js")
    ]
    linked.insert(0, "step/assembly.step")
    failed = sum(not check["passed"] for check in manifest["checks"])
    values = {
        "WARNING": _warning(failed) if failed else "",
        "NAME": escape(design.name),
        "HASH": design.sha256[:8],
        "WIDTH": f"{design.outer_width_mm:g}",
        "SIZE": size_words(manifest["bounding_box_mm"]),
        "PICTURES": "".join(_figure(path, _shown(path, names, steps)) for path in shown),
        "LINKS": _links(linked),
        "PARTS": _parts(manifest["parts"], names),
        "CHECKS": _checks(manifest["checks"]),
    }
    return _filled(template, values)


def guide_html(guide: str) -> str:
    """The guide's Markdown as a page to read or print, its pictures beside it."""
    template = files("cad").joinpath("data", "guide.html").read_text(encoding="utf-8")
    title = escape(guide.partition("\n")[0].removeprefix("# "))
    body = MarkdownIt("commonmark", {"html": False}).enable("table").render(guide)
    return _filled(template, {"TITLE": title, "BODY": body})


def _filled(template: str, values: Mapping[str, str]) -> str:
    """The template with its @NAMES@ replaced, not what looks like one in a design's own name."""
    return re.sub("@([A-Z]+)@", lambda found: values[found[1]], template)


def _warning(failed: int) -> str:
    checks = "check" if failed == 1 else "checks"
    return (
        f'<p class="warning">Do not build from this folder: <a href="#checks">{failed} {checks}'
        " failed</a>.</p>"
    )


def _base64(values: np.ndarray) -> str:
    return base64.b64encode(np.ascontiguousarray(values).tobytes()).decode("ascii")


def _shown(path: str, names: Mapping[str, str], steps: Sequence[str]) -> str:
    """What a picture shows, in words."""
    stem = path.rpartition("/")[2].rpartition(".")[0]
    kind, _, which = stem.partition("_")
    if kind == "part":
        return names[which]
    if kind == "step":
        return f"Step {int(which)}: {steps[int(which) - 1]}"
    return _SHOWN[stem]


def _figure(path: str, words: str) -> str:
    return (
        f'<figure><a href="{escape(path)}"><img loading="lazy" src="{escape(path)}"'
        f' alt="{escape(words)}"></a><figcaption>{escape(words)}</figcaption></figure>'
    )


def _links(paths: Sequence[str]) -> str:
    """A line for each folder, those beside the page first."""
    folders = sorted({path.rpartition("/")[0] for path in paths})
    lines = []
    for folder in folders:
        inside = [path for path in paths if path.rpartition("/")[0] == folder]
        links = " · ".join(_link(path, path.rpartition("/")[2]) for path in inside)
        lines.append(f'<p class="files">{f"{escape(folder)}/ " if folder else ""}{links}</p>')
    return "".join(lines)


def _link(path: str, name: str | None = None) -> str:
    return f'<a href="{escape(path)}">{escape(name or path)}</a>'


def _parts(parts: Iterable[Mapping[str, Any]], names: Mapping[str, str]) -> str:
    rows = [
        "<tr><th>part<th>quantity<th>material<th>size in the sensor, mm<th>mass, g<th>files</tr>"
    ]
    for part in parts:
        key = part["id"]
        paths = [f"print/{key}.stl", f"print/{key}.3mf", f"step/{key}.step"]
        links = " ".join(_link(path) for path in paths) if "print" in part else ""
        size = " x ".join(f"{value:g}" for value in part["bounding_box_mm"])
        count = part["quantity"] or f"1, {part['print']['note']}"
        rows.append(
            f"<tr><td>{escape(names[key])}<td>{escape(str(count))}"
            f"<td>{escape(part['material'])}<td>{size}<td>{part['mass_g']:g}<td>{links}</tr>"
        )
    return "".join(rows)


def _checks(checks: Iterable[Mapping[str, Any]]) -> str:
    rows = ["<tr><th>check<th>of<th>figure<th>bound<th>detail</tr>"]
    for check in checks:
        mark = "" if check["passed"] else ' class="bad"'
        rows.append(
            f"<tr{mark}><td>{escape(check['check'])}<td>{escape(check['subject'])}"
            f"<td>{check['value']:.4g} {escape(check['unit'])}<td>{escape(check['bound'])}"
            f"<td>{escape(check['detail'])}</tr>"
        )
    return "".join(rows)
