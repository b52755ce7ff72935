# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""`wedge label` in two tabs or programs: undo takes back what was done here and still stands."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import pytest
from playwright.sync_api import Page, expect

from recon.labels.corner_book import CornerBook, Move
from recon.labels.label_book import CERTAIN, Change, LabelBook
from recon.presses import read_background
from sensor.dataset import BallLabel, Dataset, read_dataset, write_card, write_labels
from sensor.errors import WedgeError
from sensor.toml import Pair
from tests.app.served import opened, served
from tests.browser import needs_chromium
from tests.synthetic import KEYSTONE_PX, make_dataset

AFTER = "after your change, which is not undone"


def moved(label: BallLabel, by_px: float) -> BallLabel:
    return replace(label, center_x_px=label.center_x_px + by_px, quality=CERTAIN)


def labels(dataset: Dataset) -> tuple[BallLabel, ...]:
    return read_dataset(dataset.folder).labels


def corners(dataset: Dataset) -> tuple[Pair, ...] | None:
    return read_dataset(dataset.folder).card.corners_px


def test_undo_leaves_what_somebody_else_made_of_ones_own_change(tmp_path: Path) -> None:
    dataset = make_dataset(tmp_path / "set", presses=3)
    first, second, third = dataset.labels
    mine, theirs = LabelBook(dataset), LabelBook(dataset)
    mine.put(moved(first, 1))
    mine.put(moved(second, 1))
    theirs.catch_up()
    theirs.put(moved(second, 5))
    theirs.put(moved(third, 5))
    with pytest.raises(WedgeError, match=f"{second.file} .* {AFTER}"):
        mine.undo()
    assert labels(dataset) == (moved(first, 1), moved(second, 5), moved(third, 5))
    assert [mine.undo(), mine.undo()] == [first.file, None]
    assert labels(dataset) == (first, moved(second, 5), moved(third, 5))
    assert [theirs.undo(), theirs.undo(), theirs.undo()] == [third.file, second.file, None]
    assert labels(dataset) == (first, moved(second, 1), third)


def test_books_of_one_history_take_back_each_others_changes(tmp_path: Path) -> None:
    dataset = make_dataset(tmp_path / "set", presses=2)
    first, second = dataset.labels
    history: list[Change] = []
    one, two = LabelBook(dataset, history), LabelBook(dataset, history)
    one.put(moved(first, 1))
    two.put(moved(second, 1))
    assert one.undo() == second.file
    assert LabelBook(read_dataset(dataset.folder), history).undo() == first.file
    assert labels(dataset) == dataset.labels and two.undo() is None


def test_corner_books_of_one_history_take_back_each_others_moves(tmp_path: Path) -> None:
    dataset = raw_set(tmp_path / "set")
    blank = read_background(dataset)
    history: list[Move] = []
    one, two = (CornerBook(dataset, blank, None, history) for _ in range(2))
    one.turn()
    two.catch_up()
    two.mirror()
    assert one.undo() and corners(dataset) == (*KEYSTONE_PX[1:], KEYSTONE_PX[0])
    assert CornerBook(dataset, blank, None, history).undo() and not two.undo()
    assert read_dataset(dataset.folder) == dataset


def test_changes_of_a_held_key_are_taken_back_together_and_no_others(tmp_path: Path) -> None:
    dataset = make_dataset(tmp_path / "set", presses=2)
    first, second = dataset.labels
    book = LabelBook(dataset)
    book.put(moved(second, 1))
    book.put(moved(first, 1))
    book.put(moved(first, 2))
    for by_px in (3, 4):
        book.put(moved(first, by_px), held=True)
    book.put(moved(second, 2), held=True)  # nothing of it is held
    assert [book.undo(), book.undo()] == [second.file, first.file]
    assert labels(dataset) == (moved(first, 1), moved(second, 1))
    assert [book.undo(), book.undo(), book.undo()] == [first.file, second.file, None]


def test_circles_that_a_held_key_dropped_come_back_at_once(tmp_path: Path) -> None:
    dataset = raw_set(tmp_path / "set")
    book = CornerBook(dataset, read_background(dataset))
    x, y = KEYSTONE_PX[0]
    for step in range(3):
        book.put(book.moved(0, (x + 1 + step, y)), held=step > 0)
    assert labels(dataset) == () and book.undo() and not book.undo()
    assert read_dataset(dataset.folder) == dataset


