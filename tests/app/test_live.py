# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""The live page in a real browser, and what its pictures say."""

import base64
import contextlib
import math
import os
import re
import threading
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest
from playwright.sync_api import Page, WebError

from app.pages import pictures
from app.pages.blank import BLANK_FRAMES
from app.pages.course import GAP_S, HISTORY_S, sparkline
from app.pages.following import APART
from app.pages.watching import Watcher
from recon.calibration import unit_of_set
from recon.images import read_image, write_image
from recon.stream import Counts, TimedFrame
from recon.stream.jpeg import decode_jpeg
from sensor.errors import WedgeError
from tests.app.commands import run
from tests.app.served import opened, served
from tests.browser import chromium, needs_chromium
from tests.recon.fast.units import blank_frame, make_unit, pressed
from tests.recon.stream.servers import free_port
from tests.synthetic import digitized, gradient_of, make_dataset, shaded

CLIP = Path("wedge-mit") / "2023-12-16" / "golf_ball_t0.avi"
CORNERS_PX = ((46.0, 87.0), (439.0, 121.0), (446.0, 368.0), (52.0, 425.0))
PATIENCE_MS = 120_000
FITTING = """width => document.documentElement.scrollWidth <= width
    && [...document.querySelectorAll("canvas")].every(
        canvas => canvas.clientWidth <= canvas.closest(".picture").clientWidth + 1)"""
NUMBER = "parseFloat(document.querySelector"


def data_folder() -> Path:
    beside = Path(__file__).resolve().parents[3] / "shared" / "data"
    return Path(os.environ.get("WEDGE_DATA", beside))


@contextlib.contextmanager
def live(*words: object) -> Iterator[tuple[Page, list[str]]]:
    """The page that the command serves, and a list that fills with the browser's complaints."""
    complaints: list[str] = []

    def note(told: WebError) -> None:
        complaints.append(str(told.error))

    with served("live", *words) as address, chromium() as window:
        window.on("weberror", note)
        with opened(address, 1400, 1000, part=".state") as page:
            page.set_default_timeout(PATIENCE_MS)
            yield page, complaints
        window.remove_listener("weberror", note)


@needs_chromium
def test_two_sensors_one_of_them_away(tmp_path: Path) -> None:
    unit, rng = unit_of_set(make_dataset(tmp_path / "set"), "table"), np.random.default_rng(0)
    unit.save(tmp_path / "unit")
    light = shaded(gradient_of((50.0, 45.0, 17.0)))
    for index in range(20):
        frame = digitized(light + rng.normal(0, 0.5 / 255, light.shape))
        write_image(tmp_path / "frames" / f"{index}.png", frame)
    away, folder = f"http://127.0.0.1:{free_port()}", tmp_path / "unit"
    words = [tmp_path / "frames", away, "--unit", folder, folder, "--captures", tmp_path / "kept"]
    with live(*words) as (page, complaints):
        first, second = page.locator("#sensor-0"), page.locator("#sensor-1")
        page.wait_for_function(
            "parseFloat(document.querySelector('#sensor-0 .deepest').innerText) > 0"
        )
        assert float(first.locator(".contact").inner_text()) > 0
        for name in ("raw", "difference", "depth"):
            shown = first.locator(f".{name} img").get_attribute("src")
            picture = decode_jpeg(base64.b64decode(shown.partition(",")[2]))
            assert picture.shape[1] == pictures.WIDTH_PX
            assert picture.std() > 1
        shown = first.locator(".posed img").get_attribute("src")
        assert decode_jpeg(base64.b64decode(shown.partition(",")[2])).std() > 1
        page.wait_for_function("document.querySelector('.pose').innerText.includes('turn')")
        assert first.locator(".pose-state").inner_text() in ("tracking", "weak", "lost", "frozen")
        assert first.locator(".markers").inner_text() == "none on this gel"
        for name, unit_name in (("deepest", "mm"), ("contact", "mm²")):
            most = first.locator(f".{name}-most").inner_text()
            number = re.fullmatch(rf"last 20 s, up to ([\d.]+) {unit_name}", most)
            assert number and float(number[1]) > 0, most
        assert "frames/s" in first.locator(".stream").inner_text()
        assert "nothing listens" in second.locator(".remark").inner_text()
        assert "0.0 frames/s\nlatency unknown" in second.locator(".stream").inner_text()
        assert second.locator(".stale .deepest").count() == 1
        assert first.locator(".stale").count() == 0
        assert first.locator(".flat").is_hidden()
        for width_px in (375, 700, 1280):
            page.set_viewport_size({"width": width_px, "height": 1000})
            page.wait_for_function(FITTING, arg=width_px)
        page.set_viewport_size({"width": 1400, "height": 1000})

        first.get_by_text("Take background").click()
        page.get_by_text("background-").wait_for()
        first.get_by_text("Save frame").click()
        page.get_by_text("press-").wait_for()
        kept = sorted(path.name for path in (tmp_path / "kept" / "wedge0").iterdir())
        assert [name.partition("-")[0] for name in kept] == ["background", "press"]
        assert read_image(tmp_path / "kept" / "wedge0" / kept[1]).shape == light.shape
        assert complaints == []


