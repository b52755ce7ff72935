# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""`wedge label`: the command, the book of labels, and the page in a real browser."""

import errno
import math
import os
import shutil
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from multiprocessing.synchronize import Barrier
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image
from playwright.sync_api import expect

import app._workers
import app.label
import recon.labels.label_book
from recon.images import write_image
from recon.labels.find_circles import found_circle, found_labels
from recon.labels.label_book import CERTAIN, LabelBook, doubtful_first, pressed_frames
from recon.presses import press_reader
from sensor.dataset import BallLabel, Dataset, read_dataset, write_card, write_labels
from sensor.errors import WedgeError
from tests.app.commands import run
from tests.app.forked import FORKS
from tests.app.served import opened, served
from tests.browser import needs_chromium
from tests.synthetic import BALL_RADIUS_MM, make_dataset

ROOT = Path(__file__).resolve().parents[2]


def as_found(dataset: Dataset) -> list[BallLabel]:
    """The circles of all labelled frames, found anew."""
    with ThreadPoolExecutor(1) as pool:
        return found_labels(press_reader(dataset), [x.file for x in dataset.labels], pool)


def test_circles_are_found_without_a_label(tmp_path: Path) -> None:
    truth = make_dataset(tmp_path / "set", presses=4, in_npz=True).labels
    (tmp_path / "set" / "labels.csv").unlink()
    words = ("label", str(tmp_path / "set"), "--no-page")
    command = [sys.executable, "-P", "-m", "app", *words]
    done = subprocess.run(command, cwd=ROOT, check=True, capture_output=True, text=True)
    assert done.stdout == "Frames with a circle: 4 of 4; doubtful: 0.\n"
    found = {label.file: label for label in read_dataset(tmp_path / "set").labels}
    assert found.keys() == {label.file for label in truth}
    for label in truth:
        circle = found[label.file]
        assert math.dist(circle.center_px, label.center_px) < 1.0
        assert circle.contact_radius_px == pytest.approx(label.contact_radius_px, rel=0.15)


def test_circles_are_the_same_in_frames_of_other_formats(
    tmp_path: Path, in_this_process: None
) -> None:
    dataset = make_dataset(tmp_path / "set", presses=2)
    circles = as_found(dataset)
    (dataset.folder / "labels.csv").unlink()
    for file, ending in (("background.png", "BMP"), ("press00.png", "bmp"), ("press01.png", "tif")):
        picture = dataset.folder / file
        Image.open(picture).save(picture.with_suffix(f".{ending}"))
        picture.unlink()
    write_card(
        dataset.folder / "dataset.toml", replace(dataset.card, background=("background.BMP",))
    )
    assert label_quietly(dataset) == 0
    found = read_dataset(dataset.folder).labels
    assert [label.file for label in found] == ["press00.bmp", "press01.tif"]
    renamed = zip(found, dataset.labels, strict=True)
    assert [replace(label, file=before.file) for label, before in renamed] == circles


def test_a_frame_of_another_camera_is_named(tmp_path: Path) -> None:
    dataset = make_dataset(tmp_path / "set", presses=1)
    write_image(dataset.folder / "odd.png", np.zeros((64, 48, 3), np.uint8))
    with pytest.raises(WedgeError, match=r"odd\.png is 48x64 .*background\.png is .*remove what"):
        found_circle(press_reader(dataset), "odd.png")


def label_quietly(dataset: Dataset, *words: str) -> object:
    """The exit status of the automatic search."""
    return run("label", dataset.folder, "--no-page", *words)


def test_a_circle_found_again_is_that_of_the_press_s_own_ball(
    tmp_path: Path, in_this_process: None
) -> None:
    dataset = make_dataset(tmp_path / "set", presses=2)
    by_card = as_found(dataset)
    card = replace(dataset.card, ball_radius_mm=2 * BALL_RADIUS_MM)
    write_card(dataset.folder / "dataset.toml", card)
    own = [replace(x, ball_radius_mm=BALL_RADIUS_MM, quality=0.5) for x in dataset.labels]
    write_labels(dataset.folder / "labels.csv", own)
    assert label_quietly(dataset, "--again") == 0
    found = read_dataset(dataset.folder).labels
    assert [replace(label, ball_radius_mm=None) for label in found] == by_card
    assert {label.ball_radius_mm for label in found} == {BALL_RADIUS_MM}


