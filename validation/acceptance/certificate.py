# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""What was measured and what it is worth: as a page, as a sheet of paper, and for machines."""

import html
import io
import math
from collections.abc import Sequence
from typing import Any
from xml.etree import ElementTree

import numpy as np
from matplotlib.backends.backend_pdf import FigureCanvasPdf
from matplotlib.figure import Figure

from sensor.toml import Pair
from sensor.unit import UnitCard
from validation.acceptance.limits import LIMITS, Grade, Limit, grades, verdict
from validation.acceptance.measurements import Acceptance
from validation.figures.maps import Box, blank, fit_box, outline, show_map, size_mm
from validation.figures.style import BLUE, INK, ORANGE, RED, SOFT, styled

WORDS: dict[Grade, str] = {"A": "Pass, grade A", "B": "Pass, grade B", "fail": "Fail"}
COLORS: dict[Grade, str] = {"A": BLUE, "B": ORANGE, "fail": RED}
PAGE_IN = (8.27, 11.69)
"""A4."""
LEFT_IN = 0.7
ROW_IN = 0.33
PICTURE_HEIGHT_IN = 2.1


def document(card: UnitCard, dataset: str, found: Acceptance) -> dict[str, Any]:
    """The verdict, every measurement with its limits and reason, and what was not measured."""
    graded = grades(found.values)
    return {
        "unit": card.serial,
        "calibrated": card.created,
        "dataset": dataset,
        "presses": found.errors.test,
        "held_out": found.held_out,
        "grade": verdict(found.values),
        "measurements": [
            {
                "name": limit.name,
                "value": found.values[limit.name]
                if math.isfinite(found.values[limit.name])
                else None,
                "unit": limit.unit,
                "grade": graded[limit.name],
                "limit_a": limit.grade_a,
                "limit_b": limit.grade_b,
                "less_is_better": limit.less_is_better,
                "reason": limit.reason,
            }
            for limit in _measured(found)
        ],
        "not_measured": dict(found.absent),
    }


def junit_xml(card: UnitCard, dataset: str, found: Acceptance) -> bytes:
    """One test case a limit: what a build server shows as passed, failed or skipped."""
    graded = grades(found.values)
    failures = [name for name, grade in graded.items() if grade == "fail"]
    suite = ElementTree.Element(
        "testsuite",
        name=f"wedge accept {card.serial} {dataset}",
        tests=str(len(graded) + len(found.absent)),
        failures=str(len(failures)),
        errors="0",
        skipped=str(len(found.absent)),
    )
    for limit in _measured(found):
        case = ElementTree.SubElement(suite, "testcase", classname="accept", name=limit.name)
        if graded[limit.name] == "fail":
            failure = ElementTree.SubElement(case, "failure", message=sentence(limit, found))
            failure.text = limit.reason
    for name, reason in found.absent.items():
        case = ElementTree.SubElement(suite, "testcase", classname="accept", name=name)
        ElementTree.SubElement(case, "skipped", message=reason)
    ElementTree.indent(suite)
    return ElementTree.tostring(suite, encoding="utf-8", xml_declaration=True) + b"\n"


def table_rows(found: Acceptance) -> list[tuple[str, str, str, str, Grade, str]]:
    """Title, value, limit of A, limit of B, grade and reason of each measurement."""
    graded = grades(found.values)
    return [
        (
            limit.title,
            f"{number(found.values[limit.name])} {limit.unit}",
            _bound(limit, limit.grade_a),
            _bound(limit, limit.grade_b),
            graded[limit.name],
            limit.reason,
        )
        for limit in _measured(found)
    ]


def sentence(limit: Limit, found: Acceptance) -> str:
    """What a failed limit says."""
    value = f"{number(found.values[limit.name])} {limit.unit}"
    return f"{limit.title} is {value}, the limit is {_bound(limit, limit.grade_b)}"


def number(value: float) -> str:
    """Three digits that count."""
    return f"{value:.3g}" if math.isfinite(value) else "unknown"


@styled
def picture(found: Acceptance, mm_per_px: Pair) -> Figure:
    """The blank gel, its weakest light, and where the presses lie."""
    figure = blank(PAGE_IN[0], PICTURE_HEIGHT_IN + 0.4)
    _pictures(figure, found, mm_per_px, 0.3)
    return figure


