# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""A dataset folder that others mend while `wedge capture` fills it."""

import fcntl
import os
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from recon.labels import find_circles
from recon.labels.capture import PressWatcher
from recon.labels.corner_book import CornerBook
from recon.labels.find_circles import agreed, found_circle, labels_of
from recon.labels.label_book import CERTAIN, LabelBook
from recon.presses import press_reader
from sensor.dataset import BallLabel, Dataset, read_dataset, write_card
from tests.app.commands import run
from tests.app.test_capture import new_sensor
from validation.importers import folder as importers_folder
from validation.importers.lights import measure_lights_deg

PRESSES = ["press-001.png", "press-002.png", "press-003.png"]

pytestmark = pytest.mark.usefixtures("in_this_process")


def without_caliper(tmp_path: Path) -> list[str]:
    """The words to capture three presses of a new sensor."""
    words = list(new_sensor(tmp_path))
    for picture in ("01.png", "02.png"):
        (tmp_path / "frames" / picture).unlink()
    return words[: words.index("--caliper-mm")]


def between_presses(monkeypatch: pytest.MonkeyPatch, *changes: Callable[[], object]) -> None:
    """Make a change after each press, as long as there are some."""
    usual, left = PressWatcher.judge_alone, list(changes)

    def meanwhile(watcher: PressWatcher, frame: Any) -> Any:
        if watcher.coverage.centers_px and left:
            left.pop(0)()
        return usual(watcher, frame)

    monkeypatch.setattr(PressWatcher, "judge_alone", meanwhile)


def move_corner(out: Path, by_px: float = 4.0) -> None:
    """On the page of the corners."""
    reader = press_reader(read_dataset(out))
    book = CornerBook(reader.dataset, reader.background)
    x, y = book.corners_px[1]
    book.put(book.moved(1, (x - by_px, y + by_px)))


def edit_corner(out: Path) -> None:
    """In an editor, which leaves the circles as they are."""
    card = read_dataset(out).card
    assert card.corners_px is not None
    (x, y), b, c, d = card.corners_px
    write_card(out / "dataset.toml", replace(card, corners_px=((x + 4.0, y + 4.0), b, c, d)))


def as_found(dataset: Dataset, count: int = len(PRESSES)) -> list[BallLabel]:
    """What a search by the dataset's own card finds in the first presses."""
    reader = press_reader(dataset)
    circles = {file: found_circle(reader, file) for file in PRESSES[:count]}
    return labels_of(reader, agreed({f: one for f, one in circles.items() if one is not None}))


@pytest.mark.parametrize("how", [move_corner, edit_corner])
@pytest.mark.parametrize("is_known", [False, True])
def test_presses_go_on_by_corners_moved_meanwhile(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, how: Callable[[Path], None], is_known: bool
) -> None:
    words, out = without_caliper(tmp_path), tmp_path / "out"
    if is_known:
        words += ["--like", str(tmp_path / "truth")]
    moved: list[object] = []

    def change() -> None:
        how(out)
        moved.append(read_dataset(out).card.corners_px)

    between_presses(monkeypatch, change)
    assert run(*words) == 0
    captured = read_dataset(out)
    assert [captured.card.corners_px] == moved
    assert list(captured.labels) == as_found(captured)
    assert captured.card.lights_deg is not None


