# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""What was measured and what it is worth: in words, as a page, and for machines."""

import math
import re
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any
from xml.etree import ElementTree

from sensor.unit import UnitCard
from validation.acceptance.limits import (
    COUNTED,
    GROUPS,
    LIMITS,
    Grade,
    Limit,
    Parts,
    grade_of,
    grades,
    verdict,
)
from validation.acceptance.measurements import Acceptance
from validation.intervals import Interval, counted, enough
from validation.report.page import Tile, bullets, paragraph, table_html, tiles_html

WORDS: dict[Grade, str] = {"A": "Pass, grade A", "B": "Pass, grade B", "fail": "Fail"}
TILES = ("theta_x_deg", "theta_y_deg", "depth_rmse_share")
"""Measurements in large type, where they were made."""
NOT_IN_XML = re.compile("[^\t\n\r -\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")
"""Characters that no XML file may hold: https://www.w3.org/TR/xml/#charsets."""


MOST_NAMED = 3
"""Presses left out, each with its reason; JSON has all."""
HASH_DIGITS = 12
"""Shown of a hash; JSON has all."""


@dataclass(frozen=True, kw_only=True)
class Occasion:
    """On what, when and by what a unit was judged."""

    dataset: str
    dataset_sha256: str
    judged: str
    """The day, YYYY-MM-DD."""
    software: str
    """Version of this package."""


@dataclass(frozen=True, kw_only=True)
class Line:
    """One measurement as it is shown."""

    group: str
    title: str
    value: str
    limit_a: str
    limit_b: str
    grade: Grade
    reason: str

    @property
    def cells(self) -> tuple[str, str, str, str, str]:
        """All but the group and the reason."""
        return self.title, self.value, self.limit_a, self.limit_b, self.grade


def document(card: UnitCard, occasion: Occasion, found: Acceptance) -> dict[str, Any]:
    """The verdict, every measurement with its limits and reason, and what was not measured."""
    return {
        "unit": card.serial,
        "calibrated": card.created,
        "design_sha256": card.design_sha256,
        "judged": occasion.judged,
        "software": occasion.software,
        "dataset": occasion.dataset,
        "dataset_sha256": occasion.dataset_sha256,
        "presses": found.presses,
        "learnt_presses": found.learnt,
        "errors_from": "dataset" if found.errors else "calibration",
        "held_out_presses": found.held_out,
        "mean_abs_gradient": found.mean_abs_gradient,
        "left_out": [asdict(press) for press in found.left_out],
        "doubts": list(found.doubts),
        "grade": verdict(found.values),
        "measurements": [
            {
                "name": limit.name,
                "value": limit.worst(found.values[limit.name])[1],
                "parts": {part: value for part, value in found.values[limit.name].items() if part},
                "ci95": list(found.intervals[limit.name])
                if limit.name in found.intervals
                else None,
                "unit": _plain_unit(limit),
                "grade": grade_of(limit, found.values[limit.name]),
                "limit_a": limit.grade_a,
                "limit_b": limit.grade_b,
                "less_is_better": limit.less_is_better,
                "reason": limit.reason,
            }
            for limit in measured_limits(found)
        ],
        "not_measured": dict(found.absent),
    }


def junit_xml(card: UnitCard, dataset: str, found: Acceptance) -> bytes:
    """One test case a limit: what a build server shows as passed, failed or skipped."""
    graded = grades(found.values)
    failures = [name for name, grade in graded.items() if grade == "fail"]
    suite = ElementTree.Element(
        "testsuite",
        name=NOT_IN_XML.sub("\ufffd", f"wedge accept {card.serial} {dataset}"),
        tests=str(len(graded) + len(found.absent)),
        failures=str(len(failures)),
        errors="0",
        skipped=str(len(found.absent)),
    )
    for limit in measured_limits(found):
        case = ElementTree.SubElement(suite, "testcase", classname="accept", name=limit.name)
        if graded[limit.name] == "fail":
            failure = ElementTree.SubElement(case, "failure", message=sentence(limit, found))
            failure.text = limit.reason
    for name, reason in found.absent.items():
        case = ElementTree.SubElement(suite, "testcase", classname="accept", name=name)
        ElementTree.SubElement(case, "skipped", message=reason)
    ElementTree.indent(suite)
    return ElementTree.tostring(suite, encoding="utf-8", xml_declaration=True) + b"\n"


