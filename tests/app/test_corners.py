# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""`wedge label --corners`: the book of corners, and the page in a real browser, killed midway."""

import os
import shutil
import socket
import subprocess
import sys
import urllib.request
from contextlib import closing
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from recon.corner_book import CornerBook
from recon.labelling import LabelBook
from recon.presses import read_background
from sensor.dataset import BallLabel, Dataset, read_dataset, write_labels
from sensor.errors import WedgeError
from tests.synthetic import KEYSTONE_PX, make_dataset

CHROMIUM = shutil.which("chromium") or shutil.which("google-chrome")
ROOT = Path(__file__).resolve().parents[2]


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


def test_turning_four_times_and_mirroring_twice_change_nothing(tmp_path: Path) -> None:
    dataset = raw_set(tmp_path / "set", quality=0.9)
    book = CornerBook(dataset, read_background(dataset))
    upright = book.unwarp(book.blank)
    book.mirror()
    np.testing.assert_allclose(book.unwarp(book.blank), upright[::-1], atol=2e-3)
    book.mirror()
    for _ in range(4):
        book.turn()
    assert book.corners_px == KEYSTONE_PX


@pytest.mark.parametrize("quality", [None, 1.0])
def test_circles_that_somebody_drew_keep_the_corners(tmp_path: Path, quality: float | None) -> None:
    dataset = raw_set(tmp_path / "set", quality=quality)
    before = [path.read_bytes() for path in sorted(dataset.folder.iterdir())]
    book = CornerBook(dataset, read_background(dataset))
    with pytest.raises(WedgeError, match="drew or looked at"):
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


def test_a_folded_pad_and_a_card_changed_meanwhile_are_refused(tmp_path: Path) -> None:
    dataset = raw_set(tmp_path / "set", quality=0.9)
    book = CornerBook(dataset, read_background(dataset))
    with pytest.raises(WedgeError, match="convex"):
        book.put(book.moved(0, (150.0, 100.0)))
    path = dataset.folder / "dataset.toml"
    path.write_text(path.read_text().replace("synthetic", "other"))
    edited = path.read_bytes()
    with pytest.raises(WedgeError, match="another program"):
        book.turn()
    assert path.read_bytes() == edited
    assert len(read_dataset(dataset.folder).labels) == 3


@pytest.mark.skipif(CHROMIUM is None, reason="no Chromium on this machine: apt install chromium")
def test_a_corner_is_dragged_in_a_browser_and_survives_a_kill(tmp_path: Path) -> None:
    from playwright.sync_api import expect, sync_playwright

    expect.set_options(timeout=30_000)

    folder = raw_set(tmp_path / "set", quality=0.9).folder
    with closing(socket.socket()) as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    words = [sys.executable, "-P", "-m", "app", "label", str(folder), "--corners"]
    # NiceGUI serves otherwise where it sees pytest.
    environment = {key: value for key, value in os.environ.items() if "PYTEST" not in key}
    server = subprocess.Popen(
        [*words, "--port", str(port)], cwd=ROOT, stdout=subprocess.PIPE, text=True, env=environment
    )
    try:
        assert server.stdout is not None
        next(line for line in server.stdout if line.startswith("Open "))
        with sync_playwright() as playwright:
            browser = playwright.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox"])
            page = browser.new_page(viewport={"width": 1300, "height": 900})
            for _ in range(100):  # the server says where it will be just before it listens
                try:
                    urllib.request.urlopen(f"http://127.0.0.1:{port}", timeout=5).close()
                    break
                except OSError:
                    page.wait_for_timeout(100)
            page.goto(f"http://127.0.0.1:{port}")
            heading = page.locator("#heading")
            expect(heading).to_contain_text("corner 1")
            page.locator("#preview img").first.wait_for()
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
            expect(heading).to_contain_text("corner 3")
            page.keyboard.press("ArrowRight")
            expect(heading).to_contain_text(f"({wanted[0] + 1:.0f}.")
            page.mouse.move(x, y)
            page.mouse.down()
            page.mouse.move(x - 40 * scale, y, steps=3)  # held, never let go
            server.kill()
            browser.close()
    finally:
        server.kill()
        server.communicate(timeout=30)
    moved = read_dataset(folder).card.corners_px
    assert moved is not None
    assert moved[2] == pytest.approx((wanted[0] + 1, wanted[1]), abs=0.4)
    assert moved[:2] == KEYSTONE_PX[:2]