@styled
def pdf_bytes(card: UnitCard, dataset: str, found: Acceptance) -> bytes:
    """The certificate on one sheet of A4."""
    figure = blank(*PAGE_IN)
    FigureCanvasPdf(figure)
    grade = verdict(found.values)
    _say(figure, LEFT_IN, 0.75, f"GelSight Wedge {card.serial}", size=18.0)
    _say(figure, LEFT_IN, 1.15, WORDS[grade], size=15.0, color=COLORS[grade])
    _say(figure, LEFT_IN, 1.42, _lead(card, dataset, found), size=8.5, color=SOFT)
    _pictures(figure, found, card.mm_per_px, 1.85)
    top = 1.85 + PICTURE_HEIGHT_IN + 0.35
    columns = (LEFT_IN, 3.4, 5.05, 6.0, 6.95)
    for left, heading in zip(columns, ("measured", "value", "A", "B", "grade"), strict=True):
        _say(figure, left, top, heading, size=8.0, color=SOFT)
    for index, (title, value, a, b, mark, reason) in enumerate(table_rows(found)):
        row = top + 0.22 + ROW_IN * index
        for left, text in zip(columns, (title, value, a, b), strict=False):
            _say(figure, left, row, text, size=8.5)
        _say(figure, columns[-1], row, mark, size=8.5, color=COLORS[mark])
        _say(figure, LEFT_IN, row + 0.14, reason, size=6.5, color=SOFT)
    below = top + 0.4 + ROW_IN * len(found.values)
    for index, (name, reason) in enumerate(found.absent.items()):
        text = f"Not measured: {name.replace('_', ' ')}: {reason}"
        _say(figure, LEFT_IN, below + 0.16 * index, text, size=7.0, color=SOFT)
    stream = io.BytesIO()
    figure.savefig(stream, format="pdf", metadata={"CreationDate": None, "Producer": None})
    return stream.getvalue()


def page_html(card: UnitCard, dataset: str, found: Acceptance) -> str:
    """Verdict, failures first, the table: the body of the page, without the pictures."""
    grade = verdict(found.values)
    failed = [limit for limit in _measured(found) if grades(found.values)[limit.name] == "fail"]
    items = "".join(
        f"<li>{html.escape(sentence(limit, found))}: {html.escape(limit.reason)}.</li>"
        for limit in failed
    )
    rows = "".join(
        f"<tr><td>{html.escape(title)}</td><td>{html.escape(value)}</td><td>{html.escape(a)}</td>"
        f"<td>{html.escape(b)}</td><td><b>{mark}</b></td><td>{html.escape(reason)}</td></tr>"
        for title, value, a, b, mark, reason in table_rows(found)
    )
    absent = "".join(
        f"<li>{html.escape(name.replace('_', ' '))}: {html.escape(reason)}.</li>"
        for name, reason in found.absent.items()
    )
    return (
        f"<p><strong>{WORDS[grade]}.</strong> {html.escape(_lead(card, dataset, found))}</p>"
        + (f"<ul>{items}</ul>" if items else "")
        + '<div class="scroll"><table><thead><tr><th>measured</th><th>value</th><th>A</th>'
        f"<th>B</th><th>grade</th><th>why</th></tr></thead><tbody>{rows}</tbody></table></div>"
        + (f"<p>Not measured:</p><ul>{absent}</ul>" if absent else "")
    )


def _lead(card: UnitCard, dataset: str, found: Acceptance) -> str:
    judged = (
        "presses that it has not learnt from"
        if found.held_out
        else "its own presses; errors are those that calibration measured on presses held out"
    )
    return (
        f"Calibrated {card.created} with {card.estimator}; judged on {dataset}, "
        f"{found.errors.test} {judged}."
    )


def _finite(value: float) -> float | None:
    """JSON knows no infinity."""
    return value if math.isfinite(value) else None


def _measured(found: Acceptance) -> Sequence[Limit]:
    return [limit for limit in LIMITS if limit.name in found.values]


def _bound(limit: Limit, value: float) -> str:
    return f"{'≤' if limit.less_is_better else '≥'} {value:g}"


def _say(
    figure: Figure, left_in: float, top_in: float, text: str, *, size: float, color: str = INK
) -> None:
    width_in, height_in = figure.get_size_inches()
    figure.text(left_in / width_in, 1 - top_in / height_in, text, fontsize=size, color=color)


def _pictures(figure: Figure, found: Acceptance, mm_per_px: Pair, top_in: float) -> None:
    even = found.evenness / np.maximum(np.quantile(found.evenness, 0.98, axis=(0, 1)), 1e-6)
    maps = (
        ("blank gel", found.blank.clip(0, 1), None),
        ("weakest light, of its brightest", even.min(-1), "cividis"),
        ("where presses lie", found.blank.mean(-1), "gray"),
    )
    width = (PAGE_IN[0] - 2 * LEFT_IN - 0.4) / 3
    for index, (title, values, colors) in enumerate(maps):
        place = Box(
            left=LEFT_IN + index * (width + 0.2), top=top_in, width=width, height=PICTURE_HEIGHT_IN
        )
        box = fit_box(place.left, place.top, width, PICTURE_HEIGHT_IN, size_mm(values, mm_per_px))
        limits = (0.0, 1.0) if colors else None
        chosen = {"colors": colors} if colors else {}
        image = show_map(figure, box, values, mm_per_px, title, limits=limits, **chosen)
        if index == 2:
            outline(image, found.covered, mm_per_px)
