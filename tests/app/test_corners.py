# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""`wedge label --corners`: the book of corners, and the page in a real browser, killed midway."""

import os
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from playwright.sync_api import WebSocket, expect

from app.pages.corners import DIGIT_PX, label_places
from recon.geometry.lens import Lens, write_lens
from recon.labels.corner_book import CornerBook
from recon.labels.label_book import LabelBook
from recon.presses import press_reader, read_background
from sensor.dataset import BallLabel, Dataset, read_dataset, write_card, write_labels
from sensor.errors import WedgeError
from tests.app.commands import run
from tests.app.served import opened, served, serving
from tests.browser import needs_chromium
from tests.synthetic import KEYSTONE_PX, make_dataset

ROOT = Path(__file__).resolve().parents[2]
LIGHTS_DEG = {"R": -95.0, "G": 180.0, "B": 94.0}
FILLS = """x => x.clientWidth >= x.parentElement.clientWidth - 1
    || (x.clientHeight > 0.7 * innerHeight && x.clientHeight < innerHeight)"""


def raw_set(folder: Path, quality: float | None) -> Dataset:
    dataset = make_dataset(folder, presses=3, corners_px=KEYSTONE_PX)
    labels: list[BallLabel] = [replace(label, quality=quality) for label in dataset.labels]
    write_labels(folder / "labels.csv", labels)
    return read_dataset(folder)


def test_a_moved_corner_is_on_disk_and_can_be_taken_back(tmp_path: Path) -> None:
    dataset = raw_set(tmp_path / "set", quality=0.9)
    before = (dataset.folder / "dataset.toml").read_bytes()
    book = CornerBook(dataset, read_background(dataset))
    book.put(book.moved(2, (141.0, 105.0)))
    assert read_dataset(dataset.folder).card.corners_px == (
        *KEYSTONE_PX[:2],
        (141.0, 105.0),
        KEYSTONE_PX[3],
    )
    assert read_dataset(dataset.folder).labels == ()  # found in pixels of the old corners
    book.turn()
    book.mirror()
    assert [book.undo() for _ in range(4)] == [True, True, True, False]
    assert (dataset.folder / "dataset.toml").read_bytes() == before
    assert read_dataset(dataset.folder).labels == dataset.labels


def test_circles_come_back_with_their_corners_but_where_no_ball_touches(tmp_path: Path) -> None:
    dataset = raw_set(tmp_path / "set", quality=0.9)
    book = CornerBook(dataset, read_background(dataset))
    assert [book.turn(), book.turn()] == [3, 0]
    LabelBook(read_dataset(dataset.folder)).remove(dataset.labels[1].file)
    assert book.undo() and not read_dataset(dataset.folder).labels
    assert book.undo()
    assert read_dataset(dataset.folder).labels == (dataset.labels[0], dataset.labels[2])


def lit(dataset: Dataset, lights_deg: dict[str, float]) -> Dataset:
    """The set, once somebody has said where its lights sit."""
    write_card(dataset.folder / "dataset.toml", replace(dataset.card, lights_deg=lights_deg))
    return read_dataset(dataset.folder)


def test_turning_four_times_and_mirroring_twice_change_nothing(tmp_path: Path) -> None:
    dataset = lit(raw_set(tmp_path / "set", quality=0.9), LIGHTS_DEG)
    book = CornerBook(dataset, read_background(dataset))
    upright = book.unwarp(book.blank)
    book.mirror()
    np.testing.assert_allclose(book.unwarp(book.blank), upright[::-1], atol=2e-3)
    book.mirror()
    for _ in range(4):
        book.turn()
    assert book.corners_px == KEYSTONE_PX
    assert read_dataset(dataset.folder).card.lights_deg == LIGHTS_DEG