def test_a_name_or_light_written_meanwhile_moves_no_circle(tmp_path: Path) -> None:
    dataset = make_dataset(tmp_path / "set", presses=1)
    book = LabelBook(dataset)
    write_card(dataset.folder / "dataset.toml", replace(dataset.card, name="x", lights_deg=None))
    book.put(after := moved(dataset.labels[0], 1))
    assert labels(dataset) == (after,)


def raw_set(folder: Path) -> Dataset:
    dataset = make_dataset(folder, presses=2, corners_px=KEYSTONE_PX)
    write_labels(folder / "labels.csv", [replace(x, quality=0.9) for x in dataset.labels])
    return read_dataset(folder)


def test_what_somebody_wrote_into_the_card_outlives_moved_corners(tmp_path: Path) -> None:
    dataset = raw_set(tmp_path / "set")
    path, blank = dataset.folder / "dataset.toml", read_background(dataset)
    write_card(path, replace(dataset.card, ball_radius_mm=5.0))  # before the book is opened
    book = CornerBook(dataset, blank)
    book.turn()
    edited = replace(read_dataset(dataset.folder).card, name="other", pad_size_mm=(12.5, 9.5))
    write_card(path, edited)
    book.turn()
    a, b, c, d = KEYSTONE_PX
    after = read_dataset(dataset.folder).card
    turned = {color: angle - 90 for color, angle in edited.lights_deg.items()}
    assert after == replace(edited, corners_px=(c, d, a, b), lights_deg=turned)
    assert after.ball_radius_mm == 5.0
    assert [book.undo(), book.undo(), book.undo()] == [True, True, False]
    before = {"corners_px": KEYSTONE_PX, "lights_deg": dataset.card.lights_deg}
    assert read_dataset(dataset.folder).card == replace(edited, **before)


def test_corners_moved_by_somebody_else_are_seen_before_they_are_moved(tmp_path: Path) -> None:
    dataset = raw_set(tmp_path / "set")
    blank = read_background(dataset)
    mine, theirs = CornerBook(dataset, blank), CornerBook(dataset, blank)
    mine.put(mine.moved(0, (21.0, 11.0)))
    with pytest.raises(WedgeError, match="in another tab or program meanwhile"):
        theirs.put(theirs.moved(1, (149.0, 18.0)))
    assert corners(dataset) == mine.corners_px == theirs.corners_px
    theirs.put(theirs.moved(1, (149.0, 18.0)))
    with pytest.raises(WedgeError, match=AFTER):
        mine.undo()
    assert not mine.undo()
    assert corners(dataset) == ((21.0, 11.0), (149.0, 18.0), *KEYSTONE_PX[2:])
    assert theirs.undo()
    assert corners(dataset) == ((21.0, 11.0), *KEYSTONE_PX[1:])


def test_corners_that_were_not_there_are_gone_when_taken_back(tmp_path: Path) -> None:
    dataset = make_dataset(tmp_path / "set", presses=1)
    write_labels(dataset.folder / "labels.csv", [])
    path = dataset.folder / "dataset.toml"
    before = path.read_bytes()
    book = CornerBook(dataset, read_background(dataset))
    book.turn()
    assert corners(dataset) == book.corners_px
    book.undo()
    assert path.read_bytes() == before


def test_corners_put_where_they_are_keep_the_circles(tmp_path: Path) -> None:
    dataset = raw_set(tmp_path / "set")
    book = CornerBook(dataset, read_background(dataset))
    book.put(book.moved(0, KEYSTONE_PX[0]))
    assert labels(dataset) == dataset.labels and not book.undo()


def round_set(folder: Path) -> Dataset:
    """Two circles at whole pixels, which the page rounds no further."""
    dataset = make_dataset(folder, presses=2)
    places = [
        replace(x, center_x_px=50.0 + i, center_y_px=40.0) for i, x in enumerate(dataset.labels)
    ]
    write_labels(folder / "labels.csv", places)
    return read_dataset(folder)


@contextmanager
def two_tabs(*words: object) -> Iterator[tuple[Page, Page]]:
    with served(*words) as address, opened(address) as one:
        two = one.context.new_page()
        two.goto(address)
        expect(two.locator("#heading")).to_have_text(one.locator("#heading").inner_text())
        yield one, two


