# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""The page of `wedge label` in a real browser: keys, buttons, odd frames, long lists, windows."""

import os
import re
from dataclasses import replace
from pathlib import Path

import pytest
from playwright.sync_api import Page, expect

from recon.labels.label_book import CERTAIN, LabelBook
from sensor.dataset import BallLabel, Dataset, read_dataset, write_labels
from tests.app.served import opened, served
from tests.browser import needs_chromium
from tests.synthetic import make_dataset

pytestmark = needs_chromium
WITHIN = """([inner, outer]) => {
    const a = document.querySelector(inner).getBoundingClientRect();
    const b = document.querySelector(outer).getBoundingClientRect();
    return a.left >= b.left - 1 && a.right <= b.right + 1
        && a.top >= b.top - 1 && a.bottom <= b.bottom + 1;
}"""
CONTRAST = """button => {
    const light = color => {
        const parts = color.match(/[\\d.]+/g).map(Number);
        if (parts.length == 4 && parts[3] == 0) return 1;  // the page's white
        const [r, g, b] = parts.map(x => x / 255).map(
            x => x <= 0.04045 ? x / 12.92 : ((x + 0.055) / 1.055) ** 2.4);
        return 0.2126 * r + 0.7152 * g + 0.0722 * b;
    };
    const {color, backgroundColor} = getComputedStyle(button);
    const [dark, bright] = [light(color), light(backgroundColor)].sort((a, b) => a - b);
    return (bright + 0.05) / (dark + 0.05);
}"""
"""Of a button's words, as WCAG defines it."""
CONTRAST_ON_MESSAGE = CONTRAST.replace(
    "const {color, backgroundColor} = getComputedStyle(button);",
    "const {color} = getComputedStyle(button);"
    " const {backgroundColor} = getComputedStyle(button.closest('.q-notification'));",
)
CONTRAST_OF_FOCUS = CONTRAST.replace(
    "const {color, backgroundColor} = getComputedStyle(button);",
    "const {outlineColor: color, outlineStyle, outlineWidth} = getComputedStyle(button);"
    " if (outlineStyle != 'solid' || outlineWidth != '3px') return 1;"
    " const backgroundColor = 'rgb(255, 255, 255)';",
)
BUTTONS = (
    *("Right, next", "No ball", "Undo", "Difference / frame", "Zoom"),
    *("Smaller circle", "Larger circle", "Previous frame", "Next frame"),
    *("Move left", "Move right", "Move up", "Move down"),
)
SEEN = "x => x.getBoundingClientRect().bottom <= innerHeight"
FITTING = """() => {
    const view = document.querySelector("#view"), shown = document.querySelector("#picture");
    const is_wide = shown.clientWidth >= view.clientWidth - 1;
    const fills = is_wide || shown.clientHeight > 0.7 * innerHeight;
    return fills && view.scrollHeight <= view.clientHeight && view.scrollWidth <= view.clientWidth;
}"""


def labels(dataset: Dataset) -> dict[str, BallLabel]:
    return {label.file: label for label in read_dataset(dataset.folder).labels}


def shown_file(page: Page) -> str:
    heading = page.locator("#heading").inner_text()
    return heading.partition(" cannot")[0].partition(":")[0]


def test_keys_stay_the_pages_after_a_click_on_a_button(tmp_path: Path) -> None:
    dataset = make_dataset(tmp_path / "set", presses=3)
    with served("label", dataset.folder) as address, opened(address) as page:
        heading, first = page.locator("#heading"), shown_file(page)
        page.get_by_text("No ball", exact=True).click()
        expect(heading).to_contain_text("no ball")
        page.keyboard.press("Enter")
        expect(heading).not_to_contain_text(first)
        second = shown_file(page)
        page.get_by_text("Undo", exact=True).click()
        expect(heading).to_contain_text(first)
        assert labels(dataset).keys() == {label.file for label in dataset.labels}
        page.keyboard.press("Enter")
        expect(heading).to_contain_text(second)
        assert labels(dataset)[first].quality == CERTAIN
        page.keyboard.press("ArrowRight")
        expect(heading).to_contain_text("quality 1.00")


