# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""`wedge label`: the command, the book of labels, and the page in a real browser."""

import errno
import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from playwright.sync_api import expect

from recon.images import write_image
from recon.labelling import (
    CERTAIN,
    LabelBook,
    automatic_label,
    doubtful_first,
    pressed_frames,
)
from recon.presses import press_reader
from sensor.dataset import read_dataset
from sensor.errors import WedgeError
from tests.app.served import needs_chromium, opened, served
from tests.synthetic import make_dataset

ROOT = Path(__file__).resolve().parents[2]


def wedge(*words: str) -> list[str]:
    return [sys.executable, "-P", "-m", "app", *words]


def test_circles_are_found_without_a_label(tmp_path: Path) -> None:
    truth = make_dataset(tmp_path / "set", presses=4, in_npz=True).labels
    (tmp_path / "set" / "labels.csv").unlink()
    command = wedge("label", str(tmp_path / "set"), "--no-page")
    subprocess.run(command, cwd=ROOT, check=True, capture_output=True)
    found = {label.file: label for label in read_dataset(tmp_path / "set").labels}
    assert found.keys() == {label.file for label in truth}
    for label in truth:
        circle = found[label.file]
        off = (circle.center_x_px - label.center_x_px, circle.center_y_px - label.center_y_px)
        assert np.hypot(*off) < 1.0
        assert circle.contact_radius_px == pytest.approx(label.contact_radius_px, rel=0.15)


def test_a_frame_of_another_camera_is_named(tmp_path: Path) -> None:
    dataset = make_dataset(tmp_path / "set", presses=1)
    write_image(dataset.folder / "odd.png", np.zeros((64, 48, 3), np.uint8))
    with pytest.raises(WedgeError, match=r"odd\.png: .*48x64.*Take it out"):
        automatic_label(press_reader(dataset), "odd.png")


def test_every_change_is_on_disk_at_once_and_can_be_undone(tmp_path: Path) -> None:
    dataset = make_dataset(tmp_path / "set", presses=3)
    book = LabelBook(dataset)
    before = (dataset.folder / "labels.csv").read_bytes()
    first, second = dataset.labels[:2]
    book.put(replace(first, center_x_px=first.center_x_px + 1, quality=CERTAIN))
    moved = read_dataset(dataset.folder).labels
    assert moved[0].center_x_px == first.center_x_px + 1
    assert moved[1:] == dataset.labels[1:]
    book.remove(second.file)
    assert len(read_dataset(dataset.folder).labels) == 2
    assert [book.undo(), book.undo(), book.undo()] == [second.file, first.file, None]
    assert (dataset.folder / "labels.csv").read_bytes() == before


def test_labels_changed_by_another_hand_are_not_overwritten(tmp_path: Path) -> None:
    dataset = make_dataset(tmp_path / "set", presses=3)
    book = LabelBook(dataset)
    path = dataset.folder / "labels.csv"
    path.write_text("\n".join(path.read_text().splitlines()[:-1]) + "\n")
    edited = path.read_bytes()
    with pytest.raises(WedgeError, match="another program"):
        book.remove(dataset.labels[0].file)
    assert path.read_bytes() == edited
    assert book.label(dataset.labels[0].file) is not None


