# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""`wedge tune` from a folder and from a stream, to the Pi's settings file."""

import io
import json
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import asdict, replace
from pathlib import Path

import cv2
import numpy as np
import pytest
from PIL import Image

from firmware_pi.newest import Newest
from firmware_pi.server import StreamServer
from firmware_pi.settings import Settings, read_settings, write_settings
from sensor.unit import UnitCard, write_unit_card
from tests.app.commands import run
from tests.synthetic import make_dataset

RGB = (90, 120, 100)


def frames(folder: Path, *levels: int, size_px: tuple[int, int] = (64, 48)) -> Path:
    folder.mkdir()
    for number, level in enumerate(levels):
        rgb = tuple(channel + level for channel in RGB)
        Image.new("RGB", size_px, rgb).save(folder / f"{number:03}.png")
    return folder


@contextmanager
def stream(settings: Settings, credentials: str | None = None, **more: object) -> Iterator[str]:
    file = io.BytesIO()
    Image.new("RGB", (64, 48), RGB).save(file, "JPEG", quality=95)
    newest, done = Newest(), threading.Event()
    refused, silent = more.pop("refused", None), more.pop("silent", False)
    asked = asdict(settings) | more

    def describe() -> dict[str, object]:
        if silent:
            done.wait()
        return {"asked": asked, "refused": refused}

    server = StreamServer("127.0.0.1", 0, newest, describe, credentials=credentials)

    def run() -> None:
        while not done.wait(0.002):
            newest.put(file.getvalue(), time.clock_gettime_ns(time.CLOCK_BOOTTIME))

    threads = [
        threading.Thread(target=server.serve_forever, args=(0.01,)),
        threading.Thread(target=run),
    ]
    for thread in threads:
        thread.start()
    try:
        login = f"{credentials}@" if credentials else ""
        yield f"http://{login}127.0.0.1:{server.server_address[1]}/stream.mjpg"
    finally:
        done.set()
        server.stop()
        for thread in threads:
            thread.join()


def test_a_folder_of_frames_becomes_settings(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder, file = frames(tmp_path / "blank", 0, 0, 0, 0), tmp_path / "wedge.toml"
    before = Settings(red_gain=1.3, blue_gain=2.0, address="10.55.0.1")
    write_settings(file, before)
    assert run("tune", folder, "--settings", file, "--json", tmp_path / "tune.json") == 0
    after = read_settings(file)
    assert after.red_gain > before.red_gain
    assert after.blue_gain > before.blue_gain
    assert after.address == "10.55.0.1"
    document = json.loads((tmp_path / "tune.json").read_text())
    assert document["before"] == asdict(before)
    assert document["settings"] == asdict(after)
    assert document["blank"]["frames"] == 4
    assert document["settled"] is False
    said = capsys.readouterr().out
    assert "run again" in said
    assert "red_gain" in said


def test_flicker_is_said(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run("tune", frames(tmp_path / "blank", 0, 9, 9, 0)) == 0
    assert "the light flickers" in capsys.readouterr().out
    assert [path.name for path in tmp_path.iterdir()] == ["blank"]  # nothing was written


@pytest.mark.parametrize(("levels", "counted"), [([0], "1 frame"), ([0, 0], "2 frames")])
def test_too_few_frames_for_flicker_are_counted(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], levels: list[int], counted: str
) -> None:
    assert run("tune", frames(tmp_path / "blank", *levels)) == 0
    assert f"at least 3 frames; {counted} came." in capsys.readouterr().out


@pytest.mark.parametrize("broken", [0, 2])
def test_a_damaged_frame_is_left_out_and_said(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], broken: int
) -> None:
    folder, report = frames(tmp_path / "blank", 0, 0, 0), tmp_path / "tune.json"
    for number, said in ((broken, "1 damaged frame."), (1, "2 damaged frames.")):
        path = folder / f"{number:03}.png"
        path.write_bytes(path.read_bytes()[:60])
        assert run("tune", folder, "--json", report) == 0
        assert f"{folder}: {said}" in capsys.readouterr().out
    assert json.loads(report.read_text())["blank"]["frames"] == 1
    for path in folder.iterdir():
        path.write_bytes(path.read_bytes()[:60])
    assert run("tune", folder) == 2
    assert f"{folder}, frame 0: " in capsys.readouterr().err