def test_lights_keep_their_sides_of_the_pad_when_its_picture_is_turned(tmp_path: Path) -> None:
    dataset = lit(raw_set(tmp_path / "set", quality=0.9), LIGHTS_DEG)
    book = CornerBook(dataset, read_background(dataset))

    def in_raw_frame(book: CornerBook) -> dict[str, tuple[float, float]]:
        """Which way each light is seen from the pad's middle, by the corners at its sides."""
        a, b, _, d = np.array(book.corners_px)
        along_x, along_y = b - a, d - a
        sides = {}
        for color, angle in read_dataset(book.folder).card.lights_deg.items():
            x, y = np.cos(np.radians(angle)), np.sin(np.radians(angle))
            toward = x * along_x / np.hypot(*along_x) + y * along_y / np.hypot(*along_y)
            sides[color] = tuple(toward / np.hypot(*toward))
        return sides

    before = in_raw_frame(book)
    for change in (book.turn, book.mirror, book.turn):
        change()
        for color, toward in in_raw_frame(book).items():  # the keystone is no rectangle
            assert np.dot(toward, before[color]) > 0.95
    while book.undo():
        pass
    assert read_dataset(dataset.folder).card.lights_deg == LIGHTS_DEG


def test_lights_measured_after_a_turn_outlive_its_undo(tmp_path: Path) -> None:
    dataset = lit(raw_set(tmp_path / "set", quality=0.9), LIGHTS_DEG)
    book = CornerBook(dataset, read_background(dataset))
    book.turn()
    measured = {"R": 10.0, "G": 20.0, "B": 30.0}
    lit(read_dataset(dataset.folder), measured)
    assert book.undo()
    assert read_dataset(dataset.folder).card.lights_deg == measured


@pytest.mark.parametrize(("quality", "ball_mm"), [(None, None), (1.0, None), (0.9, 3.5)])
def test_circles_and_balls_that_somebody_wrote_keep_the_corners(
    tmp_path: Path, quality: float | None, ball_mm: float | None
) -> None:
    dataset = raw_set(tmp_path / "set", quality=quality)
    first, *others = dataset.labels
    write_labels(dataset.folder / "labels.csv", [replace(first, ball_radius_mm=ball_mm), *others])
    dataset = read_dataset(dataset.folder)
    before = [path.read_bytes() for path in sorted(dataset.folder.iterdir())]
    book = CornerBook(dataset, read_background(dataset))
    with pytest.raises(WedgeError, match="drew or confirmed"):
        book.turn()
    assert [path.read_bytes() for path in sorted(dataset.folder.iterdir())] == before


def test_a_folder_that_cannot_be_written_loses_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    dataset = raw_set(tmp_path / "set", quality=0.9)
    before = {path.name: path.read_bytes() for path in dataset.folder.iterdir()}
    corner_book = CornerBook(dataset, read_background(dataset))
    label_book = LabelBook(dataset)

    def refuse(*_: object) -> None:
        raise PermissionError(13, "Permission denied", str(dataset.folder))

    monkeypatch.setattr(os, "replace", refuse)
    for change in (corner_book.turn, lambda: label_book.remove(dataset.labels[0].file)):
        with pytest.raises((OSError, WedgeError)):
            change()
    assert corner_book.corners_px == KEYSTONE_PX
    assert label_book.labels == dataset.labels
    assert {path.name: path.read_bytes() for path in dataset.folder.iterdir()} == before


def test_a_folded_pad_and_corners_changed_meanwhile_are_refused(tmp_path: Path) -> None:
    dataset = raw_set(tmp_path / "set", quality=0.9)
    book = CornerBook(dataset, read_background(dataset))
    with pytest.raises(WedgeError, match="convex"):
        book.put(book.moved(0, (150.0, 100.0)))
    path = dataset.folder / "dataset.toml"
    path.write_text(path.read_text().replace("[20.0, 10.0]", "[21.0, 10.0]"))
    edited = path.read_bytes()
    with pytest.raises(WedgeError, match="another tab or program"):
        book.turn()
    assert path.read_bytes() == edited
    assert len(read_dataset(dataset.folder).labels) == 3


def test_a_circle_in_pixels_of_corners_mended_meanwhile_is_not_written(tmp_path: Path) -> None:
    dataset = raw_set(tmp_path / "set", quality=0.9)
    write_labels(dataset.folder / "labels.csv", [])
    label_book = LabelBook(read_dataset(dataset.folder))
    CornerBook(dataset, read_background(dataset)).turn()
    for _ in range(2):
        with pytest.raises(WedgeError, match=r"dataset\.toml was changed by another program"):
            label_book.put(dataset.labels[0])
    assert read_dataset(dataset.folder).labels == ()


