# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Tables of errors: numbers, intervals, and the paper beside them."""

import re
from dataclasses import replace

import pytest

from tests.validation.report.html_page import Page
from validation.error_table import Row, configurations
from validation.paper import PAPER_TABLE, paper_errors
from validation.report.page import Section
from validation.report.results import (
    DatasetResults,
    dataset_section,
    headline_section,
    truth_of_peaks,
)


def test_tables_can_be_read_aloud(text: str) -> None:
    page = Page(text)
    assert len(page.all("caption")) == len(page.all("table")) >= 5
    assert all(heading.get("scope") in ("row", "col") for heading in page.all("th"))
    regions = [a for tag, a in page.tags if "scroll" in a.get("class", "")]
    assert regions and all(a["tabindex"] == "0" and a["aria-label"] for a in regions)


def test_rows_have_as_many_cells_as_headings(text: str) -> None:
    for table in re.findall(r"<table.*?</table>", text, re.DOTALL):
        counts = {len(re.findall(r"<t[hd]\b", row)) for row in re.findall(r"<tr.*?</tr>", table)}
        assert len(counts) == 1


def test_the_papers_values_stand_beside_its_six_configurations(text: str) -> None:
    for values in PAPER_TABLE.values():
        assert f"<td>{values['theta_x_deg']:.2f}</td>" in text
        assert f"<td>{values['gx_mae']:.3f}</td>" in text


@pytest.mark.parametrize(
    ("lights_deg", "beside"),
    [
        ({"R": 90.0, "G": 180.0, "B": -90.0}, set(PAPER_TABLE)),
        ({"R": 0.0, "G": -120.0, "B": 120.0}, {("RG", "none"), ("RGB", "none")}),
    ],
)
def test_an_axis_that_other_lights_leave_unseen_is_not_held_against_the_papers(lights_deg, beside):
    lines = [
        (channels, missing)
        for channels, every in configurations(lights_deg).items()
        for missing in every
    ]
    assert ("R", "network") in lines
    assert set(paper_errors(lines)) == beside


def test_numbers_are_the_tables(results: DatasetResults, text: str) -> None:
    for pixels in ("contact", "contact+5%"):
        errors = results.row(pixels).errors
        low, high = errors.ci95["theta_x_deg"]
        assert f"{errors.values['theta_x_deg']:.2f}<small>{low:.2f}–{high:.2f}</small>" in text
    assert results.row("contact").configuration == "RGB"
    assert results.dataset.sha256 in text


def test_what_depths_are_judged_against_is_said(text: str) -> None:
    file, both = truth_of_peaks({"truth file"}), truth_of_peaks({"truth file", "ball cap"})
    assert "The truth is the ball" in text and "cap" not in file and both.startswith(file)


def test_one_judged_press_has_no_interval(results: DatasetResults) -> None:
    def one(row: Row) -> Row:
        return replace(
            row, errors=replace(row.errors, n_presses=1, ci95=dict.fromkeys(row.errors.ci95))
        )

    alone = replace(results.table, test=1, rows=tuple(map(one, results.table.rows)))
    few = replace(results, table=alone)

    def words(*sections: Section) -> str:
        return " ".join(word for section in sections for word in Page(section.html).words)

    assert words(headline_section([results])).count("interval") == 3  # two tiles and a caption
    section = headline_section([few])
    assert f"1 press of {alone.dataset}" in words(section)
    for part, captions in ((section, 1), (dataset_section(few), 4)):
        said = words(part)
        assert said.count("interval") == said.count("1 press, too few for an interval") == captions
        assert not re.search(r"\d<small>", part.html)
    mixed = words(headline_section([results, few]))
    assert "bootstrap 95 % interval below them; there is none for 1 press" in mixed


def test_all_lights_stand_first_and_fewer_behind(text: str) -> None:
    """Estimators that were measured with all lights only would else begin with dashes."""
    headings = re.findall(r"<thead>(.*?)</thead>", text, re.DOTALL)
    of_lights = [re.findall(r'<th scope="col">([RGB]+)\b', heading) for heading in headings]
    counts = [[len(lights) for lights in line] for line in of_lights if len(line) > 1]
    assert len(counts) == 2 and all(line[0] == 3 and line[-1] == 1 for line in counts)
    assert all(line == sorted(line, reverse=True) for line in counts)
