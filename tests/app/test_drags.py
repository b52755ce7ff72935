# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Circles and corners under a mouse and under fingers: where they are moved, by whom, and told."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from playwright.sync_api import Page, expect

from recon.images import read_image
from sensor.dataset import read_dataset, write_labels
from tests.app.served import opened, served
from tests.browser import needs_chromium
from tests.synthetic import KEYSTONE_PX, make_dataset

pytestmark = needs_chromium
LABEL, CORNERS = ("label",), ("label", "--corners")
BOTH = pytest.mark.parametrize("words", [LABEL, CORNERS])
WIDTHS_PX = (360, 390, 412, 700, 820, 1024, 1280, 1366)
LAID_OUT = """width => innerWidth === width && document.querySelector("img").naturalWidth > 0"""
Places = list[tuple[float, float]]


def made(folder: Path, words: tuple[str, ...], name: str = "press00.png") -> Path:
    """A set of one press under a name: of a circle that was found, or of raw frames."""
    corners_px = KEYSTONE_PX if words == CORNERS else None
    (label,) = make_dataset(folder, presses=1, corners_px=corners_px).labels
    (folder / label.file).rename(folder / name)
    found = replace(label, file=name, quality=0.5, center_x_px=40.0, center_y_px=50.0)
    write_labels(folder / "labels.csv", [] if words == CORNERS else [found])
    return folder


def places(folder: Path) -> Places:
    """Of the circle, or of the corners."""
    dataset = read_dataset(folder)
    circles = [label.center_px for label in dataset.labels]
    return circles or list(dataset.card.corners_px or ())


def middle(page: Page) -> tuple[float, float]:
    """Of the circle, or of the first corner's ring, on the screen."""
    box = page.locator("#picture circle, #raw circle").first.bounding_box()
    assert box is not None
    return box["x"] + box["width"] / 2, box["y"] + box["height"] / 2


def touching(page: Page) -> Callable[..., None]:
    """What puts fingers on the screen, moves them and lifts them, as a screen tells a browser."""
    screen = page.context.new_cdp_session(page)

    def touch(kind: str, *fingers: tuple[float, float]) -> None:
        points = [{"x": x, "y": y, "id": number} for number, (x, y) in enumerate(fingers)]
        screen.send("Input.dispatchTouchEvent", {"type": f"touch{kind}", "touchPoints": points})

    return touch


def expect_nothing_moved(page: Page, before: Places) -> None:
    """An arrow key, told after all else, finds everything where it was."""
    x, y = before[0]
    page.keyboard.press("ArrowRight")
    expect(page.locator("#spoken")).to_contain_text(f"({x + 1:.2f}, {y:.2f}) px")


@BOTH
@pytest.mark.parametrize("name", ["press00.png", "press-20261130-111220-458.png"])
def test_a_picture_stays_under_the_pointer_that_drags(
    tmp_path: Path, name: str, words: tuple[str, ...]
) -> None:
    folder = made(tmp_path / "set", words, name)
    before, columns = places(folder), read_image(folder / name).shape[1]
    with served(*words, folder) as address, opened(address) as page:
        heading, spoken = page.locator("#heading"), page.locator("#spoken")
        picture = page.locator("#picture img, #raw img").first
        for width_px in WIDTHS_PX:
            page.set_viewport_size({"width": width_px, "height": 800})
            page.wait_for_function(LAID_OUT, arg=width_px)
            picture.scroll_into_view_if_needed()
            said, box, (x, y) = heading.inner_text(), picture.bounding_box(), middle(page)
            assert box is not None
            page.mouse.move(x, y)
            page.mouse.down()
            far = x + 0.53 * box["width"]  # digits come
            for to in (x + 2, (x + far) / 2, far):
                told = heading.inner_text()
                page.mouse.move(to, y)
                expect(heading).not_to_have_text(told)
                assert picture.bounding_box() == box
                expect(spoken).to_have_text(said)
            page.mouse.up()
            expect(spoken).not_to_have_text(said)
            expect(spoken).to_have_text(heading.inner_text())
            by_px = np.subtract(places(folder), before)[0]
            assert by_px == pytest.approx([0.53 * columns, 0], abs=0.02)
            page.keyboard.press("Control+z")
            expect(spoken).to_have_text(said)


@BOTH
def test_what_is_held_beside_its_middle_does_not_jump(
    tmp_path: Path, words: tuple[str, ...]
) -> None:
    folder = made(tmp_path / "set", words)
    before, columns = places(folder), read_image(folder / "press00.png").shape[1]
    with served(*words, folder) as address, opened(address) as page:
        said = page.locator("#spoken").inner_text()
        (x, y), box = middle(page), page.locator("#picture img, #raw img").first.bounding_box()
        assert box is not None
        page.mouse.move(x + 20, y - 10)
        page.mouse.down()
        page.mouse.move(x + 50, y + 20, steps=3)
        page.mouse.up()
        expect(page.locator("#spoken")).not_to_have_text(said)
        by_px = np.subtract(places(folder), before)[0]
        assert by_px == pytest.approx([30 * columns / box["width"]] * 2, abs=0.02)


@BOTH
@pytest.mark.parametrize("beside_px", [(10, 10), (120, 90)])
def test_a_second_finger_ends_a_drag(
    tmp_path: Path, beside_px: tuple[int, int], words: tuple[str, ...]
) -> None:
    folder = made(tmp_path / "set", words)
    before = places(folder)
    with served(*words, folder) as address, opened(address) as page:
        heading, touch, (x, y) = page.locator("#heading"), touching(page), middle(page)
        said, palm = heading.inner_text(), (x + beside_px[0], y + beside_px[1])
        touch("Start", (x, y))
        touch("Move", (x + 20, y))
        expect(heading).not_to_have_text(said)
        touch("Start", (x + 20, y), palm)
        expect(heading).to_have_text(said)
        touch("Move", (x + 21, y), palm)
        touch("End")
        expect_nothing_moved(page, before)


@BOTH
def test_a_swipe_beside_what_is_drawn_scrolls_and_moves_nothing(
    tmp_path: Path, words: tuple[str, ...]
) -> None:
    folder = made(tmp_path / "set", words)
    before = places(folder)
    with served(*words, folder) as address, opened(address, 700, 500) as page:
        touch, (x, y) = touching(page), middle(page)
        for steps in (range(1, 9), range(20, 120, 20)):  # a tap of no steady finger, a swipe
            touch("Start", (x + 100, y + 80))
            for step in steps:
                touch("Move", (x + 100, y + 80 - step))
            touch("End")
        page.wait_for_function("scrollY > 0")
        expect_nothing_moved(page, before)


@BOTH
def test_arrow_buttons_move_by_a_pixel(tmp_path: Path, words: tuple[str, ...]) -> None:
    folder = made(tmp_path / "set", words)
    x, y = places(folder)[0]
    with served(*words, folder) as address, opened(address, 820, 1180) as page:
        for name in ("right", "right", "left", "down", "down", "up"):
            page.get_by_role("button", name=f"Move {name}").click()
        expect(page.locator("#spoken")).to_contain_text(f"({x + 1:.2f}, {y + 1:.2f}) px")