def test_circles_found_are_saved_together_and_undo_leaves_them(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, in_this_process: None
) -> None:
    dataset = make_dataset(tmp_path / "set", presses=1)
    for index in range(8):
        shutil.copy(dataset.folder / dataset.labels[0].file, dataset.folder / f"more{index}.png")
    written: list[int] = []

    def counted(path: Path, labels: Any) -> None:
        written.append(len(labels))
        write_labels(path, labels)

    monkeypatch.setattr(recon.labels.label_book, "write_labels", counted)
    monkeypatch.setattr(app.label, "SAVED_TOGETHER", 3)
    assert label_quietly(dataset) == 0
    assert written == [4, 7, 9]
    book = LabelBook(read_dataset(dataset.folder))
    found = replace(dataset.labels[0], file="more0.png")
    book.put_found([found])
    assert book.undo() is None and book.label("more0.png") == found


def test_what_was_found_before_a_damaged_frame_is_kept(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], in_this_process: None
) -> None:
    dataset = make_dataset(tmp_path / "set", presses=3)
    (dataset.folder / "labels.csv").unlink()
    (dataset.folder / dataset.labels[2].file).write_bytes(b"no picture")
    assert label_quietly(dataset) == 2
    assert dataset.labels[2].file in capsys.readouterr().err
    kept = [label.file for label in read_dataset(dataset.folder).labels]
    assert kept == [label.file for label in dataset.labels[:2]]


@pytest.mark.parametrize(
    "name",
    [
        "press 1.png",
        "prêß-漢.PNG",
        "a,b;c.png",
        "q\"uote'.png",
        "press #1.png",
        " a.png",
        "a\n.png",
        os.fsdecode(b"pr\xeass.png"),
    ],
)
def test_an_odd_name_is_kept_or_refused_by_a_sentence(
    name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str], in_this_process: None
) -> None:
    dataset = make_dataset(tmp_path / "set", presses=1)
    (dataset.folder / "labels.csv").unlink()
    (dataset.folder / dataset.labels[0].file).rename(dataset.folder / name)
    (dataset.folder / f"._{name}").write_bytes(b"a Mac's notes")
    if {"#", "\n", "\udcea"} & set(name) or name[0] == " ":
        assert label_quietly(dataset) == 2
        assert "rename the file" in capsys.readouterr().err
    else:
        assert label_quietly(dataset) == 0
        assert [label.file for label in read_dataset(dataset.folder).labels] == [name]


def test_a_frame_written_in_two_ways_has_one_label(tmp_path: Path, in_this_process: None) -> None:
    dataset = make_dataset(tmp_path / "set", presses=2, in_npz=True)
    first, second = dataset.labels
    written = [replace(first, file="./frames.npz#00"), replace(second, file="frames.npz#001")]
    write_labels(dataset.folder / "labels.csv", written)
    assert label_quietly(dataset) == 0
    found = read_dataset(dataset.folder)
    assert len(found.labels) == 2
    book = LabelBook(found)
    book.put(replace(found.labels[0], center_x_px=33.0))
    assert book.last_edited == book.undo() == pressed_frames(found.folder, found.card)[0]


def test_every_change_is_on_disk_at_once_and_can_be_undone(tmp_path: Path) -> None:
    dataset = make_dataset(tmp_path / "set", presses=3)
    book = LabelBook(dataset)
    before = (dataset.folder / "labels.csv").read_bytes()
    first, second = dataset.labels[:2]
    book.put(replace(first, center_x_px=first.center_x_px + 1, quality=CERTAIN))
    moved = read_dataset(dataset.folder).labels
    assert moved[0].center_x_px == first.center_x_px + 1
    assert moved[1:] == dataset.labels[1:]
    book.put(moved[0])  # as it is: nothing to undo
    for _ in range(2):
        book.remove(second.file)
    assert len(read_dataset(dataset.folder).labels) == 2
    assert [book.undo(), book.undo(), book.undo()] == [second.file, first.file, None]
    assert (dataset.folder / "labels.csv").read_bytes() == before