@needs_chromium
def test_undo_takes_back_what_was_done_in_tabs_that_are_gone(tmp_path: Path) -> None:
    dataset = round_set(tmp_path / "set")
    first, second = dataset.labels
    with two_tabs("label", dataset.folder) as (one, two):
        one.keyboard.press("ArrowRight")
        expect(one.locator("#heading")).to_contain_text("quality 1.00")
        two.keyboard.press("n")
        expect(two.locator("#frames")).to_contain_text("seen")
        two.keyboard.press("ArrowRight")
        expect(two.locator("#heading")).to_contain_text("quality 1.00")
        assert labels(dataset) == (moved(first, 1), moved(second, 1))
        one.close()
        two.reload()
        for label in (second, first):
            two.keyboard.press("Control+z")
            expect(two.locator("#heading")).to_contain_text(f"{label.file}: centre")
            expect(two.locator("#heading")).to_contain_text("not scored")
        assert labels(dataset) == (first, second)
        two.keyboard.press("Control+z")
        two.get_by_text("nothing left to undo").wait_for()


@needs_chromium
@pytest.mark.parametrize("words", [(), ("--corners",)])
def test_a_held_arrow_key_is_one_step_of_undo(tmp_path: Path, words: tuple[str, ...]) -> None:
    dataset = raw_set(tmp_path / "set")
    with served("label", dataset.folder, *words) as address, opened(address) as page:
        heading = page.locator("#heading")
        before = heading.inner_text()
        for _ in range(4):
            page.keyboard.down("ArrowRight")  # no key up between: it repeats
        page.keyboard.up("ArrowRight")
        page.keyboard.press("Control+z")
        expect(heading).to_have_text(before)
        page.keyboard.press("Control+z")
        page.get_by_text("nothing left to undo").wait_for()
        assert read_dataset(dataset.folder) == dataset


@needs_chromium
def test_a_change_that_somebody_built_on_is_not_taken_back_but_shown(tmp_path: Path) -> None:
    dataset = round_set(tmp_path / "set")
    first, second = dataset.labels
    with served("label", dataset.folder) as address, opened(address) as page:
        page.keyboard.press("ArrowRight")
        expect(page.locator("#heading")).to_contain_text("quality 1.00")
        LabelBook(read_dataset(dataset.folder)).put(moved(first, 2))  # another program's
        page.keyboard.press("n")
        page.keyboard.press("Control+z")
        page.get_by_text(AFTER).wait_for()
        expect(page.locator("#heading")).to_contain_text(f"({first.center_x_px + 2:.2f}, ")
        assert labels(dataset) == (moved(first, 2), second)


@needs_chromium
def test_corners_moved_in_another_tab_are_shown_and_taken_back(tmp_path: Path) -> None:
    dataset = raw_set(tmp_path / "set")
    x, y = KEYSTONE_PX[0]
    with two_tabs("label", dataset.folder, "--corners") as (one, two):
        one.keyboard.press("ArrowRight")
        expect(one.locator("#heading")).to_contain_text(f"({x + 1:.2f}, {y:.2f})")
        two.keyboard.press("ArrowDown")
        two.get_by_text("in another tab or program meanwhile").wait_for()
        expect(two.locator("#heading")).to_contain_text(f"({x + 1:.2f}, {y:.2f})")
        two.keyboard.press("ArrowDown")
        expect(two.locator("#heading")).to_contain_text(f"({x + 1:.2f}, {y + 1:.2f})")
        one.close()
        two.reload()
        for left in (f"({x + 1:.2f}, {y:.2f})", f"({x:.2f}, {y:.2f})"):
            two.keyboard.press("Control+z")
            expect(two.locator("#heading")).to_contain_text(left)
        assert read_dataset(dataset.folder) == dataset
        two.keyboard.press("Control+z")
        two.get_by_text("nothing left to undo").wait_for()
        two.keyboard.press("ArrowLeft")
        expect(two.locator("#heading")).to_contain_text(f"({x - 1:.2f}, {y:.2f})")
        theirs = CornerBook(read_dataset(dataset.folder), read_background(dataset))
        theirs.put(theirs.moved(0, (x + 5, y)))  # another program's
        two.keyboard.press("Control+z")
        two.get_by_text(AFTER).wait_for()
        expect(two.locator("#heading")).to_contain_text(f"({x + 5:.2f}, {y:.2f})")
        assert corners(dataset) == ((x + 5, y), *KEYSTONE_PX[1:])
