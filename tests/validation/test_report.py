# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""The page: well-formed, complete without a network, and written whole or not at all."""

import base64
import io
import re
from concurrent.futures import Executor, Future
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from scipy import ndimage

from benchmarks.integrators import BOUNDARIES, CAPS_MM_PER_PX, bump_error, integrated_caps
from bom.bill import make_bill, read_parts, totals_text
from bom.fit import parts_for
from recon.estimators import GradientEstimator, fit_estimator
from recon.pixels import Pixels
from recon.presses import read_presses
from sensor.design import FINGER, STANDARD
from sensor.errors import WedgeError
from tests.browser import chromium, needs_chromium
from tests.synthetic import make_dataset, make_fabrication
from validation import folds
from validation.error_table import Row, configurations, error_table
from validation.examples import held_out
from validation.figures.maps import blank
from validation.figures.png import FRAME_DPI, frames_bytes, plot_bytes, png_bytes
from validation.figures.style import FULL_IN, HALF_IN
from validation.label_noise import label_shift_deg
from validation.paper import PAPER_TABLE, paper_errors
from validation.report.fabrication import LINKS, fabrication_section, no_fabrication_section
from validation.report.integrators import integrator_section
from validation.report.page import Picture, Section, figure_html, table_html, write_report
from validation.report.remarks import reproduction_section, weakness_section
from validation.report.results import (
    DatasetResults,
    dataset_section,
    headline_section,
    truth_of_peaks,
)

TICK_PT = 8.0
"""The smallest type of figures."""
VOID = {"meta", "img", "br", "link", "input", "hr"}


class Inline(Executor):
    def submit(self, work, /, *args, **options):  # type: ignore[override]
        future: Future = Future()
        future.set_result(work(*args, **options))
        return future


