# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Sections: files to build, weaknesses, pictures and held-out presses."""

import base64
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from bom.bill import make_bill, read_parts, totals_text
from bom.fit import parts_for
from recon.estimators import GradientEstimator, fit_estimator
from recon.pixels import Pixels
from recon.presses import LeftOut, read_presses
from sensor.design import FINGER, STANDARD
from tests.synthetic import make_fabrication
from tests.validation.report.html_page import Page
from validation import folds
from validation.examples import held_out
from validation.label_noise import label_shift_deg
from validation.report.fabrication import LINKS, fabrication_section, no_fabrication_section
from validation.report.remarks import weakness_section
from validation.report.results import (
    DatasetResults,
    dataset_section,
)


def test_sets_of_gentle_contacts_and_of_nothing_else_have_a_page(results: DatasetResults) -> None:
    held = results.held_out
    contact = held.pixels.contact
    flat = replace(held.pixels, gradient=0.2 * held.pixels.gradient)  # too flat for a direction
    gentle = dataset_section(replace(results, held_out=replace(held, pixels=flat))).html
    assert "Mean colour change" in dataset_section(results).html
    assert "Mean colour change" not in gentle
    chosen = {
        name: values[contact]
        for name, values in vars(held).items()
        if isinstance(values, np.ndarray | Pixels)
    }
    filled = weakness_section([replace(results, held_out=replace(held, **chosen))]).html
    assert "Untouched gel" in weakness_section([results]).html
    assert "Untouched gel" not in filled and "nan" not in filled


@pytest.mark.parametrize(("share", "is_weak"), [(1.0, False), (1.01, False), (0.9, True)])
def test_steep_slopes_that_come_back_whole_are_no_weakness(
    results: DatasetResults, share: float, is_weak: bool
) -> None:
    held = replace(results.held_out, estimated=share * results.held_out.pixels.gradient)
    words = weakness_section([replace(results, held_out=held)]).html
    assert (f"finds {100 * share:.0f} % of the true slope" in words) is is_weak
    assert ("Steep slopes" in words) is is_weak


def test_presses_left_out_are_named(results: DatasetResults) -> None:
    table = replace(
        results.table, left_out=(LeftOut(file="press07.png", reason="no contact is visible"),)
    )
    words = weakness_section([replace(results, table=table)]).html
    assert "Left out 1 of 6 presses: press07.png: no contact is visible." in words


def test_files_to_build_are_counted_shown_and_linked(tmp_path: Path) -> None:
    designs = {tmp_path / "fabrication" / design.name: design for design in (STANDARD, FINGER)}
    for failed, folder in enumerate(designs):
        folder.mkdir(parents=True)
        make_fabrication(folder, folder.name, failed=failed)
    section = fabrication_section(designs, tmp_path)
    page = Page(section.html)
    pattern = r'<th scope="row">(\w+)</th><td>\d+</td><td>(\d)</td><td>(\d)<'
    row = re.findall(pattern, section.html)
    assert row == [("standard", "3", "0"), ("finger", "2", "1")]
    assert "Failed: finger, wall of part 1." in page.words
    assert re.search(r"\d+\.\d\d USD, \d+\.\d\d each; 0.00 of it estimated<", section.html)
    contents = [
        base64.b64decode(picture["src"].partition(",")[2], validate=True)
        for picture in page.all("img")
    ]
    drawings = [content for content in contents if not content.startswith(b"\x89PNG")]
    assert drawings == [b"standard", b"finger"]  # what stands for drawing.svg
    assert len(contents) == 6
    links = [link["href"] for link in page.all("a")]
    assert len(links) == 2 * len(LINKS)
    assert all((tmp_path / link).is_file() for link in links)
    assert "no solids here" in no_fabrication_section("no solids here").html


def test_the_page_and_the_folder_price_the_same_parts(tmp_path: Path) -> None:
    """The paper's camera sees 120 degrees: of another view, its price is a guess."""
    narrow = replace(STANDARD, name="narrow", camera=replace(STANDARD.camera, diagonal_view_deg=90))
    (tmp_path / "narrow").mkdir()
    manifest = make_fabrication(tmp_path / "narrow", "narrow", failed=0)
    lines = make_bill(manifest["bill"], parts_for(narrow, read_parts()))
    wanted = totals_text(lines, 1).partition(": ")[2].strip().removesuffix(".")
    assert wanted.endswith("; 16.00 of it estimated")
    assert f"<td>{wanted}</td>" in fabrication_section({tmp_path / "narrow": narrow}, tmp_path).html


def test_held_out_presses_are_no_training_presses(
    results: DatasetResults, monkeypatch: pytest.MonkeyPatch
) -> None:
    learnt: list[int] = []

    def fit(name: str, pixels: Pixels, *rest) -> GradientEstimator:
        learnt.extend(np.unique(pixels.press))
        return fit_estimator(name, pixels, *rest)

    monkeypatch.setattr(folds, "fit_estimator", fit)
    presses = read_presses(results.dataset).presses
    first = next(folds.fit_folds(presses, "table", "RGB", folds=3, seed=0))
    held = held_out(results.dataset.folder, first, 0)
    judged = set(np.unique(held.pixels.press))
    assert (len(learnt), len(judged), held.n_presses) == (4, 2, 2)
    assert judged.isdisjoint(learnt)
    files = {results.dataset.labels[index].file for index in judged}
    assert {shown.depth.file for shown in held.examples} == files


def test_pictures_show_the_depth_that_was_judged(results: DatasetResults) -> None:
    median, worst = results.held_out.examples
    assert median.depth.rmse_mm <= worst.depth.rmse_mm
    error = worst.picture.depth_mm - worst.picture.depth_truth_mm
    known = np.isfinite(error)
    assert np.sqrt(np.mean(error[known] ** 2)) == pytest.approx(worst.depth.rmse_mm, rel=1e-3)


def test_shift_of_a_label_near_the_bottom_of_a_ball_is_shift_over_radius() -> None:
    flat = np.zeros((1, 2), np.float32)
    shift_deg = label_shift_deg(flat, 4.0, 0.01)
    assert shift_deg == pytest.approx(np.degrees(0.01 / 4.0), rel=1e-4)
    steep = np.array([[1.5, 0.0]], np.float32)
    assert label_shift_deg(steep, 4.0, 0.01) > shift_deg