def test_of_a_dataset_the_blank_frames_alone_are_read(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    made = make_dataset(tmp_path / "set", presses=2)
    assert run("tune", made.folder, "--json", tmp_path / "tune.json") == 0
    document = json.loads((tmp_path / "tune.json").read_text())
    assert document["blank"]["frames"] == len(made.card.background)


@pytest.mark.parametrize("touched", [0, 2])
@pytest.mark.parametrize("times", [1, 10])
def test_a_touched_gel_is_refused_but_not_bands(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], touched: int, times: int
) -> None:
    size_px, period = (64 * times, 48 * times), 24 * times
    folder = frames(tmp_path / "blank", 0, 0, 0, 0, size_px=size_px)
    file = tmp_path / "wedge.toml"
    for number, path in enumerate(sorted(folder.iterdir())):
        image = np.array(Image.open(path))
        turn = np.arange(size_px[1]) / period + number / 4
        bands = np.rint(20 * np.sin(2 * np.pi * turn))  # a dimmed lamp's
        Image.fromarray((image + bands[:, None, None]).astype(np.uint8)).save(path)
    assert run("tune", folder) == 0 and "moving bands" in capsys.readouterr().out
    pressed = folder / f"{touched:03}.png"
    image = np.array(Image.open(pressed))
    image[15 * times : 30 * times, 20 * times : 40 * times] += np.uint8([40, 0, 0])
    Image.fromarray(image).save(pressed)
    assert run("tune", folder, "--settings", file) == 2
    assert "something touches the gel" in capsys.readouterr().err
    assert not file.exists()


@pytest.mark.parametrize("credentials", [None, "wedge:secret"])
def test_a_stream_says_itself_what_it_was_made_with(
    tmp_path: Path, credentials: str | None
) -> None:
    file = tmp_path / "wedge.toml"
    write_settings(file, Settings(red_gain=7.0))
    made_with = Settings(red_gain=1.1, blue_gain=1.2, exposure_us=5000)
    with stream(made_with, credentials) as url:
        words = (url, "--settings", file, "--frames", "5", "--json", tmp_path / "t.json")
        assert run("tune", *words) == 0
    document = json.loads((tmp_path / "t.json").read_text())
    assert document["before"] == asdict(made_with)
    tuned = read_settings(file)
    unchanged = ("red_gain", "blue_gain", "exposure_us", "analogue_gain")
    assert replace(tuned, **{key: getattr(made_with, key) for key in unchanged}) == made_with


