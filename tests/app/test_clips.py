# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Clips that are damaged, cut or frozen, and runs that are ended: what can be made of them is."""

import csv
import json
import signal
from collections.abc import Iterator
from itertools import islice
from pathlib import Path

import numpy as np
import pytest

from app._frames import is_image
from recon.images import read_image, write_image
from recon.markers.tracking import MarkerTracker
from recon.pipeline import Reconstructor
from recon.stream import FolderSource, McapSource, Recorder, TimedFrame
from recon.stream.jpeg import encode_jpeg
from sensor.errors import WedgeError
from sensor.wire import Stamp
from tests.app.commands import refused, run
from tests.app.test_touch_commands import PLACES, make_unit, with_dots
from tests.recon.stream.servers import ScriptedServer, stream, write_clip

FRAMES = 6
COMMANDS = ("markers", "cloud", "track")


@pytest.fixture(scope="module")
def unit(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Of a marker gel, by the estimator that needs no training."""
    folder = tmp_path_factory.mktemp("unit")
    make_unit(folder, dots=True, estimator="table")
    return folder / "unit"


def pictures(unit: Path, count: int = FRAMES) -> list[np.ndarray]:
    """A blank gel whose dots wander, in the camera's noise."""
    blank = read_image(unit.parent / "set" / "background.png")
    rng = np.random.default_rng(0)
    moved = [with_dots(blank, PLACES + np.array([0.4 * i, 0.0])) for i in range(count)]
    noise = [rng.integers(-1, 2, image.shape) for image in moved]
    return [np.clip(m + n, 0, 255).astype(np.uint8) for m, n in zip(moved, noise, strict=True)]


def recorded(path: Path, jpegs: list[bytes]) -> Path:
    with Recorder(path, {"wedge": None}) as recorder:
        for i, jpeg in enumerate(jpegs):
            times = {"time_ns": i * 10**8, "arrived_ns": i * 10**8}
            recorder.add("wedge", TimedFrame(index=i, jpeg=jpeg, **times))
    return path


def rows(out: Path, document: dict, command: str) -> list[int]:
    """The numbers of the frames that a command wrote something of."""
    if command == "track":
        with (out / "poses.csv").open() as stream:
            return [int(row["frame"]) for row in csv.DictReader(stream)]
    key = "frames" if command == "markers" else "clouds"
    return [int(row["frame"]) for row in document[key]]


def ran(command: str, unit: Path, clip: Path, tmp_path: Path) -> tuple[dict, list[int]]:
    """A command's JSON and the frames it wrote something of."""
    out, told = tmp_path / "out", tmp_path / "told.json"
    assert run(command, unit, clip, "--out", out, "--json", told) == 0
    document = json.loads(told.read_text())
    return document, rows(out, document, command)


@pytest.mark.parametrize("command", COMMANDS)
def test_damaged_frames_and_such_of_another_size_cost_themselves_alone(
    command: str, unit: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    jpegs = [encode_jpeg(image, 95) for image in pictures(unit)]
    jpegs[0] = jpegs[0][: len(jpegs[0]) // 2]
    jpegs[3] = encode_jpeg(np.zeros((8, 8, 3), np.uint8))
    clip = recorded(tmp_path / "clip.mcap", jpegs)
    document, written = ran(command, unit, clip, tmp_path)
    (remark,) = document["remarks"]
    assert remark.startswith("Left out 2 of 6 frames: 00000: ")
    assert remark in capsys.readouterr().err
    if command == "track":
        damaged, small = (document["poses"][index] for index in (0, 3))
        assert damaged["state"] == small["state"] == "lost"
        assert damaged["reason"] == "the frame is damaged"
        assert small["reason"] == "the frame is of another size than the unit's"
        assert written == [0, 1, 2, 3, 4, 5]
    else:
        assert written == [1, 2, 4, 5]


@pytest.mark.parametrize("command", COMMANDS)
def test_a_damaged_image_of_a_folder_is_left_out_and_named(
    command: str, unit: Path, tmp_path: Path
) -> None:
    for i, image in enumerate(pictures(unit)):
        write_image(tmp_path / "clip" / f"{i}.png", image)
    damaged = tmp_path / "clip" / "2.png"
    damaged.write_bytes(damaged.read_bytes()[:2000])
    document, written = ran(command, unit, tmp_path / "clip", tmp_path)
    (remark,) = document["remarks"]
    assert "Left out 1 of 6 frames" in remark and str(damaged) in remark
    assert len(written) == (6 if command == "track" else 5)


@pytest.mark.parametrize(
    ("command", "key"), [("markers", "frames"), ("cloud", "clouds"), ("track", "poses")]
)
def test_a_frame_has_its_number_in_a_stream_that_lost_one_before_it(
    command: str, key: str, unit: Path, tmp_path: Path
) -> None:
    numbers, out, told = [0, 1, 3, 4], tmp_path / "out", tmp_path / "told.json"
    jpegs = [encode_jpeg(image, 95) for image in pictures(unit, 4)]
    sent = stream(*jpegs, stamps=[Stamp(index=number) for number in numbers])
    with ScriptedServer(sent, b"") as server:
        words = (command, unit, server.url, "--frames", 4, "--out", out, "--json", told)
        assert run(*words) == 0
    document = json.loads(told.read_text())
    assert [row["frame"] for row in document[key]] == numbers
    assert {row["image"] for row in document[key]} == {None}
    assert "Lost in transmission: 1 frames." in document["remarks"]
    for table in out.glob("*.csv"):
        with table.open(newline="") as lines:
            of_lines = [int(row["frame"]) for row in csv.DictReader(lines)]
        assert list(dict.fromkeys(of_lines)) == numbers


def test_the_blank_frame_must_be_whole(
    unit: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    jpegs = [encode_jpeg(image, 95) for image in pictures(unit)]
    clip = recorded(tmp_path / "clip.mcap", [jpegs[0][:500], *jpegs])
    words = ("track", unit, clip, "--background", "first", "--out", tmp_path / "out")
    assert "does not begin with a blank frame" in refused(capsys, *words)
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("command", COMMANDS)
def test_another_sensor_s_frames_are_refused_at_the_first(
    command: str, unit: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    clip = write_clip(tmp_path / "clip.avi", 3)
    words = (command, unit, clip, "--out", tmp_path / "out")
    assert "frame 0: the frame is 160x120 pixels, not" in refused(capsys, *words)


@pytest.mark.parametrize("command", COMMANDS)
def test_what_is_cut_off_is_said(command: str, unit: Path, tmp_path: Path) -> None:
    jpegs = [encode_jpeg(image, 95) for image in pictures(unit, 40)]
    whole = recorded(tmp_path / "whole.mcap", jpegs)
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(whole.read_bytes()[: int(0.7 * whole.stat().st_size)])
    frames = len(list(McapSource(cut)))
    assert 0 < frames < 40
    document, written = ran(command, unit, cut, tmp_path)
    assert len(written) == frames
    assert any("broke off" in remark for remark in document["remarks"])


@pytest.mark.parametrize("command", COMMANDS)
def test_a_stream_that_stands_still_is_said(command: str, unit: Path, tmp_path: Path) -> None:
    first, *_ = pictures(unit, 1)
    for i in range(4):
        write_image(tmp_path / "clip" / f"{i}.png", first)
    document, written = ran(command, unit, tmp_path / "clip", tmp_path)
    assert len(written) == 4
    assert any(
        remark.startswith("The stream stood still: 3 of 4") for remark in document["remarks"]
    )


@pytest.mark.parametrize("command", COMMANDS)
@pytest.mark.parametrize(("seconds", "said"), [((0, 1, 1, 2), False), ((0, 2, 1, 3), True)])
def test_times_that_go_backwards_are_said(
    command: str, seconds: tuple[int, ...], said: bool, unit: Path, tmp_path: Path
) -> None:
    clip = tmp_path / "clip.mcap"
    with Recorder(clip, {"wedge": None}) as recorder:
        for i, (image, second) in enumerate(zip(pictures(unit, 4), seconds, strict=True)):
            frame = TimedFrame(
                index=i, jpeg=encode_jpeg(image, 95), time_ns=second * 10**9, arrived_ns=i * 10**9
            )
            recorder.add("wedge", frame)
    document, _ = ran(command, unit, clip, tmp_path)
    remarks = [remark for remark in document["remarks"] if "Times go backwards" in remark]
    assert len(remarks) == said
    assert all("frame 00002" in remark for remark in remarks)


@pytest.mark.parametrize(
    ("number", "word"), [(signal.SIGINT, "Ctrl-C"), (signal.SIGTERM, "SIGTERM")]
)
@pytest.mark.parametrize(
    ("command", "kind", "work"),
    [
        ("markers", MarkerTracker, "track"),
        ("cloud", Reconstructor, "__call__"),
        ("track", Reconstructor, "__call__"),
    ],
)
def test_who_is_asked_to_end_keeps_what_was_done(
    number: signal.Signals,
    word: str,
    command: str,
    kind: type,
    work: str,
    unit: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    for i, image in enumerate(pictures(unit)):
        write_image(tmp_path / "clip" / f"{i}.png", image)
    usual, worked_on = getattr(kind, work), []

    def interrupted(*given: object, **named: object) -> object:
        worked_on.append(1)
        if len(worked_on) == 3:
            signal.raise_signal(number)
        return usual(*given, **named)

    monkeypatch.setattr(kind, work, interrupted)
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        document, written = ran(command, unit, tmp_path / "clip", tmp_path)
    finally:
        signal.signal(signal.SIGINT, before)
    assert len(written) == 3
    assert document["remarks"] == [f"Ended by {word} after 3 frames."]


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
@pytest.mark.parametrize("command", COMMANDS)
def test_who_is_asked_to_end_before_anything_is_whole_leaves_nothing(
    number: signal.Signals,
    command: str,
    unit: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    clip = recorded(tmp_path / "clip.mcap", [b"no JPEG"] * 4)

    def interrupted(*_: object) -> object:
        signal.raise_signal(number)
        raise WedgeError("it is damaged")

    monkeypatch.setattr(TimedFrame, "image", interrupted)
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        assert run(command, unit, clip, "--out", tmp_path / "out") == 128 + number
    finally:
        signal.signal(signal.SIGINT, before)
    assert not list((tmp_path / "out").glob("*"))


def test_where_no_frame_is_whole_from_the_beginning_on_there_is_no_track(
    unit: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    jpegs = [encode_jpeg(image, 95) for image in pictures(unit)]
    clip = recorded(tmp_path / "clip.mcap", jpegs[:2] + [jpeg[:99] for jpeg in jpegs])
    words = ("track", unit, clip, "--begin", 2, "--out", tmp_path / "out")
    assert "holds no whole frame from 2 on" in refused(capsys, *words)
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("command", COMMANDS)
def test_a_camera_that_is_unplugged_costs_what_it_would_have_given(
    command: str,
    unit: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    for i, image in enumerate(pictures(unit)):
        write_image(tmp_path / "clip" / f"{i}.png", image)
    usual = FolderSource._images

    def unplugged(source: FolderSource) -> Iterator[object]:
        yield from islice(usual(source), 3)
        raise WedgeError("was it unplugged?")

    monkeypatch.setattr(FolderSource, "_images", unplugged)
    out, told = tmp_path / "out", tmp_path / "told.json"
    sentence = refused(capsys, command, unit, tmp_path / "clip", "--out", out, "--json", told)
    assert sentence == "wedge: was it unplugged?"
    document = json.loads(told.read_text())
    assert document["remarks"] == ["was it unplugged?"]
    assert len(rows(out, document, command)) == 3


@pytest.mark.parametrize(
    ("where", "is_one"),
    [
        ("press.png", True),
        ("run#1/press.JPG", True),
        ("press.TIF", True),
        ("frames.npz#17", True),
        ("clip.mp4", False),
        ("folder", False),
        ("folder#1", False),
        ("clip#2.mp4", False),
        ("http://10.55.0.1/stream.jpg", False),
        ("usb:0", False),
    ],
)
def test_an_image_is_told_from_what_gives_a_stream(
    where: str, is_one: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    for folder in ("folder", "folder#1"):
        Path(folder).mkdir()
    Path("clip#2.mp4").write_bytes(b"")
    assert is_image(where) is is_one
