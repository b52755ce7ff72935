# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Writes the measured tables of the pages from what ``wedge reproduce`` measured; none by hand.

What lies between ``<!-- table: DATASET [WORD...] -->`` and ``<!-- end of table -->`` of a page is
replaced, by the rows whose lights, estimator or pixels are the words; likewise ``<!-- bench -->``,
``<!-- speed -->``, how fast frames become depth, ``<!-- filling -->``, what ways of filling dots
leave and take, and ``<!-- network: DATASET -->``, what the network leaves of errors without it.
After a new measurement:

    wedge reproduce
    cp build/error_table.json docs/measured/
    wedge bench --json docs/measured/bench.json
    python docs/measured/tables.py
"""

import json
import re
from pathlib import Path
from typing import Any

from recon.markers.filling import METHODS
from validation.intervals import remark
from validation.table_text import DIGITS, HEADINGS, depth_sentence, line_name, split_words

USED = "surface"
"""The way of filling that units use."""
HERE = Path(__file__).resolve().parent
PAGES = (
    HERE.parents[1] / "README.md",
    HERE / "index.md",
    HERE / "performance.md",
    HERE.parent / "concepts" / "streaming.md",
    HERE.parent / "concepts" / "markers.md",
)
BLOCK = re.compile(r"(<!-- table: ([\w-]+)([\w+% ]*) -->\n).*?(<!-- end of table -->)", re.DOTALL)
BENCH = re.compile(r"(<!-- bench -->\n).*?(<!-- end of bench -->)", re.DOTALL)
SPEED = re.compile(r"(<!-- speed -->\n).*?(<!-- end of speed -->)", re.DOTALL)
FRAMES = {
    "`default`, ball presses": " by our estimator, these presses",
    "`default`, the whole pad pressed": " by our estimator, all of the gel pressed",
    "`default`, a gel with dots": " by our estimator, dots at rest",
    "`default`, lights on one line": " by our estimator, red and blue alone",
    "`mlp`, ball presses": "",
}
"""What is reconstructed, and how ``wedge bench`` calls it."""
FILLING = re.compile(r"(<!-- filling -->\n).*?(<!-- end of filling -->)", re.DOTALL)
NETWORK = re.compile(r"(<!-- network: ([\w-]+) -->\n).*?(<!-- end of network -->)", re.DOTALL)


def filled(page: str) -> str:
    """The text of a page with its tables as the JSON files have them."""

    def table(found: re.Match[str]) -> str:
        return f"{found[1]}\n{_table(found[2], found[3].split())}\n{found[4]}"

    page = BLOCK.sub(table, page)
    page = NETWORK.sub(lambda found: f"{found[1]}\n{_network(found[2])}\n{found[3]}", page)
    page = SPEED.sub(lambda found: f"{found[1]}\n{_speed()}\n{found[2]}", page)
    page = FILLING.sub(lambda found: f"{found[1]}\n{_filling()}\n{found[2]}", page)
    return BENCH.sub(lambda found: f"{found[1]}\n{_bench()}\n{found[2]}", page)


def _figures() -> list[dict[str, Any]]:
    return list(json.loads((HERE / "bench.json").read_text())["figures"])


def _speed() -> str:
    """Frames per second, and times the floor."""
    figures = {figure["name"]: figure for figure in _figures()}
    lines = ["| | 640×480 | times the floor | 320×240 | times the floor |", "|---|--:|--:|--:|--:|"]
    for frames, name in FRAMES.items():
        cells = []
        for size in ("640x480", "320x240"):
            start = f"fast path: {size} JPEG to depth{name}"
            ratio = figures[
                f"{start}{', against its floor' if name else ' against its floor, one thread'}"
            ]
            timed = ratio if name else figures[f"{start}, one thread"]
            (rate,) = re.findall(r"(\d+) frames/s", timed["unit"])
            cells += [rate, f"{ratio['value']:.2g}"]
        lines.append(f"| {frames} | {' | '.join(cells)} |")
    return "\n".join(lines) + "\n"


def _filling() -> str:
    values = {figure["name"]: figure["value"] for figure in _figures()}
    lines = [
        "| method | slope error under dots, relative to `nearest` | depth error by dots [µm] |"
        " 200 × 150 [ms] | 320 × 240 [ms] |",
        "|---|--:|--:|--:|--:|",
    ]
    for method in METHODS:
        slope = values[f"{method}: slope error under dots against nearest, three caps, noise 0.05"]
        depth_mm = values[f"{method}: depth error that dots add, three caps, noise 0.05"]
        small, large = (
            values[f"{method}: fill a frame of {size}, dots at rest"]
            for size in ("200x150", "320x240")
        )
        name = f"{method} (`griddata`)" if method in ("linear", "cubic") else method
        name = f"**{name}**" if method == USED else name
        lines.append(f"| {name} | {slope:.2f} | {1e3 * depth_mm:.2g} | {small:.2g} | {large:.2g} |")
    return "\n".join(lines) + "\n"


def _bench() -> str:
    figures = _figures()
    lines = ["| figure | measured | bar | unit |", "|---|--:|--:|---|"]
    for figure in figures:
        bar = "" if figure["bar"] is None else f"≤ {figure['bar']:.3g}"
        name = figure["name"].replace("|", "\\|")
        value = "none" if figure["value"] is None else f"{figure['value']:.3g}"
        lines.append(f"| {name} | {value} | {bar} | {figure['unit']} |")
    return "\n".join(lines) + "\n"


def _table(dataset: str, words: list[str]) -> str:
    document = _document(dataset)
    rows = [
        row
        for row in document["rows"]
        if {row["configuration"], row["estimator"], row["pixels"]} >= set(words)
    ]
    estimators = {row["estimator"] for row in rows}
    headings = ["lights", "estimator", "pixels", *HEADINGS.values()]
    lines = ["| " + " | ".join(headings) + " |", "|---|---|---|" + "--:|" * len(HEADINGS)]
    lines += ["| " + " | ".join(_cells(row)) + " |" for row in rows]
    lines += ["", _caption(document)]
    for depth in (one for one in document["depth"] if one["estimator"] in estimators):
        lines += ["", depth_sentence(depth["estimator"], depth)]
    return "\n".join(lines) + "\n"


def _document(dataset: str) -> dict[str, Any]:
    tables = json.loads((HERE / "error_table.json").read_text())["tables"]
    (document,) = (table for table in tables if table["dataset"] == dataset)
    return dict(document)


def _network(dataset: str) -> str:
    """Errors with the network over those without: of the axis that is not seen, and the other."""
    rows = {
        (row["estimator"], row["configuration"], row["missing_axis"]): row
        for row in _document(dataset)["rows"]
        if row["pixels"] == "contact+5%"
    }
    unseen, seen = (
        {
            key[:2]: rows[key][metric] / rows[*key[:2], "zero"][metric]
            for key in rows
            if key[2] == "network"
        }
        for metric in ("gx_mae", "gy_mae")
    )
    return (
        "On contact+5%, the error of the unseen axis with the network, as a share of that without "
        f"it, is\n{unseen['mlp', 'RB']:.2f} for RB and {unseen['mlp', 'R']:.2f} for R with `mlp`, "
        f"and {unseen['default', 'RB']:.2f} and {unseen['default', 'R']:.2f} with `default`, which "
        f"also gives it a hint.\nThe share is {min(seen.values()):.2f} to "
        f"{max(seen.values()):.2f} for the seen axis, as both slopes become those of one surface.\n"
        "If no colour changed, the inferred slope is set to zero.\n"
    )


def _cells(row: dict[str, Any]) -> list[str]:
    values = []
    for key, digits in DIGITS.items():
        ends = "–".join(f"{end:.{digits}f}" for end in row["ci95"][key] or ())
        values.append(f"{row[key]:.{digits}f}" + f"<br>{ends}" * bool(ends))
    lights = line_name(row["configuration"], row["missing_axis"])
    return [lights, row["estimator"], row["pixels"], *values]


def _caption(document: dict[str, Any]) -> str:
    presses, folds = document["presses"], document["folds"]
    split = split_words(presses["train"], presses["test"], folds)
    options = f" --folds {folds}" * (folds > 1) + f" --seed {document['seed']}"
    slopes = ", ".join(
        f"{value:.2f} on {pixels}" for pixels, value in document["mean_abs_gradient"].items()
    )
    intervals = remark("with the 95 % interval over presses below each", presses["test"])
    return (
        f"Mean absolute errors ({split}), {intervals}. "
        f"Mean \\|G\\| {slopes}. "
        f"Made with `wedge table {document['dataset']}{options}`."
    )


if __name__ == "__main__":
    for page in PAGES:
        page.write_text(filled(page.read_text()))