def test_ctrl_c_while_moved_corners_are_followed_ends_the_capture_with_all_circles(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    words, out, usual = without_caliper(tmp_path), tmp_path / "out", PressWatcher.look_through
    between_presses(monkeypatch, lambda: edit_corner(out))

    def interrupted(watcher: PressWatcher, *how: Any) -> None:
        monkeypatch.setattr(PressWatcher, "look_through", usual)
        usual(watcher, *how)
        raise KeyboardInterrupt

    monkeypatch.setattr(PressWatcher, "look_through", interrupted)
    run(*words)
    captured = read_dataset(out)
    assert len(captured.labels) == 2  # the press after the move was taken before
    assert list(captured.labels) == as_found(captured, 2)


def test_corners_moved_while_circles_are_found_at_the_caliper_s_scale(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    words, out, usual = list(new_sensor(tmp_path)), tmp_path / "out", importers_folder.lit
    moved: list[object] = []

    def meanwhile(dataset: Dataset) -> Any:
        if not moved:
            move_corner(out)
            moved.append(read_dataset(out).card.corners_px)
        return usual(dataset)

    monkeypatch.setattr(importers_folder, "lit", meanwhile)
    assert run(*words) == 0
    captured = read_dataset(out)
    assert [captured.card.corners_px] == moved
    assert list(captured.labels) == as_found(captured)


def test_a_press_without_a_ball_by_corners_moved_at_the_end_is_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    words, out, usual = without_caliper(tmp_path), tmp_path / "out", importers_folder.lit
    moves = [lambda: move_corner(out)]

    def meanwhile(dataset: Dataset) -> Any:
        if moves:
            moves.pop()()
            (out / PRESSES[2]).write_bytes((out / "background.png").read_bytes())
        return usual(dataset)

    monkeypatch.setattr(importers_folder, "lit", meanwhile)
    assert run(*words) == 0
    assert f"no ball was found in {PRESSES[2]}." in capsys.readouterr().out
    captured = read_dataset(out)
    assert list(captured.labels) == as_found(captured, 2)


def test_circles_drawn_in_pixels_of_other_corners_end_it_and_all_is_kept(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    words, out = without_caliper(tmp_path), tmp_path / "out"
    drawn: list[BallLabel] = []

    def draw() -> None:
        book = LabelBook(read_dataset(out))
        drawn.append(replace(book.labels[0], center_x_px=33.0, quality=CERTAIN))
        book.put(drawn[0])

    between_presses(monkeypatch, draw, lambda: edit_corner(out))
    assert run(*words) == 2
    said = capsys.readouterr().err.splitlines()[-1]
    assert "check whether they still fit. The presses are kept in" in said
    assert list(read_dataset(out).labels) == drawn
    assert all((out / file).is_file() for file in PRESSES)


@pytest.mark.parametrize("is_mended", [True, False])
def test_a_card_that_cannot_be_read_meanwhile_costs_no_press(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    is_mended: bool,
) -> None:
    words, out = without_caliper(tmp_path), tmp_path / "out"
    path, whole = out / "dataset.toml", b""

    def spoil() -> None:
        nonlocal whole
        whole = path.read_bytes()
        path.write_bytes(b"mm_per_px = [\n")

    between_presses(monkeypatch, spoil, *([lambda: path.write_bytes(whole)] * is_mended))
    assert run(*words) == (0 if is_mended else 2)
    assert all((out / file).is_file() for file in PRESSES)
    if not is_mended:
        said = capsys.readouterr().err.splitlines()[-1]
        assert "dataset.toml is not valid TOML" in said and "The presses are kept in" in said
        path.write_bytes(whole)
    captured = read_dataset(out)
    found = as_found(captured)
    assert list(captured.labels) == (found if is_mended else found[:1])


def test_a_circle_that_waited_is_centred_like_the_others(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    words, path, whole = without_caliper(tmp_path), tmp_path / "out" / "dataset.toml", b""
    monkeypatch.setattr(find_circles, "FEWEST", len(PRESSES))
    monkeypatch.setattr(find_circles, "WIDEST_SPREAD", -1.0)

    def spoil() -> None:
        nonlocal whole
        whole = path.read_bytes()
        path.write_bytes(b"mm_per_px = [\n")

    between_presses(monkeypatch, spoil, lambda: path.write_bytes(whole))
    assert run(*words) == 0
    captured = read_dataset(path.parent)
    assert list(captured.labels) == as_found(captured)


def test_corners_that_another_file_kept_from_being_read_are_followed_once_it_is_mended(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    words, out = without_caliper(tmp_path), tmp_path / "out"
    frames = tmp_path / "frames"
    for blank in ("04b.png", "04c.png", "04d.png"):  # before the last press
        (frames / blank).write_bytes((frames / "00.png").read_bytes())
    path, whole = out / "labels.csv", b""

    def move_and_spoil() -> None:
        nonlocal whole
        edit_corner(out)
        whole = path.read_bytes()
        path.write_bytes(b"no table\n")

    def mend() -> None:
        path.write_bytes(whole)

    between_presses(monkeypatch, move_and_spoil, lambda: None, lambda: None, mend)
    assert run(*words) == 0
    lines = capsys.readouterr().err.splitlines()
    (unread,) = [i for i, line in enumerate(lines) if "judged as before until this" in line]
    (followed,) = [i for i, line in enumerate(lines) if "judged by it from now on" in line]
    (last,) = [i for i, line in enumerate(lines) if line.startswith("  3/3")]
    assert unread < followed < last
    captured = read_dataset(out)
    assert list(captured.labels) == as_found(captured)


@pytest.mark.parametrize("sensor", ["new", "measured by a caliper"])
def test_others_need_not_wait_while_circles_are_found_and_lights_measured(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, sensor: str
) -> None:
    out = tmp_path / "out"
    words = without_caliper(tmp_path) if sensor == "new" else list(new_sensor(tmp_path))
    drawn: list[np.ndarray] = []

    def share_of_pad() -> np.ndarray:
        """Where the second press's circle lies, from 0 to 1 along both sides of the pad."""
        dataset = read_dataset(out)
        label, size_px = dataset.label(PRESSES[1]), dataset.card.unwarped_size_px
        assert label is not None and size_px is not None
        return (np.array(label.center_px) + 0.5) / size_px

    def meanwhile() -> None:
        handle = os.open(out, os.O_RDONLY)
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)  # or a page would wait
        os.close(handle)
        if not drawn:
            book = LabelBook(dataset := read_dataset(out))
            book.put(replace(book.labels[1], center_x_px=60.0, quality=CERTAIN))
            book.remove(PRESSES[2])
            write_card(out / "dataset.toml", replace(dataset.card, licence="CC0-1.0"))
            drawn.append(share_of_pad())

    class Busy(ThreadPoolExecutor):
        def map(self, *given: Any, **options: Any) -> Iterator[Any]:
            meanwhile()
            return super().map(*given, **options)

    def lights(*given: Any) -> Any:
        meanwhile()
        return measure_lights_deg(*given)

    monkeypatch.setattr("app._captured.process_pool", Busy)
    monkeypatch.setattr("validation.importers.folder.measure_lights_deg", lights)
    assert run(*words) == 0
    captured = read_dataset(out)
    assert [label.file for label in captured.labels] == PRESSES[:2]
    assert [label.quality == CERTAIN for label in captured.labels] == [False, True]
    np.testing.assert_allclose(share_of_pad(), drawn[0], atol=1e-4)
    assert LabelBook(captured).has_no_ball(PRESSES[2])
    assert captured.card.licence == "CC0-1.0" and captured.card.lights_deg is not None