def test_tab_reaches_the_list_and_every_button_and_keys_stay_the_pages(tmp_path: Path) -> None:
    dataset = make_dataset(tmp_path / "set", presses=3)
    with served("label", dataset.folder) as address, opened(address) as page:
        heading, rows = page.locator("#heading"), page.locator("#frames [role=option]")
        page.keyboard.press("Tab")
        expect(page.locator("#frames")).to_be_focused()
        page.keyboard.press("ArrowDown")
        expect(rows.nth(1)).to_have_attribute("aria-selected", "true")
        expect(page.locator("#frames")).to_have_attribute("aria-activedescendant", "frame-1")
        page.keyboard.press("ArrowUp")
        expect(rows.nth(0)).to_have_attribute("aria-selected", "true")
        assert labels(dataset) == {label.file: label for label in dataset.labels}
        for name in BUTTONS:
            page.keyboard.press("Tab")
            button = page.get_by_role("button", name=name)
            expect(button).to_be_focused()
            assert button.evaluate(CONTRAST) >= 4.5
            assert button.evaluate(CONTRAST_OF_FOCUS) >= 3
        page.keyboard.press("ArrowRight")  # the page's, wherever Tab is
        expect(heading).to_contain_text("quality 1.00")
        for _ in BUTTONS[BUTTONS.index("Undo") + 1 :]:
            page.keyboard.press("Shift+Tab")
        page.keyboard.press("Enter")  # the button's alone
        expect(heading).to_contain_text("not scored")
        expect(heading).to_contain_text(rows.nth(0).locator(".name").inner_text())


def test_a_page_loaded_anew_shows_the_frame_that_it_showed(tmp_path: Path) -> None:
    dataset = make_dataset(tmp_path / "set", presses=3)
    with served("label", dataset.folder) as address, opened(address) as page:
        page.keyboard.press("n")
        expect(page.locator("#frames [role=option]").nth(1)).to_have_attribute(
            "aria-selected", "true"
        )
        second = shown_file(page)
        page.wait_for_function(f"location.search.includes('{second}')")
        page.reload()
        expect(page.locator("#heading")).to_contain_text(second)
        expect(page.locator("#frames [aria-selected=true]")).to_contain_text(second)


def test_what_is_the_browsers_own_edits_nothing(tmp_path: Path) -> None:
    dataset = make_dataset(tmp_path / "set", presses=3)
    with served("label", dataset.folder) as address, opened(address) as page:
        file = shown_file(page)
        box = page.locator("#picture img").first.bounding_box()
        assert box is not None
        page.mouse.move(box["x"] + 50, box["y"] + 50)
        for keys in ("Meta+Minus", "Alt+ArrowLeft", "Meta+Delete", "Control+Shift+z", "Alt+n"):
            page.keyboard.press(keys)
        page.mouse.wheel(60, 0)
        page.keyboard.down("Control")
        page.mouse.wheel(0, 100)
        page.keyboard.up("Control")
        page.mouse.down(button="right")
        page.mouse.move(box["x"] + 90, box["y"] + 50)
        page.mouse.up(button="right")
        page.keyboard.press("ArrowRight")  # told after all these
        expect(page.locator("#heading")).to_contain_text("quality 1.00")
        before, after = {label.file: label for label in dataset.labels}[file], labels(dataset)[file]
        assert after.center_x_px == pytest.approx(before.center_x_px + 1, abs=0.01)
        assert after.center_y_px == pytest.approx(before.center_y_px, abs=0.01)
        assert after.contact_radius_px == before.contact_radius_px