class Page(HTMLParser):
    """Checks balance while it reads, and keeps what tests ask for."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.open: list[str] = []
        self.tags: list[tuple[str, dict[str, str]]] = []
        self.words: list[str] = []
        self.feed(text)
        self.close()
        assert not self.open

    def handle_starttag(self, tag: str, attributes: list) -> None:
        self.tags.append((tag, {key: value or "" for key, value in attributes}))
        if tag not in VOID:
            self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        self.words.append(data)

    def all(self, tag: str) -> list[dict[str, str]]:
        return [attributes for name, attributes in self.tags if name == tag]


@pytest.fixture(scope="module")
def results(tmp_path_factory: pytest.TempPathFactory) -> DatasetResults:
    dataset = make_dataset(tmp_path_factory.mktemp("page") / "set", presses=6)
    table = error_table(dataset.folder, ["table"], folds=2, seed=0, executor=Inline())
    return DatasetResults(
        dataset=dataset,
        about="an ideal sensor",
        table=table,
        held_out=held_out(dataset.folder, table.folds_fitted["table"][0], 0),
        command="wedge table set --folds 2 <&>",
    )


@pytest.fixture(scope="module")
def text(results: DatasetResults, tmp_path_factory: pytest.TempPathFactory) -> str:
    depth, found = integrated_caps()
    errors = {name: [bump_error(count, name) for count in (10, 20)] for name in BOUNDARIES}
    path = write_report(
        tmp_path_factory.mktemp("out"),
        title="A <page>",
        lead="Measured & shown.",
        sections=[
            headline_section([results]),
            dataset_section(results),
            integrator_section(depth, found, CAPS_MM_PER_PX, (10, 20), errors),
            weakness_section([results]),
            reproduction_section("wedge reproduce", [results], {"other": "not here"}, {"a": "1"}),
        ],
    )
    return path.read_text(encoding="utf-8")


def test_page_is_well_formed_and_escaped(text: str) -> None:
    page = Page(text)
    assert "A <page>" in page.words
    assert "wedge table set --folds 2 <&>" in page.words
    assert text.startswith("<!DOCTYPE html>")
    assert page.all("html") == [{"lang": "en"}]


def test_every_picture_is_inside_and_described(text: str) -> None:
    pictures = Page(text).all("img")
    assert len(pictures) >= 8
    for picture in pictures:
        assert len(picture["alt"]) > 20
        kind, _, content = picture["src"].partition(",")
        magic = {"data:image/png;base64": b"\x89PNG", "data:image/webp;base64": b"RIFF"}[kind]
        assert base64.b64decode(content, validate=True).startswith(magic)


def test_pictures_with_frames_take_less_than_a_fifth_of_a_png() -> None:
    frame = np.random.default_rng(0).random((240, 320, 3))
    figure = blank(4.0, 3.0)
    figure.add_axes((0, 0, 1, 1)).imshow(ndimage.gaussian_filter(frame, (1, 1, 0)))
    assert len(frames_bytes(figure)) < len(png_bytes(figure, FRAME_DPI)) / 5
    assert frames_bytes(figure) == frames_bytes(figure)


def test_plots_lose_nothing_in_the_page() -> None:
    figure = blank(3.0, 2.0)
    figure.add_axes((0.2, 0.2, 0.7, 0.7)).plot([0, 1, 0], label="curve")
    found = [
        np.asarray(Image.open(io.BytesIO(content)).convert("RGB"))
        for content in (plot_bytes(figure), png_bytes(figure))
    ]
    assert (found[0] == found[1]).all()


def test_nothing_is_loaded_from_elsewhere(text: str) -> None:
    page = Page(text)
    assert not [tag for tag, _ in page.tags if tag in ("script", "link", "iframe", "object")]
    for tag, attributes in page.tags:
        for key in ("src", "srcset", "href", "data", "poster", "action", "style"):
            value = attributes.get(key, "#")
            assert value.startswith(("#", "data:")), (tag, key, value[:60])
    (style,) = re.findall(r"<style>(.*?)</style>", text, re.DOTALL)
    assert "url(" not in style and "@import" not in style


def test_contents_lead_to_every_section(text: str) -> None:
    page = Page(text)
    ids = [attributes["id"] for _, attributes in page.tags if "id" in attributes]
    assert len(ids) == len(set(ids))
    targets = [link["href"].removeprefix("#") for link in page.all("a")]
    assert set(targets) <= set(ids)
    assert {section["id"] for section in page.all("section")} <= set(targets)


@needs_chromium
def test_words_in_pictures_stay_legible_on_a_phone(text: str, tmp_path: Path) -> None:
    (tmp_path / "page.html").write_text(text)
    with chromium() as window:
        page = window.new_page()
        page.set_viewport_size({"width": 375, "height": 800})
        page.goto((tmp_path / "page.html").as_uri())
        assert page.evaluate("document.documentElement.scrollWidth") == 375
        shown = page.locator("figure img").evaluate_all(
            "all => all.map(x => [x.clientWidth, x.closest('figure').matches('.wide')])"
        )
    assert {is_wide for _, is_wide in shown} == {False, True}
    for width_px, is_wide in shown:
        assert TICK_PT / 72 * width_px / (FULL_IN if is_wide else HALF_IN) >= 9.5


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
    table = replace(results.table, left_out=(("press07.png", "no contact is visible"),))
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


def test_page_is_whole_or_absent(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    sections = [Section(title="One", html="<p>first</p>")]
    path = write_report(tmp_path, title="a", lead="b", sections=sections)
    before = path.read_bytes()

    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("os.fsync", full)
    with pytest.raises(WedgeError, match="No space left"):
        write_report(tmp_path, title="c", lead="d", sections=sections)
    assert path.read_bytes() == before
    assert [file.name for file in tmp_path.iterdir()] == ["index.html"]


def test_sections_of_titles_that_are_nearly_the_same_have_a_place_each(tmp_path: Path) -> None:
    titles = {"June.1": "june-1", "june 1": "june-1-2", "June 1-2": "june-1-2-2"}
    titles |= {"センサ": "section", "接触": "section-2"}
    sections = [Section(title=title, html="") for title in titles]
    page = write_report(tmp_path, title="a", lead="b", sections=sections).read_text("utf-8")
    for title, anchor in titles.items():
        assert f'<a href="#{anchor}">{title}</a>' in page
        assert page.count(f'id="{anchor}"') == 1


def test_words_from_outside_stay_words(results: DatasetResults) -> None:
    evil = '"><script>alert(1)</script>'
    picture = Picture(content=b"", alt=evil, caption=evil, wide=True)
    card = replace(results.dataset.card, name=evil)
    weak = weakness_section([replace(results, dataset=replace(results.dataset, card=card))])
    for part in (figure_html(picture), table_html(evil, [evil], [[evil]]), weak.html):
        assert not Page(part).all("script")


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