def test_a_pi_that_refused_settings_is_said_to(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    said = "The Pi refused newer settings and keeps the old ones: camera 0 gives no frame."
    for refused in (None, "camera 0 gives no frame."):
        with stream(Settings(), refused=refused) as url:
            assert run("tune", url, "--frames", "5", "--json", tmp_path / "tune.json") == 0
        remarks = json.loads((tmp_path / "tune.json").read_text())["remarks"]
        assert (said in remarks) == (said in capsys.readouterr().out) == bool(refused)


def test_where_the_stream_does_not_say_its_settings_those_assumed_are_named(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("app.tune._ANSWER_WITHIN_S", 0.05)
    file, report = tmp_path / "wedge.toml", tmp_path / "tune.json"
    write_settings(file, Settings(red_gain=7.0))
    with stream(Settings(red_gain=1.1), "wedge:secret", silent=True) as url:
        assert run("tune", url, "--settings", file, "--frames", "5", "--json", report) == 0
        said = capsys.readouterr().out
    assert json.loads(report.read_text())["before"]["red_gain"] == 7.0
    assert "/settings gives no answer" in said and "secret" not in said
    assert f"Assumed: the frames were taken with the settings in {file}." in said
    assert run("tune", frames(tmp_path / "blank", 0), "--settings", file) == 0
    assert f"the settings in {file}" in capsys.readouterr().out
    assert run("tune", tmp_path / "blank", "--settings", tmp_path / "new.toml") == 0
    assert "Assumed" not in capsys.readouterr().out


def test_a_stream_with_settings_of_another_version_is_said_and_the_file_used(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file, report = tmp_path / "wedge.toml", tmp_path / "tune.json"
    write_settings(file, Settings(red_gain=7.0))
    with stream(Settings(red_gain=1.1), hdr=True) as url:
        assert run("tune", url, "--settings", file, "--frames", "5", "--json", report) == 0
        said = capsys.readouterr().out
        assert "of another version" in said and "unknown key hdr" in said
        assert json.loads(report.read_text())["before"]["red_gain"] == 7.0
        assert run("tune", url, "--frames", "5") == 0
        assert "give the Pi's file with --settings" in capsys.readouterr().out


def test_a_misspelt_settings_file_is_refused_by_name_and_stays(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder, file = frames(tmp_path / "blank", 0), tmp_path / "wedge.toml"
    file.write_text("red_gian = 1.0\n")
    assert run("tune", folder, "--settings", file) == 2
    assert "did you mean red_gain" in capsys.readouterr().err
    assert file.read_text() == "red_gian = 1.0\n"


def test_a_frame_of_the_folder_is_not_written_over_but_an_earlier_report_may_be(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = frames(tmp_path / "blank", 0, 0, 0)
    before = (folder / "000.png").read_bytes()
    assert run("tune", folder, "--json", folder / "000.png") == 2
    assert capsys.readouterr().err.count("is an input and would be overwritten") == 1
    assert (folder / "000.png").read_bytes() == before
    for _ in range(2):
        assert run("tune", folder, "--json", folder / "tune.json") == 0


@pytest.mark.parametrize("report", ["wedge.toml", "sub/../wedge.toml", "clip.mp4"])
def test_what_is_read_is_not_written_over_by_json(
    tmp_path: Path,
    report: str,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "sub").mkdir()
    clip = cv2.VideoWriter("clip.mp4", cv2.VideoWriter.fourcc(*"mp4v"), 30, (64, 48))
    clip.write(np.full((48, 64, 3), 100, np.uint8))
    clip.release()
    write_settings(Path("wedge.toml"), Settings())
    before = {path.name: path.read_bytes() for path in tmp_path.glob("*.*")}
    assert run("tune", "clip.mp4", "--settings", "wedge.toml", "--json", report) == 2
    assert "is an input and would be overwritten" in capsys.readouterr().err
    assert {path.name: path.read_bytes() for path in tmp_path.glob("*.*")} == before


def test_a_gel_too_bright_for_any_setting_is_not_settled(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "blank").mkdir()
    Image.new("RGB", (64, 48), (240, 240, 240)).save(tmp_path / "blank" / "0.png")
    file = tmp_path / "wedge.toml"
    write_settings(file, Settings(exposure_us=30))
    assert run("tune", tmp_path / "blank", "--settings", file) == 0
    said = capsys.readouterr().out
    assert "lower the current of the LEDs" in said
    assert "Not settled: correct what is reported above and run again." in said


def test_a_unit_says_where_the_pad_is(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    unit = UnitCard(
        serial="wedge-001",
        created="2026-01-01",
        design_sha256="0",
        dataset="balls",
        dataset_sha256="0",
        estimator="table",
        channels="RGB",
        missing_axis="none",
        mm_per_px=(0.1, 0.1),
        frame_size_px=(64, 48),
        size_px=(300, 200),
        metrics={},
        corners_px=((8, 8), (55, 8), (55, 39), (8, 39)),
        pad_size_mm=(30, 20),
    )
    write_unit_card(tmp_path / "unit", unit)
    image = np.full((48, 64, 3), 255, np.uint8)
    image[8:40, 8:56] = RGB
    (tmp_path / "blank").mkdir()
    Image.fromarray(image).save(tmp_path / "blank" / "0.png")
    report = tmp_path / "tune.json"
    assert run("tune", tmp_path / "blank", "--json", report) == 0
    assert min(json.loads(report.read_text())["blank"]["saturated"]) > 0.4
    assert run("tune", tmp_path / "blank", "--unit", tmp_path / "unit", "--json", report) == 0
    assert json.loads(report.read_text())["blank"]["saturated"] == [0, 0, 0]
    assert run("tune", tmp_path / "blank", "--unit", tmp_path / "none") == 2
    assert "does not exist: name a unit folder" in capsys.readouterr().err


@pytest.mark.parametrize("words", [["nowhere"], ["blank", "--frames", "0"], ["empty"]])
def test_bad_input_is_one_sentence(
    tmp_path: Path,
    words: list[str],
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.chdir(tmp_path)
    frames(tmp_path / "blank", 0)
    (tmp_path / "empty").mkdir()
    assert run("tune", *words) == 2
    assert capsys.readouterr().err.count("\n") == 1


def test_the_mean_is_grey_in_the_end(tmp_path: Path) -> None:
    file = tmp_path / "wedge.toml"
    assert run("tune", frames(tmp_path / "blank", 0, 0, 0), "--settings", file) == 0
    linear = ((np.array(RGB) / 255 + 0.055) / 1.055) ** 2.4
    after = read_settings(file)
    gains = np.array([after.red_gain / 1.5, 1, after.blue_gain / 1.5])
    assert linear * gains == pytest.approx(np.full(3, linear[1]), rel=1e-3)