def test_turning_quickly_leaves_no_picture_out(tmp_path: Path) -> None:
    dataset = make_dataset(tmp_path / "set", presses=3)
    with served("label", dataset.folder) as address, opened(address) as page:
        page.wait_for_function("document.querySelector('#picture img').naturalWidth > 0")
        page.locator("#picture img").first.evaluate(
            "img => { img.missing = 0; img.addEventListener('error', () => img.missing += 1); }"
        )
        first = shown_file(page)
        for _ in range(30):
            page.keyboard.press("n")
        page.keyboard.press("Delete")  # told after all these
        expect(page.locator("#heading")).to_contain_text(f"{first}: no ball")
        page.wait_for_function("document.querySelector('#picture img').complete")
        assert page.locator("#picture img").first.evaluate("img => img.missing") == 0


def test_a_frame_that_cannot_be_read_is_not_edited(tmp_path: Path) -> None:
    dataset = make_dataset(tmp_path / "set", presses=3)
    with served("label", dataset.folder) as address, opened(address) as page:
        heading, first = page.locator("#heading"), shown_file(page)
        (damaged,) = {label.file for label in dataset.labels[1:2]}
        assert damaged != first
        (dataset.folder / damaged).write_bytes(b"no picture")
        page.keyboard.press("n")
        expect(heading).to_contain_text(f"{damaged} cannot be shown")
        expect(page.locator("#picture")).to_be_hidden()
        for key in ("ArrowRight", "+", "Delete"):
            page.keyboard.press(key)
        page.get_by_text("No ball", exact=True).click()
        page.keyboard.press("Enter")  # turns on and says nothing of the frame
        expect(heading).to_contain_text("centre")
        expect(page.locator("#picture")).to_be_visible()
        assert labels(dataset) == {label.file: label for label in dataset.labels}


def test_a_circle_stays_smaller_than_its_own_ball(tmp_path: Path) -> None:
    dataset = make_dataset(tmp_path / "set", presses=1)
    ball_mm = 2.0  # of the press; the card's is larger
    write_labels(
        dataset.folder / "labels.csv",
        [replace(x, ball_radius_mm=ball_mm, contact_radius_px=18.0) for x in dataset.labels],
    )
    with served("label", dataset.folder) as address, opened(address) as page:
        heading, box = page.locator("#heading"), page.locator("#picture img").first.bounding_box()
        assert box is not None
        for _ in range(12):
            page.keyboard.press("+")
        expect(heading).to_contain_text("radius 19.60 px")
        (label,) = read_dataset(dataset.folder).labels
        assert label.contact_radius_px * dataset.card.mm_per_px[0] < ball_mm
        page.keyboard.press("Delete")
        expect(heading).to_contain_text("no ball")
        page.mouse.click(box["x"] + 50, box["y"] + 50)
        expect(heading).to_contain_text(re.compile(r"radius 9\.80 px.*quality 1\.00"))  # let go
        (label,) = read_dataset(dataset.folder).labels
        assert label.ball_radius_mm == ball_mm


def test_a_circle_moved_in_another_tab_is_shown_before_it_is_edited(tmp_path: Path) -> None:
    dataset = make_dataset(tmp_path / "set", presses=1)
    with served("label", dataset.folder) as address, opened(address) as page:
        other = page.context.new_page()
        other.goto(address)
        expect(other.locator("#heading")).to_contain_text("centre")
        page.keyboard.press("ArrowRight")
        expect(page.locator("#heading")).to_contain_text("quality 1.00")
        moved = labels(dataset)
        other.keyboard.press("Delete")
        other.get_by_text("another tab").wait_for()
        expect(other.locator("#heading")).to_contain_text("quality 1.00")
        assert labels(dataset) == moved
        other.keyboard.press("Delete")
        expect(other.locator("#heading")).to_contain_text("no ball")
        page.close()
        other.keyboard.press("Control+z")
        expect(other.locator("#heading")).to_contain_text("quality 1.00")
        assert labels(dataset) == moved


def test_enter_that_cannot_write_stays_at_the_frame(tmp_path: Path) -> None:
    dataset = make_dataset(tmp_path / "set", presses=3)
    with served("label", dataset.folder) as address, opened(address) as page:
        first, path = shown_file(page), dataset.folder / "labels.csv"
        path.write_text(path.read_text().replace(f"{first},", f"{first},1"))  # another program's
        page.keyboard.press("Enter")
        page.get_by_text("another tab or program").wait_for()
        page.keyboard.press("d")
        expect(page.locator("#heading")).to_contain_text(first)
        assert page.get_by_role("button", name="Close").evaluate(CONTRAST_ON_MESSAGE) >= 4.5
        page.keyboard.press("Enter")  # it is seen as it is now
        expect(page.get_by_text("another tab or program")).to_have_count(0)