def lines(found: Acceptance) -> list[Line]:
    """Every measurement as it is shown, in the order of the limits."""
    return [
        Line(
            group=limit.group,
            title=limit.title,
            value=shown_value(limit, found.values[limit.name], found.intervals.get(limit.name)),
            limit_a=_bound(limit, limit.grade_a),
            limit_b=_bound_b(limit),
            grade=grade_of(limit, found.values[limit.name]),
            reason=limit.reason,
        )
        for limit in measured_limits(found)
    ]


def sentence(limit: Limit, found: Acceptance) -> str:
    """What a failed limit says."""
    part, value = limit.worst(found.values[limit.name])
    of = f" ({part})" if part else ""
    return (
        f"{limit.title}{of}: {number(limit, value)}{_unit(limit)}, "
        f"limit {_bound(limit, limit.grade_b)}"
    )


def failures(found: Acceptance) -> list[str]:
    """A sentence with its reason for each limit that failed."""
    graded = grades(found.values)
    return [
        f"{sentence(limit, found)} ({limit.reason})."
        for limit in measured_limits(found)
        if graded[limit.name] == "fail"
    ]


def shown_value(limit: Limit, parts: Parts, interval: Interval | None = None) -> str:
    """Each part's number with its name, in brackets the interval, and the unit."""
    shown = "  ".join(f"{part} {number(limit, value)}".strip() for part, value in parts.items())
    ends = f" [{', '.join(number(limit, end) for end in interval)}]" if interval else ""
    return f"{shown}{ends}{_unit(limit)}"


def _unit(limit: Limit) -> str:
    """As it stands behind a number: degrees without a space."""
    return limit.unit if limit.unit == "°" else f" {limit.unit}"


def number(limit: Limit, value: float) -> str:
    """Three digits that count, none below a hundredth of what is shown."""
    if not math.isfinite(value):
        return "unknown"
    value *= limit.shown_times
    if limit.unit in COUNTED:
        return f"{value:.3g}"
    return f"{value:.{2 if abs(value) < 9.995 else 1 if abs(value) < 99.95 else 0}f}"


def not_measured(found: Acceptance) -> list[str]:
    """What was not measured, by its reason."""
    titles = {limit.name: limit.title for limit in LIMITS}
    reasons: dict[str, list[str]] = {}
    for name, reason in found.absent.items():
        reasons.setdefault(reason, []).append(titles[name])
    return [f"Not measured: {', '.join(names)} ({reason})." for reason, names in reasons.items()]


def page_html(card: UnitCard, occasion: Occasion, found: Acceptance, pictures: str) -> str:
    """The verdict in large type, what failed, pictures, and every measurement with its limits."""
    shown = lines(found)
    parts = [
        tiles_html(_tiles(card, found)),
        paragraph(f"{lead(card, occasion, found)} {origin(card, occasion)}"),
        bullets(said) if (said := [*failures(found), *remarks(found)]) else "",
        pictures,
    ]
    for group in GROUPS:
        rows = [
            (f"{line.title}\n{line.reason}", *line.cells[1:])
            for line in shown
            if line.group == group
        ]
        if rows:
            headings = ("measured, and the reason for its limits", "value", "A", "B", "grade")
            parts.append(table_html(f"{group}.", headings, rows))
    return "".join(parts) + bullets(not_measured(found))


def remarks(found: Acceptance) -> list[str]:
    """What is doubtful about the presses, and which of them were left out."""
    left_out = found.left_out
    if not left_out:
        return list(found.doubts)
    named = "; ".join(f"{press.file}: {press.reason}" for press in left_out[:MOST_NAMED])
    more = f"; and {len(left_out) - MOST_NAMED} more" if len(left_out) > MOST_NAMED else ""
    return [*found.doubts, f"Left out {counted(len(left_out))}: {named}{more}."]