def test_circles_looked_at_meanwhile_keep_the_corners(tmp_path: Path) -> None:
    dataset = raw_set(tmp_path / "set", quality=0.9)
    corner_book, label_book = CornerBook(dataset, read_background(dataset)), LabelBook(dataset)
    label_book.put(replace(dataset.labels[0], quality=1.0))
    before = {path.name: path.read_bytes() for path in dataset.folder.iterdir()}
    with pytest.raises(WedgeError, match="drew or confirmed"):
        corner_book.turn()
    assert {path.name: path.read_bytes() for path in dataset.folder.iterdir()} == before
    label_book.undo()
    corner_book.turn()
    assert read_dataset(dataset.folder).labels == ()


def test_the_unwarped_picture_is_the_one_that_is_learnt_from(tmp_path: Path) -> None:
    dataset = raw_set(tmp_path / "set", quality=0.9)
    blank = read_background(dataset)
    lens = Lens(
        frame_size_px=(160, 120),
        focal_px=(160.0, 160.0),
        center_px=(80.0, 60.0),
        radial=(-0.3, 0.0, 0.0),
        rms_px=0.1,
    )
    write_lens(dataset.folder / "camera.toml", lens)
    reader = press_reader(dataset)
    frame = np.random.default_rng(0).integers(0, 256, (120, 160, 3), np.uint8)
    shown = CornerBook(dataset, blank, reader.lens).unwarp(frame)
    np.testing.assert_array_equal(shown, reader.unwarp(frame))
    assert np.abs(shown - CornerBook(dataset, blank).unwarp(frame)).max() > 0.1


def test_digits_stand_clear_of_rings_and_within_the_frame() -> None:
    size_px, ring_px = (240, 180), 5
    for corners in (
        ((60.0, 40.0), (180.0, 45.0), (175.0, 140.0), (65.0, 138.0)),
        ((1.0, 1.0), (238.0, 1.0), (238.0, 178.0), (1.0, 178.0)),
    ):
        for corner, (x, y) in zip(corners, label_places(corners, size_px), strict=True):
            apart = np.abs(np.subtract(corner, (x, y)))
            assert np.hypot(*apart) > ring_px + DIGIT_PX / 2
            assert 4 <= x <= size_px[0] - 4 and 4 <= y <= size_px[1] - 4


def test_corners_without_a_page_are_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run("label", tmp_path, "--corners", "--no-page") == 2
    assert "--no-page opens none: leave one of them out" in capsys.readouterr().err


@needs_chromium
def test_the_browsers_keys_and_an_unseen_frame_change_no_corner(tmp_path: Path) -> None:
    folder = raw_set(tmp_path / "set", quality=0.9).folder
    before = [(folder / name).read_bytes() for name in ("dataset.toml", "labels.csv")]
    (folder / "press00.png").write_bytes(b"no picture")
    with served("label", folder, "--corners") as address, opened(address) as page:
        heading = page.locator("#heading")
        for keys in ("Meta+t", "Alt+ArrowLeft", "Meta+m", "Control+f", "n"):
            page.keyboard.press(keys)
        expect(heading).to_contain_text("press00.png cannot be shown")
        expect(page.locator("#raw")).to_be_hidden()
        page.get_by_text("Turn", exact=True).click()
        for key in ("ArrowLeft", "m", "f", "1", "n"):
            page.keyboard.press(key)
        expect(heading).to_contain_text("press01.png: corner 1")
        expect(page.locator("#raw")).to_be_visible()
        page.get_by_role("button", name="Previous frame").click()
        expect(heading).to_contain_text("press00.png")
        page.get_by_role("button", name="Next frame").click()
        expect(heading).to_contain_text("press01.png")
        files = [(folder / name).read_bytes() for name in ("dataset.toml", "labels.csv")]
        assert files == before