@pytest.mark.parametrize("key", ["Enter", "Delete", "Backspace"])
def test_a_held_key_judges_the_frame_that_is_seen_and_no_more(tmp_path: Path, key: str) -> None:
    dataset = make_dataset(tmp_path / "set", presses=4)
    with served("label", dataset.folder) as address, opened(address) as page:
        for _ in range(4):
            page.keyboard.down(key)  # no key up between: it repeats
        page.keyboard.up(key)
        page.keyboard.press("d")
        page.keyboard.press("=")  # told after all these, and judges a second frame after Enter
        checked = 1 + (key == "Enter")
        expect(page.locator("#looked-at")).to_have_text(f"{checked} of 4 frames checked")


def test_complaints_are_taken_back_without_one_of_the_browser(tmp_path: Path) -> None:
    dataset = make_dataset(tmp_path / "set", presses=1)
    path, said = dataset.folder / "labels.csv", []
    with served("label", dataset.folder) as address, opened(address) as page:
        page.on("console", lambda told: said.append(told.text) if told.type == "error" else None)
        for _ in range(2):
            path.write_text(path.read_text().replace("press00.png,", "press00.png,1"))
            page.keyboard.press("ArrowRight")
            page.get_by_text("another tab or program").wait_for()
            page.keyboard.press("ArrowRight")  # it is seen as it is now
            expect(page.get_by_text("another tab or program")).to_have_count(0)
        assert said == []


@pytest.mark.parametrize("turns", [[-100], [-10] * 10, [-1000]])
def test_small_turns_of_the_wheel_add_up_to_a_notch(tmp_path: Path, turns: list[int]) -> None:
    dataset = make_dataset(tmp_path / "set", presses=1)
    grown_px = 1.02 * dataset.labels[0].contact_radius_px
    with served("label", dataset.folder) as address, opened(address) as page:
        page.locator("#picture").hover()
        for turn in turns:
            page.mouse.wheel(0, turn)
        near = "|".join(f"{grown_px + step / 100:.2f}" for step in range(-3, 4))
        expect(page.locator("#heading")).to_contain_text(re.compile(f"radius ({near}) px"))
        page.keyboard.press("Control+z")  # one spin of the wheel is one change
        labelled_px = dataset.labels[0].contact_radius_px
        expect(page.locator("#heading")).to_contain_text(f"radius {labelled_px:.2f} px")


def test_a_long_list_keeps_its_rows_and_follows_the_frame(tmp_path: Path) -> None:
    dataset = make_dataset(tmp_path / "set", presses=1)
    (label,) = dataset.labels
    for index in range(300):
        os.link(dataset.folder / label.file, dataset.folder / f"more{index}.png")
    more = [BallLabel(**{**vars(label), "file": f"more{i}.png"}) for i in range(300)]
    write_labels(dataset.folder / "labels.csv", [label, *more])
    with served("label", dataset.folder) as address, opened(address) as page:
        rows = page.locator("#frames [role=option]")
        assert rows.count() == 301
        rows.evaluate_all("all => all.forEach(row => row.same = true)")
        page.keyboard.press("p")
        expect(rows.last).to_have_attribute("aria-selected", "true")
        page.wait_for_function(WITHIN, arg=["#frames [aria-selected=true]", "#frames"])
        assert page.evaluate("scrollY") == 0
        page.keyboard.press("Delete")
        expect(rows.last).to_contain_text("no ball")
        assert rows.evaluate_all("all => all.every(row => row.same)")
        page.locator("#frames").evaluate("list => list.scrollTop = 0")
        rows.nth(2).click()
        expect(page.locator("#heading")).to_contain_text(rows.nth(2).locator(".name").inner_text())
        expect(page.locator("#frames [aria-selected=true]")).to_have_count(1)


