# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""What was measured and what it is worth: as a page, as a sheet of paper, and for machines."""

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
from validation.figures.maps import blank, fit_box, outline, show_map, size_mm
from validation.figures.style import BLUE, INK, ORANGE, RED, SOFT, styled
from validation.report.page import bullets, paragraph, table_html

WORDS: dict[Grade, str] = {"A": "Pass, grade A", "B": "Pass, grade B", "fail": "Fail"}
COLORS: dict[Grade, str] = {"A": BLUE, "B": ORANGE, "fail": RED}
PAGE_IN = (8.27, 11.69)
"""A4."""
LEFT_IN = 0.7
ROW_IN = 0.33
COVERED = "where presses lie"
TALLEST_PICTURE_IN, PICTURES_GAP_IN = 2.4, 0.2


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
            f"{number(found.values[limit.name])} {limit.unit}".rstrip(),
            _bound(limit, limit.grade_a),
            _bound(limit, limit.grade_b),
            graded[limit.name],
            limit.reason,
        )
        for limit in _measured(found)
    ]


def sentence(limit: Limit, found: Acceptance) -> str:
    """What a failed limit says."""
    value = f"{number(found.values[limit.name])} {limit.unit}".rstrip()
    return f"{limit.title} is {value}, the limit is {_bound(limit, limit.grade_b)}"


def number(value: float) -> str:
    """Three digits that count, none below a ten-thousandth."""
    return f"{round(value, 4):.3g}" if math.isfinite(value) else "unknown"


@styled
def picture(found: Acceptance, mm_per_px: Pair) -> Figure:
    """The blank gel, its weakest light, and where the presses lie."""
    figure = blank(PAGE_IN[0], _picture_height_in(found, mm_per_px) + 0.5)
    _pictures(figure, found, mm_per_px, 0.3)
    return figure


def pdf_bytes(card: UnitCard, dataset: str, found: Acceptance) -> bytes:
    """The certificate on one sheet of A4."""
    figure = sheet(card, dataset, found)
    FigureCanvasPdf(figure)
    stream = io.BytesIO()
    figure.savefig(stream, format="pdf", metadata={"CreationDate": None, "Producer": None})
    return stream.getvalue()


@styled
def sheet(card: UnitCard, dataset: str, found: Acceptance) -> Figure:
    """Verdict, pictures, and every measurement with its limits and reason."""
    figure = blank(*PAGE_IN)
    grade = verdict(found.values)
    _say(figure, LEFT_IN, 0.75, f"GelSight Wedge {card.serial}", size=18.0)
    _say(figure, LEFT_IN, 1.15, WORDS[grade], size=15.0, color=COLORS[grade])
    for index, part in enumerate(_lead(card, dataset, found).split("; ")):
        _say(figure, LEFT_IN, 1.4 + 0.15 * index, part, size=8.0, color=SOFT)
    _pictures(figure, found, card.mm_per_px, 2.05)
    top = 2.05 + _picture_height_in(found, card.mm_per_px) + 0.4
    columns = (LEFT_IN, 3.6, 5.5, 6.3, 7.1)
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
    return figure


def page_html(card: UnitCard, dataset: str, found: Acceptance) -> str:
    """What failed first, then every measurement, and why its limits are where they are."""
    failed = [limit for limit in _measured(found) if grades(found.values)[limit.name] == "fail"]
    rows = [row[:5] for row in table_rows(found)]
    return (
        paragraph(_lead(card, dataset, found))
        + (
            bullets(f"{sentence(limit, found)}: {limit.reason}." for limit in failed)
            if failed
            else ""
        )
        + table_html("Measurements, limits and grades", ("", "value", "A", "B", "grade"), rows)
        + paragraph("Why these limits:")
        + bullets([f"{limit.title}: {limit.reason}." for limit in _measured(found)])
        + bullets(
            [f"Not measured: {k.replace('_', ' ')}: {why}." for k, why in found.absent.items()]
        )
    )


def _lead(card: UnitCard, dataset: str, found: Acceptance) -> str:
    judged = (
        "presses that it has not learnt from"
        if found.held_out
        else "presses of its own; errors are those that calibration measured on presses held out"
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
        ("blank gel", found.blank.clip(0, 1), "gray"),
        ("weakest light, of its brightest", even.min(-1), "cividis"),
        (COVERED, found.blank.mean(-1), "gray"),
    )
    width = _picture_width_in()
    for index, (title, values, colors) in enumerate(maps):
        left = LEFT_IN + index * (width + PICTURES_GAP_IN)
        box = fit_box(left, top_in, width, TALLEST_PICTURE_IN, size_mm(values, mm_per_px))
        image = show_map(figure, box, values, mm_per_px, title, colors=colors, limits=(0.0, 1.0))
        if title == COVERED:
            outline(image, found.covered, mm_per_px)


def _picture_width_in() -> float:
    return (PAGE_IN[0] - 2 * LEFT_IN - 2 * PICTURES_GAP_IN) / 3


def _picture_height_in(found: Acceptance, mm_per_px: Pair) -> float:
    size = size_mm(found.blank, mm_per_px)
    return fit_box(0.0, 0.0, _picture_width_in(), TALLEST_PICTURE_IN, size).height