@needs_chromium
def test_turning_quickly_leaves_no_picture_out_and_a_drag_sends_none_again(tmp_path: Path) -> None:
    folder = raw_set(tmp_path / "set", quality=0.9).folder
    x, y = KEYSTONE_PX[0]
    sent: list[str] = []
    received: list[str] = []

    def listen(socket: WebSocket) -> None:
        socket.on("framesent", lambda message: sent.append(str(message)))
        socket.on("framereceived", lambda message: received.append(str(message)))

    with served("label", folder, "--corners") as address, opened(address) as page:
        page.on("websocket", listen)
        page.reload()
        for part in ("#raw", "#preview"):
            page.wait_for_function(f"document.querySelector('{part} img')?.naturalWidth > 0")
            page.locator(f"{part} img").first.evaluate(
                "img => { img.missing = 0; img.addEventListener('error', () => img.missing += 1); }"
            )
        for _ in range(30):
            page.keyboard.press("n")
        page.keyboard.press("4")  # told after all these
        expect(page.locator("#heading")).to_contain_text("press01.png: corner 4")
        for part in ("#raw", "#preview"):
            page.wait_for_function(f"document.querySelector('{part} img').complete")
            assert page.locator(f"{part} img").first.evaluate("img => img.missing") == 0
        box = page.locator("#raw img").first.bounding_box()
        assert box is not None
        scale = box["width"] / 160
        raw, preview = (page.locator(f"{part} img").first for part in ("#raw", "#preview"))
        shown, unwarped = raw.get_attribute("src"), preview.get_attribute("src")
        assert shown and unwarped
        place = (box["x"] + (x + 0.5) * scale, box["y"] + (y + 0.5) * scale)
        ring = page.locator("#raw circle").first.bounding_box()
        assert ring is not None
        drawn = (ring["x"] + ring["width"] / 2, ring["y"] + ring["height"] / 2)
        assert drawn == pytest.approx(place, abs=1)
        page.mouse.move(*place)
        received.clear()
        page.mouse.down()
        page.mouse.move(box["x"] + 0.5 * scale, box["y"] + 0.5 * scale, steps=3)
        page.mouse.up()
        expect(preview).not_to_have_attribute("src", unwarped)
        assert read_dataset(folder).card.corners_px != KEYSTONE_PX
        assert received and not any(shown in message for message in received)
        assert sent and not any("data:image" in message for message in sent)  # by the browser


@needs_chromium
def test_a_fine_pitch_leaves_room_for_the_raw_frame(tmp_path: Path) -> None:
    folder = raw_set(tmp_path / "set", quality=0.9).folder
    card = read_dataset(folder).card
    x, y = card.mm_per_px
    write_labels(folder / "labels.csv", [])
    write_card(folder / "dataset.toml", replace(card, mm_per_px=(x / 15, y / 15)))
    with served("label", folder, "--corners") as address, opened(address) as page:
        page.wait_for_function("document.querySelector('#preview img').naturalWidth > 1000")
        for width_px in (375, 700, 1280, 1920):
            page.set_viewport_size({"width": width_px, "height": 800})
            page.wait_for_function(f"window.innerWidth === {width_px}")
            for part in ("#raw", "#preview"):
                assert 300 < page.locator(part).evaluate("x => x.clientWidth") < width_px
            assert page.locator("#raw").evaluate(FILLS)
            assert page.evaluate("document.documentElement.scrollWidth") <= width_px


@needs_chromium
def test_a_corner_is_dragged_in_a_browser_and_survives_a_kill(tmp_path: Path) -> None:
    folder = raw_set(tmp_path / "set", quality=0.9).folder
    with serving("label", folder, "--corners") as (address, server), opened(address) as page:
        expect(page.locator("#heading")).to_contain_text("corner 1")
        preview = page.locator("#preview img").first
        preview.wait_for()
        first = preview.get_attribute("src") or ""
        box = page.locator("#raw img").first.bounding_box()
        assert box is not None
        scale = box["width"] / 160
        x, y = (
            edge + (at + 0.5) * scale
            for edge, at in zip((box["x"], box["y"]), KEYSTONE_PX[2], strict=True)
        )
        page.mouse.move(x, y)
        page.mouse.down()
        page.mouse.move(x - 6 * scale, y - 3 * scale, steps=3)
        page.mouse.up()
        wanted = (KEYSTONE_PX[2][0] - 6, KEYSTONE_PX[2][1] - 3)
        expect(preview).not_to_have_attribute("src", first)  # of what is kept, not of what is held
        dragged = preview.get_attribute("src") or ""
        page.keyboard.press("ArrowRight")
        expect(preview).not_to_have_attribute("src", dragged)
        page.mouse.move(x, y)
        page.mouse.down()
        page.mouse.move(x - 40 * scale, y, steps=3)  # held, never let go
        server.kill()
    moved = read_dataset(folder).card.corners_px
    assert moved is not None
    assert moved[2] == pytest.approx((wanted[0] + 1, wanted[1]), abs=0.4)
    assert moved[:2] == KEYSTONE_PX[:2]
