# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""The page: well-formed, complete without a network, and written whole or not at all."""

import base64
import io
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from scipy import ndimage

from sensor.errors import WedgeError
from tests.browser import chromium, needs_chromium
from tests.validation.report.html_page import Page
from validation.figures.maps import blank
from validation.figures.png import FRAME_DPI, frames_bytes, plot_bytes, png_bytes
from validation.figures.style import FULL_IN, HALF_IN
from validation.report.page import Picture, Section, figure_html, table_html, write_report
from validation.report.remarks import weakness_section
from validation.report.results import (
    DatasetResults,
)

TICK_PT = 8.0
"""The smallest type of figures."""


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