def test_a_read_only_folder_is_a_sentence_and_nothing_is_lost(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    dataset = make_dataset(tmp_path / "set", presses=2)
    book, first = LabelBook(dataset), dataset.labels[0]
    before = (dataset.folder / "labels.csv").read_bytes()
    opened = Path.open

    def read_only(path: Path, mode: str = "r", *rest: Any, **options: Any) -> Any:
        if "r" not in mode or "+" in mode:
            raise OSError(errno.EROFS, os.strerror(errno.EROFS))
        return opened(path, mode, *rest, **options)

    monkeypatch.setattr(Path, "open", read_only)
    with pytest.raises(WedgeError, match=r"labels\.csv cannot be written: Read-only file system"):
        book.put(replace(first, center_x_px=first.center_x_px + 1))
    assert book.label(first.file) == first
    assert book.undo() is None
    assert (dataset.folder / "labels.csv").read_bytes() == before


def test_the_doubtful_come_first_and_the_seen_last(tmp_path: Path) -> None:
    dataset = make_dataset(tmp_path / "set", presses=4)
    files = pressed_frames(dataset.folder, dataset.card)
    book = LabelBook(dataset)
    for file, quality in zip(files, (0.9, CERTAIN, 0.4), strict=False):
        label = book.label(file)
        assert label is not None
        book.put(replace(label, quality=quality))
    book.remove(files[3])  # that too is a look
    assert doubtful_first(files, book) == [files[2], files[0], files[1], files[3]]
    assert doubtful_first([*files, "new.png"], book)[2] == "new.png"


def test_that_no_ball_touches_outlives_the_page(tmp_path: Path) -> None:
    folder = make_dataset(tmp_path / "set", presses=3).folder
    book = LabelBook(read_dataset(folder))
    first, second, third = (label.file for label in book.labels)
    for file in (first, second):
        book.remove(file)
    book.remove(third)
    assert book.undo() == third and not book.has_no_ball(third)
    circle = book.label(third)
    assert circle is not None
    book.put(replace(circle, file=second))
    assert book.undo() == second and book.has_no_ball(second)
    book.put(replace(circle, file=second))
    assert not book.has_no_ball(second)

    command = wedge("label", str(folder), "--no-page")
    done = subprocess.run(command, cwd=ROOT, check=True, capture_output=True, text=True)
    assert "No ball was found" not in done.stdout
    assert [label.file for label in read_dataset(folder).labels] == [second, third]
    assert LabelBook(read_dataset(folder)).has_no_ball(first)
    subprocess.run([*command, "--again"], cwd=ROOT, check=True, capture_output=True)
    assert len(read_dataset(folder).labels) == 3
    assert not LabelBook(read_dataset(folder)).has_no_ball(first)


def test_a_change_that_fails_half_way_leaves_both_files(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    dataset = make_dataset(tmp_path / "set", presses=2)
    book, (first, second) = LabelBook(dataset), (label.file for label in dataset.labels)
    book.remove(first)
    before = {path.name: path.read_bytes() for path in dataset.folder.iterdir()}

    def refuse(*_: object) -> None:
        raise WedgeError("the disk is full.")

    monkeypatch.setattr("recon.labelling.write_labels", refuse)
    with pytest.raises(WedgeError, match="full"):
        book.remove(second)
    assert {path.name: path.read_bytes() for path in dataset.folder.iterdir()} == before
    assert book.has_no_ball(first) and not book.has_no_ball(second)


def test_a_damaged_list_of_frames_without_a_ball_is_a_sentence(tmp_path: Path) -> None:
    dataset = make_dataset(tmp_path / "set", presses=1)
    (dataset.folder / "no_ball.txt").write_bytes(b"\xff\n")
    with pytest.raises(WedgeError, match=r"no_ball\.txt cannot be read"):
        LabelBook(dataset)


@needs_chromium
def test_a_circle_is_dragged_resized_and_undone_in_a_browser(tmp_path: Path) -> None:
    folder = make_dataset(tmp_path / "set", presses=3).folder
    before = {label.file: label for label in read_dataset(folder).labels}
    with served("label", folder) as address, opened(address) as page:
        heading = page.locator("#heading")
        expect(heading).to_contain_text("centre")
        file = heading.inner_text().split(":")[0]
        picture = page.locator("#picture img").first
        expect(picture).to_have_js_property("complete", True)
        box = picture.bounding_box()
        assert box is not None
        scale = box["width"] / 120
        label = before[file]
        x = box["x"] + (label.center_x_px + 0.5) * scale
        y = box["y"] + (label.center_y_px + 0.5) * scale
        page.mouse.move(x, y)
        page.mouse.down()
        page.mouse.move(x + 5 * scale, y, steps=3)
        expect(heading).to_contain_text("let go to keep")
        assert read_dataset(folder).labels == tuple(before.values())
        page.mouse.up()
        expect(heading).to_contain_text("quality 1.00")
        moved = {item.file: item for item in read_dataset(folder).labels}[file]
        assert moved.center_x_px == pytest.approx(label.center_x_px + 5, abs=0.5)
        assert moved.center_y_px == pytest.approx(label.center_y_px, abs=0.5)
        page.keyboard.press("ArrowDown")
        expect(heading).to_contain_text(f"{moved.center_y_px + 1:.2f})")
        page.keyboard.press("Control+z")
        page.keyboard.press("Control+z")
        expect(heading).to_contain_text("not scored")
        assert {item.file: item for item in read_dataset(folder).labels}[file] == label
        page.keyboard.press("ArrowRight")
        expect(heading).to_contain_text("quality 1.00")
    after = {item.file: item for item in read_dataset(folder).labels}
    assert after[file].center_x_px == pytest.approx(label.center_x_px + 1)
    assert after.keys() == before.keys()


def test_a_set_whose_background_is_missing_gets_no_labels(tmp_path: Path) -> None:
    dataset = make_dataset(tmp_path / "set", presses=1)
    (dataset.folder / "labels.csv").unlink()
    (dataset.folder / "background.png").unlink()
    words = wedge("label", str(dataset.folder), "--no-page")
    done = subprocess.run(words, cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 2 and "background.png" in done.stderr
    assert not (dataset.folder / "labels.csv").exists()