def test_a_click_on_a_row_counts_though_it_is_written_anew_meanwhile(
    tmp_path: Path,
) -> None:
    dataset = make_dataset(tmp_path / "set", presses=2)
    with served("label", dataset.folder) as address, opened(address) as page:
        row = page.locator("#frames [aria-selected=false]")
        name = row.locator(".name").inner_text()
        row.locator(".name").hover(force=True)
        page.mouse.down()
        row.evaluate("row => { row.innerHTML = row.innerHTML; }")
        page.mouse.up()
        expect(page.locator("#heading")).to_contain_text(name)


def test_narrow_windows_and_zoom_leave_all_parts_in_view(tmp_path: Path) -> None:
    dataset = make_dataset(tmp_path / "set", presses=3)
    with served("label", dataset.folder) as address, opened(address) as page:
        page.wait_for_function("document.querySelector('#picture img').naturalWidth > 0")
        for width_px in (375, 700, 1280, 1920):
            page.set_viewport_size({"width": width_px, "height": 800})
            page.wait_for_function(f"innerWidth === {width_px}")
            for key in ("", "z", "z"):
                if not key:
                    page.wait_for_function(FITTING)
                else:
                    shown_px = page.locator("#picture").evaluate("x => x.clientWidth")
                    page.keyboard.press(key)
                    page.wait_for_function(
                        "before => document.querySelector('#picture').clientWidth > before",
                        arg=shown_px,
                    )
                page.wait_for_function(WITHIN, arg=["#picture path", "#view"])
                for part in ("#frames", "#view"):
                    assert page.locator(part).evaluate("x => x.clientWidth") > 150
                assert page.evaluate("document.documentElement.scrollWidth") <= width_px
            page.keyboard.press("z")  # and back


def test_a_page_loaded_anew_lists_frames_that_came_since_and_counts_those_seen(
    tmp_path: Path,
) -> None:
    dataset = make_dataset(tmp_path / "set", presses=3)
    first, second, third = dataset.labels
    came = dataset.folder / third.file
    came.rename(tmp_path / third.file)
    write_labels(dataset.folder / "labels.csv", [first, second])
    with served("label", dataset.folder) as address, opened(address) as page:
        looked_at = page.locator("#looked-at")
        expect(looked_at).to_have_text("0 of 2 frames checked")
        for key, seen in (("=", 1), ("Enter", 1), ("Backspace", 2), ("Control+z", 1)):
            page.keyboard.press(key)
            expect(looked_at).to_have_text(f"{seen} of 2 frames checked")
        before = page.context.new_page()
        before.goto(address)
        before.locator("#frames").wait_for()
        (tmp_path / third.file).rename(came)
        page.reload()
        expect(page.locator("#frames")).to_contain_text(third.file)
        expect(looked_at).to_have_text("1 of 3 frames checked")
        page.locator("#frames [role=option]", has_text=third.file).click()
        expect(page.locator("#heading")).to_contain_text(third.file)
        page.keyboard.press("Delete")
        expect(looked_at).to_have_text("2 of 3 frames checked")
        before.keyboard.press("Control+z")
        before.get_by_text(f"The change to {third.file}, which is not in this list").wait_for()
    assert labels(dataset)[first.file].contact_radius_px > first.contact_radius_px
    assert not LabelBook(read_dataset(dataset.folder)).has_no_ball(third.file)


def test_a_magnified_picture_leaves_its_buttons_in_view(tmp_path: Path) -> None:
    dataset = make_dataset(tmp_path / "set", presses=1)
    with served("label", dataset.folder) as address, opened(address, 1280, 720) as page:
        for _ in range(2):
            before = page.locator("#picture").evaluate("x => x.clientWidth")
            page.get_by_role("button", name="Zoom").click()
            page.wait_for_function(
                "before => document.querySelector('#picture').clientWidth > before", arg=before
            )
            assert page.get_by_role("button").evaluate_all(f"all => all.every({SEEN})")