@needs_chromium
def test_a_real_clip_shows_its_touch(tmp_path: Path) -> None:
    clip = data_folder() / CLIP
    if not clip.is_file():
        pytest.skip(f"{CLIP} is not on this machine: name its folder by WEDGE_DATA")
    capture = cv2.VideoCapture(str(clip))
    background = cv2.cvtColor(capture.read()[1], cv2.COLOR_BGR2RGB)
    capture.release()
    # What colour means is learnt from an ideal sensor whose lights sit as the Wedge's do.
    ideal = unit_of_set(make_dataset(tmp_path / "set"), "table")
    card = replace(
        ideal.card,
        frame_size_px=(640, 480),
        size_px=(350, 255),
        mm_per_px=(0.1, 0.1),
        corners_px=CORNERS_PX,
        pad_size_mm=(35.0, 25.5),
    )
    replace(ideal, card=card, background=background).save(tmp_path / "unit")
    with live(clip, "--unit", tmp_path / "unit", "--captures", tmp_path / "kept") as (
        page,
        complaints,
    ):
        page.wait_for_selector("#sensor-0 canvas")
        page.wait_for_function(f"{NUMBER}('.contact').innerText) > 20")
        picture = tmp_path / "page.png"
        page.screenshot(path=str(picture))
        assert read_image(picture).std() > 10
        assert complaints == []


def test_frames_of_another_size_are_shown_raw_and_stop_that_sensor_alone(tmp_path: Path) -> None:
    frames = tmp_path / "frames"
    right, wrong = make_unit((160, 120)), make_unit((80, 60))
    for index in range(3):
        write_image(frames / f"{index}.png", pressed(right.background, (60, 60), index))
    watchers = [Watcher(str(frames), unit, tmp_path) for unit in (wrong, right)]
    pause = threading.Event()
    for watcher in watchers:
        watcher.watched_s = math.inf
        watcher.start()
    try:
        for _ in range(6000):
            if all(watcher.glimpse is not None for watcher in watchers):
                break
            pause.wait(0.01)
        assert watchers[0].misfit == (
            "frames: the frame is 160x120 pixels, not 80x60: use the right unit, or the camera "
            "mode of the calibration."
        )
        assert watchers[0].live and watchers[0].misfit in watchers[0].remark
        assert watchers[0].glimpse.raw and watchers[0].glimpse.depth is None
        with pytest.raises(WedgeError, match="no frames now that fit: no background"):
            watchers[0].take_background()
        assert watchers[1].glimpse is not None and watchers[1].glimpse.deepest_mm > 0
        assert watchers[1].remark == ""
    finally:
        for watcher in watchers:
            watcher.close()


class _OneByOne:
    """A source of these frames; each comes when the one before was looked at."""

    name, live, timed = "one by one", True, True

    def __init__(self, *frames: np.ndarray) -> None:
        self.counts, self.frames, self.next = Counts(), frames, threading.Semaphore(0)

    def __iter__(self) -> Iterator[TimedFrame]:
        for index, pixels in enumerate(self.frames):
            self.next.acquire()
            yield TimedFrame(index=index, time_ns=index, arrived_ns=index, pixels=pixels)
        self.next.acquire()

    def close(self) -> None:
        self.next.release(len(self.frames) + 1)

    def __enter__(self) -> "_OneByOne":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


