# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""The view to turn, in a real browser, from the disk: both in the report and in its own folder."""

import io
import json
import re
from base64 import b64decode
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from cad.build import Model
from cad.exports.page import view_files
from sensor.design import FINGER
from tests.browser import CHROMIUM, chromium
from validation.report.fabrication import fabrication_section
from validation.report.page import write_report


def test_the_model_holds_the_bodies_to_a_few_micrometres(finger: Model) -> None:
    files = dict(view_files(finger.design, finger.assembly, finger.body_meshes))
    text = files["model.js"].decode()
    model = json.loads(re.fullmatch(r".*?\[\"finger\"\] = (.*);\n", text, re.DOTALL)[1])
    assert {body["name"] for body in model["bodies"]} == set(finger.bodies)
    for body in model["bodies"]:
        mesh = finger.body_meshes[body["name"]]
        points = np.frombuffer(b64decode(body["points"]), "<u2").reshape(-1, 3)
        places = np.array(model["low"]) + model["step"] * points
        assert np.abs(places - mesh.vertices).max() < 0.002
        corners = np.frombuffer(b64decode(body["corners"]), "<u2").reshape(-1, 3)
        assert (corners == mesh.faces).all()


@pytest.fixture(scope="module")
def page() -> Iterator[object]:
    if CHROMIUM is None:
        pytest.skip("chromium is not installed")
    with chromium() as window:
        page = window.new_page()
        page.set_viewport_size({"width": 900, "height": 700})
        yield page


def picture(page: object, part: object = None) -> np.ndarray:
    from PIL import Image

    shown = part or page.locator(".wedge-view canvas")  # type: ignore[attr-defined]
    content = shown.screenshot()  # type: ignore[attr-defined]
    return np.asarray(Image.open(io.BytesIO(content)).convert("RGB"), np.int16)


def changed(before: np.ndarray, after: np.ndarray) -> float:
    return float((np.abs(after - before).max(axis=-1) > 16).mean())


@pytest.mark.parametrize("place", ["report", "folder"])
def test_the_view_turns_and_hides_parts_from_the_disk(
    place: str, page: object, fabricated: tuple[Path, Path], tmp_path: Path
) -> None:
    folder = fabricated[0]
    target = folder / "index.html"
    if place == "report":
        (tmp_path / "finger").symlink_to(folder)
        sections = [fabrication_section({tmp_path / "finger": FINGER}, tmp_path)]
        target = write_report(tmp_path, title="A page", lead="Of files.", sections=sections)
    page.goto(target.as_uri())  # type: ignore[attr-defined]
    view = page.locator(".wedge-view")  # type: ignore[attr-defined]
    view.scroll_into_view_if_needed()
    page.wait_for_selector(".wedge-view[data-ready]", timeout=60_000)  # type: ignore[attr-defined]
    first = picture(page)
    assert 0.02 < (first != 255).any(axis=-1).mean() < 0.9
    view.locator("canvas").press("ArrowLeft")
    turned = picture(page)
    assert changed(first, turned) > 0.01
    for box in view.locator("input[type=checkbox]").all():
        box.uncheck()
    assert (picture(page)[20:-20, 20:-20] == 255).all()
    view.locator("input[name=gel]").check()
    gel = picture(page)
    assert 0 < (gel[20:-20, 20:-20] != 255).any(axis=-1).mean() < 0.1