def lead(card: UnitCard, occasion: Occasion, found: Acceptance) -> str:
    """What was judged on what, on how many presses its errors rest, and how steep they were."""
    steep = found.mean_abs_gradient
    slopes = f" Slopes on contact were {steep:.2f} on average (mean |G|)." if steep == steep else ""
    return (
        f"Calibrated {card.created} with {card.estimator}, judged on {occasion.dataset}, "
        f"{counted(found.presses)}{_rests_on(found)}{_certainty(found)}.{slopes}"
    )


def _rests_on(found: Acceptance) -> str:
    """Which presses the errors are of."""
    if not found.learnt:
        return " that it was not calibrated on"
    count = "all" if found.learnt == found.presses else f"{found.learnt}"
    learnt = f", {count} of which it was calibrated on: errors are those"
    if found.errors:
        return f"{learnt} of the {found.errors.test} others"
    presses = "presses" if found.held_out is None else counted(found.held_out)
    return f"{learnt} that the calibration measured on {presses} held out"


def origin(card: UnitCard, occasion: Occasion) -> str:
    """When and by what a unit was judged, and the hashes that tell its design and presses."""
    design = card.design_sha256
    of_design = (
        "no design was named" if design is None else f"the design's with {design[:HASH_DIGITS]}"
    )
    return (
        f"Judged {occasion.judged} by wedge {occasion.software}. The dataset's hash (SHA-256) "
        f"begins with {occasion.dataset_sha256[:HASH_DIGITS]}, {of_design}."
    )


def _certainty(found: Acceptance) -> str:
    """What is said of the errors' intervals."""
    if found.held_out is not None and not enough(found.held_out):
        return ", too few for an interval"
    if found.intervals:
        return ", with 95 % intervals of the errors in brackets"
    return ", without intervals, which this unit does not contain: calibrate it again to get them"


def measured_limits(found: Acceptance) -> Sequence[Limit]:
    """The limits of what was measured."""
    return [limit for limit in LIMITS if limit.name in found.values]


def _tiles(card: UnitCard, found: Acceptance) -> list[Tile]:
    graded = list(grades(found.values).values())
    counts = ", ".join(f"{graded.count(g)} {g}" for g in ("A", "B", "fail") if g in graded)
    verdict_tile = Tile(
        label=f"Sensor {card.serial}",
        value={"A": "Grade A", "B": "Grade B", "fail": "Fail"}[verdict(found.values)],
        note=f"the worst grade decides: {counts}",
    )
    return [verdict_tile, *(_tile(x, found) for x in measured_limits(found) if x.name in TILES)]


def _tile(limit: Limit, found: Acceptance) -> Tile:
    """A measurement in degrees or in per cent of the depth."""
    is_angle = limit.unit == "°"
    bounds = f"A {_bound(limit, limit.grade_a)}, B {_bound(limit, limit.grade_b)}"
    note = ("" if is_angle else "of the depth; ") + bounds.replace("≤ ", "≤\u00a0")
    if limit.name in found.intervals:
        low, high = (number(limit, end) for end in found.intervals[limit.name])
        note += f"; 95\u00a0% interval {low} to {high}"
    _, worst = limit.worst(found.values[limit.name])
    return Tile(
        label=limit.title, value=number(limit, worst) + ("°" if is_angle else " %"), note=note
    )


def _plain_unit(limit: Limit) -> str:
    """Of the JSON's numbers, where shares are shares."""
    return limit.unit.removeprefix("%").strip() if limit.shown_times != 1 else limit.unit


def _bound(limit: Limit, value: float) -> str:
    sign = "≤" if limit.less_is_better else "≥"
    # Half a colour is no colour: what is counted has whole limits.
    whole = math.floor(value) if limit.unit in COUNTED else value
    return f"{sign} {limit.shown_times * whole:g}"


def _bound_b(limit: Limit) -> str:
    """Grade B's limit; a dash where a count cannot lie between those of A and B."""
    bound = _bound(limit, limit.grade_b)
    return "–" if bound == _bound(limit, limit.grade_a) else bound