def test_what_others_changed_is_looked_at_before_it_is_changed(tmp_path: Path) -> None:
    dataset = make_dataset(tmp_path / "set", presses=3)
    mine, theirs = LabelBook(dataset), LabelBook(dataset)
    first, second, third = dataset.labels
    mine.put(replace(first, quality=0.8))
    with pytest.raises(WedgeError, match=f"{first.file} was changed in another tab or program"):
        theirs.remove(first.file)
    theirs.remove(first.file)
    theirs.put(seen := replace(third, quality=CERTAIN))
    mine.put_found([found := replace(second, quality=0.5), replace(third, quality=0.5)])
    mine.put_found([replace(third, quality=0.4)])  # theirs is no news by now
    with pytest.raises(WedgeError, match=f"{first.file} .* after your change"):
        mine.undo()
    assert mine.undo() is None
    assert read_dataset(dataset.folder).labels == mine.labels == (found, seen)
    assert LabelBook(read_dataset(dataset.folder)).has_no_ball(first.file)


def label_thirty(dataset: Dataset, name: str, begin: Barrier) -> None:
    book = LabelBook(dataset)
    begin.wait()
    for index in range(30):
        book.put(replace(dataset.labels[0], file=f"{name}{index}.png"))
        book.remove(f"{name}-none-{index}.png")


def test_two_programs_at_once_lose_nothing_of_each_other(tmp_path: Path) -> None:
    dataset, begin = make_dataset(tmp_path / "set", presses=1), FORKS.Barrier(2)
    programs = [FORKS.Process(target=label_thirty, args=(dataset, x, begin)) for x in "ab"]
    for program in programs:
        program.start()
    for program in programs:
        program.join()
    assert [program.exitcode for program in programs] == [0, 0]
    book = LabelBook(read_dataset(dataset.folder))
    assert len(book.labels) == 61
    assert all(book.has_no_ball(f"{name}-none-{i}.png") for name in "ab" for i in range(30))


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


def test_that_no_ball_touches_outlives_the_page(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], in_this_process: None
) -> None:
    dataset = make_dataset(tmp_path / "set", presses=3)
    folder = dataset.folder
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

    assert label_quietly(dataset) == 0
    assert "No ball was found" not in capsys.readouterr().out
    assert [label.file for label in read_dataset(folder).labels] == [second, third]
    assert LabelBook(read_dataset(folder)).has_no_ball(first)
    assert label_quietly(dataset, "--again") == 0
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

    monkeypatch.setattr("recon.labels.label_book.write_labels", refuse)
    with pytest.raises(WedgeError, match="full"):
        book.remove(second)
    assert {path.name: path.read_bytes() for path in dataset.folder.iterdir()} == before
    assert book.has_no_ball(first) and not book.has_no_ball(second)


def test_a_list_of_frames_without_a_ball_may_come_from_another_editor(tmp_path: Path) -> None:
    dataset = make_dataset(tmp_path / "set", presses=2)
    first, second = dataset.labels
    write_labels(dataset.folder / "labels.csv", [])
    text = f"\ufeff{first.file}\r\n {second.file} \r\n\r\n"
    (dataset.folder / "no_ball.txt").write_text(text, encoding="utf-8", newline="")
    book = LabelBook(read_dataset(dataset.folder))
    assert book.has_no_ball(first.file) and book.has_no_ball(second.file)


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
        expect(heading).to_contain_text("let go to save")
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


def test_a_set_whose_background_is_missing_gets_no_labels(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    dataset = make_dataset(tmp_path / "set", presses=1)
    (dataset.folder / "labels.csv").unlink()
    (dataset.folder / "background.png").unlink()
    assert label_quietly(dataset) == 2
    assert "background.png" in capsys.readouterr().err
    assert not (dataset.folder / "labels.csv").exists()