def test_a_list_of_parts_that_goes_on_is_shaded_at_that_edge_and_whole_on_a_phone(
    page: object, fabricated: tuple[Path, Path]
) -> None:
    page.goto((fabricated[0] / "index.html").as_uri())  # type: ignore[attr-defined]
    page.wait_for_selector(".wedge-view[data-ready]", timeout=60_000)  # type: ignore[attr-defined]
    parts = page.locator(".wedge-view > div")  # type: ignore[attr-defined]

    def edges() -> list[float]:
        """The grey of a strip at the top and at the bottom, beside the names."""
        shown = picture(page, parts)[:, -20:-15]
        return [float(shown[2:6].mean()), float(shown[-6:-2].mean())]

    assert parts.evaluate("x => x.scrollHeight > x.clientHeight")
    top, bottom = edges()
    assert top > 250 and bottom < 220
    parts.evaluate("x => { x.scrollTop = x.scrollHeight; }")
    top, bottom = edges()
    assert top < 220 and bottom > 250
    size = page.viewport_size  # type: ignore[attr-defined]
    page.set_viewport_size({"width": 375, "height": 800})  # type: ignore[attr-defined]
    assert parts.evaluate("x => x.scrollHeight <= x.clientHeight && x.clientHeight < 600")
    page.set_viewport_size(size)  # type: ignore[attr-defined]


def test_a_view_far_down_keeps_its_place_and_says_what_it_needs_in_a_page_alone(
    page: object, fabricated: tuple[Path, Path], tmp_path: Path
) -> None:
    words = "needs JavaScript and the folder next to this page"
    (tmp_path / "finger").symlink_to(fabricated[0])
    sections = [fabrication_section({tmp_path / "finger": FINGER}, tmp_path)]
    # Far down the page: what is not scrolled to is not set up yet.
    lead = "Of files." + 200 * "<br>"
    target = write_report(tmp_path, title="A page", lead="Of files.", sections=sections)
    content = target.read_text().replace("Of files.", lead, 1)
    target.write_text(content)
    page.goto(target.as_uri())  # type: ignore[attr-defined]
    page.wait_for_selector(".wedge-view[data-watched]", state="attached")  # type: ignore[attr-defined]
    assert words not in page.locator("body").inner_text()  # type: ignore[attr-defined]
    view = page.locator(".wedge-view")  # type: ignore[attr-defined]
    height_px = view.bounding_box()["height"]
    view.scroll_into_view_if_needed()
    page.wait_for_selector(".wedge-view[data-ready]", timeout=60_000)  # type: ignore[attr-defined]
    assert view.bounding_box()["height"] == height_px, "what lies below it jumps"
    (tmp_path / "alone").mkdir()
    alone = tmp_path / "alone" / "index.html"
    alone.write_text(content)
    page.goto(alone.as_uri())  # type: ignore[attr-defined]
    assert words in view.inner_text()


def test_a_page_without_its_model_says_so(page: object, tmp_path: Path) -> None:
    script = Path(__file__).parents[2] / "cad" / "data" / "viewer.js"
    (tmp_path / "viewer.js").write_bytes(script.read_bytes())
    (tmp_path / "alone.html").write_text(
        '<div class="wedge-view" data-name="x" data-model="gone.js"></div>'
        '<script src="viewer.js"></script>'
    )
    page.goto((tmp_path / "alone.html").as_uri())  # type: ignore[attr-defined]
    words = page.locator(".wedge-view p")  # type: ignore[attr-defined]
    words.wait_for(timeout=30_000)
    assert "gone.js is not next to this page" in words.inner_text()


def test_the_wheel_scrolls_past_a_view_until_somebody_clicks_into_it(
    page: object, fabricated: tuple[Path, Path]
) -> None:
    page.goto((fabricated[0] / "index.html").as_uri())  # type: ignore[attr-defined]
    page.wait_for_selector(".wedge-view[data-ready]", timeout=60_000)  # type: ignore[attr-defined]
    canvas = page.locator(".wedge-view canvas")  # type: ignore[attr-defined]
    before = picture(page)
    canvas.hover()
    page.mouse.wheel(0, 50)  # type: ignore[attr-defined]
    page.wait_for_function("scrollY == 50")  # type: ignore[attr-defined]
    assert changed(before, picture(page)) == 0
    canvas.click()
    page.mouse.wheel(0, -5000)  # type: ignore[attr-defined]
    canvas.press("ArrowLeft")  # told after it
    canvas.press("ArrowRight")
    page.wait_for_function("scrollY == 50")  # type: ignore[attr-defined]
    assert changed(before, picture(page)) > 0.01