@pytest.mark.parametrize("known", [True, False], ids=["with a unit", "without"])
def test_one_odd_frame_costs_itself_alone(
    known: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    unit = make_unit((160, 120))
    blank = unit.background
    noisy = [blank_frame((160, 120), seed) for seed in range(BLANK_FRAMES)]
    source = _OneByOne(blank, blank, blank[:60], blank, *noisy)
    opened = []
    monkeypatch.setattr("app.pages.watching.VIEW_S", 0)
    monkeypatch.setattr("app.pages.watching.open_live", lambda *_, **__: opened.append(1) or source)
    watcher = Watcher("one by one", unit if known else None, tmp_path)
    watcher.watched_s = math.inf
    watcher.start()
    pause = threading.Event()
    try:
        said = []
        for at, _frame in enumerate(source.frames):
            source.next.release()
            for _ in range(2000):
                if watcher.glimpse is not None and watcher.glimpse.number == at:
                    break
                pause.wait(0.005)
            else:
                raise AssertionError(f"frame {at} was not looked at")
            said.append(watcher.remark)
            if at in (0, 3):  # the odd frame costs the first
                watcher.take_background()
        assert (tmp_path / watcher.message[1].rpartition("/")[2]).is_file()
        assert watcher.error == "" and len(opened) == 1
        assert ("the frame is 160x60 pixels" in said[2]) is known
        assert "The background was not taken" in said[2]
    finally:
        watcher.close()


def test_depth_is_drawn_from_dark_to_light() -> None:
    ramp = np.linspace(0, 2, 256, dtype=np.float32)[None]
    colors = pictures.depth_colors(ramp, 1.0)[0].astype(float)
    light = colors @ (0.299, 0.587, 0.114)
    assert np.all(np.diff(light[:128]) >= -1)
    assert light[127] - light[0] > 150
    assert np.all(colors[128:] == colors[-1])  # beyond the scale


def test_the_surface_lies_as_the_gel_frame_says() -> None:
    depth = np.zeros((60, 80), np.float32)
    depth[5:15, 60:75] = 1.0  # upper right
    _, grid = pictures.surface(depth, 1.0, 1.0, (0.1, 0.1))
    points = np.array(grid)
    x, y, z = points[np.unravel_index(points[..., 2].argmin(), points.shape[:2])]
    assert x > 0 and y > 0 and z < 0
    unit = pictures.SURFACE_WIDTH / 8.0  # of the scene in a millimetre
    assert z == pytest.approx(-unit, rel=0.05)


def test_each_press_of_a_dataset_is_an_object_of_its_own(tmp_path: Path) -> None:
    dataset = make_dataset(tmp_path / "set", presses=6)
    watcher = Watcher(str(dataset.folder), unit_of_set(dataset, "table"), tmp_path)
    reconstruct = watcher._prepared()
    for label in dataset.labels:  # each elsewhere, with no lift between
        frame = read_image(dataset.folder / label.file)
        shown = watcher._look(reconstruct, frame, time.monotonic()).followed
        assert shown is not None and (shown.state, shown.pose) == ("–", APART)


def test_a_sparkline_spans_its_seconds() -> None:
    points = [(100 + t, float(t)) for t in range(int(HISTORY_S) + 1)]
    places = sparkline(points).partition('points="')[2].partition('"')[0].split()
    assert places[0].startswith("0.00,") and places[-1].startswith("100.00,")
    heights = [float(place.partition(",")[2]) for place in places]
    assert heights == sorted(heights, reverse=True)
    assert sparkline(points[:1]) == ""


def test_a_sparkline_draws_nothing_where_no_frame_came() -> None:
    step_s = 0.9 * GAP_S
    times_s = [100.0, 100 + step_s, 100 + 2 * step_s, 111.0, 114.0, 114 + step_s]
    shown = sparkline([(t, 1.0) for t in times_s])
    drawn = [places.split() for places in re.findall('points="([^"]*)"', shown)]
    assert [len(places) for places in drawn] == [3, 2, 2]
    assert drawn[1][0] == drawn[1][1]  # a dot
    before, after = (float(drawn[i][j].partition(",")[0]) for i, j in ((0, -1), (2, 0)))
    assert after - before == pytest.approx(100 * (14 - 2 * step_s) / HISTORY_S, abs=0.02)


def test_bad_input_is_a_sentence(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    import socket

    make_unit().save(tmp_path / "unit")
    file = tmp_path / "file"
    file.touch()
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        cases = {
            ("usb:0", "--port", str(port)): f"port {port} (Address already in use): another",
            ("usb:0", "usb:1", "--unit", str(tmp_path / "unit")): "name one for each",
            ("--unit", str(tmp_path / "unit")): "is given without a sensor",
            ("usb:0", "--unit", *2 * [str(tmp_path / "unit")]): "more units than sensors",
            ("usb:0", "--captures", str(file)): "file/background.png cannot be written",
            ("usb:0", "--address", "192.0.2.1"): "192.0.2.1 is not one of this computer's",
            ("usb:0", "--unit", str(tmp_path)): "not a unit folder",
            ("usb:0", "--port", "99999"): "must lie between",
            ("usb:0", "--address", "0.0.0.0.0"): "0.0.0.0.0 is not an address: name one of",
            (str(tmp_path / "nothing"),): "nothing does not exist: name an address",
        }
        for words, sentence in cases.items():
            assert run("live", *words) == 2
            assert sentence in capsys.readouterr().err


def test_a_clip_that_was_cut_to_even_sizes_is_not_told_to_be_another_unit_s(tmp_path: Path) -> None:
    unit = make_unit((80, 61))
    watcher = Watcher("clip.avi", unit, tmp_path)
    assert watcher._misfit_of(unit.background[:60]) == (
        "clip.avi: the frame is 80x60 pixels, not 80x61: video files hold even sizes, so name a "
        "folder of the frames."
    )


def test_a_grey_camera_is_not_told_to_be_another_unit_s(tmp_path: Path) -> None:
    unit = make_unit((80, 60))
    watcher = Watcher(str(tmp_path), unit, tmp_path)
    gray = np.repeat(unit.background[..., :1], 3, axis=2)
    wanted = "the frame is grey, not in colour: set the camera to colour."
    assert watcher._misfit_of(gray) == f"{watcher.name}: {wanted}"
    assert watcher._misfit_of(unit.background) == ""
