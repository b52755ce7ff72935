# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Streams as a person handles them: watched, recorded, played again, each fault a sentence."""

import io
import json
import signal
import socket
import subprocess
import sys
import threading
from collections import Counter
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from mcap.reader import make_reader

import app.stream
import recon.stream
from app._sources import Rate, unit_of
from recon.calibration import load_calibration
from recon.contact.disturbed import STRANGE
from recon.images import read_image, write_image
from recon.stream import FrameSource, McapSource, TimedFrame, open_source
from recon.stream.mcap_file import McapFile
from sensor.design import STANDARD
from sensor.errors import WedgeError
from sensor.unit import read_unit_card, write_unit_card
from sensor.wire import Stamp
from tests.app.commands import refused, run
from tests.recon.fast.units import make_unit
from tests.recon.stream.servers import FRAMES, HEAD, ScriptedServer, free_port, stream, write_clip


@pytest.fixture
def unit(tmp_path: Path) -> Path:
    make_unit((160, 120)).save(tmp_path / "unit")
    return tmp_path / "unit"


def test_a_clip_is_recorded_with_its_unit_and_watched_again(
    tmp_path: Path, unit: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    clip = write_clip(tmp_path / "clip.avi", 9)
    numbers, out = tmp_path / "numbers.json", tmp_path / "touch.mcap"
    assert run("record", clip, "--out", out, "--unit", unit, "--json", numbers) == 0
    assert json.loads(numbers.read_text())["sensors"]["wedge"]["received"] == 9
    assert len(list(McapSource(out))) == 9
    capsys.readouterr()
    assert run("stream", out, "--json", numbers) == 0  # the unit inside gives depth
    watched = json.loads(numbers.read_text())
    assert (watched["received"], watched["corrupt"]) == (9, 0)
    assert watched["contact_mm2"] > 0
    assert "deepest" in capsys.readouterr().out


def test_a_recording_of_a_recording_keeps_its_unit(tmp_path: Path, unit: Path) -> None:
    clip, first = write_clip(tmp_path / "clip.avi", 3), tmp_path / "first.mcap"
    again, two = tmp_path / "again.mcap", tmp_path / "two.mcap"
    assert run("record", clip, "--out", first, "--unit", unit) == 0
    assert run("record", first, "--out", again) == 0
    assert McapSource(again).unit == McapSource(first).unit != {}
    assert run("record", clip, again, "--out", two) == 0
    assert McapSource(two, "wedge1").unit == McapSource(first).unit
    assert not McapSource(two, "wedge0").unit


def test_a_recording_keeps_the_numbers_of_an_own_design(tmp_path: Path) -> None:
    own = replace(STANDARD, name="mine", gel=replace(STANDARD.gel, thickness_mm=3.0))
    made = make_unit((160, 120))
    card = replace(made.card, design_sha256=own.sha256)
    replace(made, card=card, design=own).save(tmp_path / "unit")
    clip, out = write_clip(tmp_path / "clip.avi", 3), tmp_path / "touch.mcap"
    assert run("record", clip, "--out", out, "--unit", tmp_path / "unit") == 0
    with unit_of(str(out), None) as folder:
        assert folder is not None and load_calibration(folder).design == own


def test_what_a_stream_feels_is_kept_for_others(
    tmp_path: Path, unit: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    clip, kept = write_clip(tmp_path / "clip.avi", 9), tmp_path / "felt.mcap"
    numbers = tmp_path / "numbers.json"
    command = ("stream", clip, "--mcap", kept)
    assert run(*command, "--unit", unit, "--json", numbers) == 0
    told = json.loads(numbers.read_text())
    assert told["pose"].split(":")[0] in ("tracking", "weak", "lost", "frozen")
    assert told["markers"] == "none"
    assert f"pose {told['pose']}" in capsys.readouterr().out
    with kept.open("rb") as stream:
        topics = Counter(channel.topic for _, channel, _ in make_reader(stream).iter_messages())
    assert topics["/wedge/contact"] == topics["/wedge/pose_state"] == 9 - told["skipped"]
    assert "exists" in refused(capsys, *command, "--unit", unit)
    for of_unit, remarks in ((STANDARD.sha256, 0), ("0" * 64, 1)):
        write_unit_card(unit, replace(read_unit_card(unit), design_sha256=of_unit))
        again = tmp_path / f"{remarks}.mcap"
        assert run("stream", clip, "--mcap", again, "--unit", unit) == 0
        assert capsys.readouterr().err.count("counts as flat") == remarks
    assert "--unit" in refused(capsys, "stream", clip, "--mcap", tmp_path / "none.mcap")


def test_a_damaged_stream_is_recorded_without_what_is_damaged(tmp_path: Path) -> None:
    sent = stream(*FRAMES, stamps=[Stamp(index=i + i // 4) for i in range(8)])
    sent = sent.replace(FRAMES[2], FRAMES[2][:-20])
    numbers, out = tmp_path / "numbers.json", tmp_path / "touch.mcap"
    with ScriptedServer(sent, b"") as server:
        words = ["record", server.url, "--out", out, "--seconds", 0.5, "--json", numbers]
        assert run(*words) == 0
    counts = json.loads(numbers.read_text())["sensors"]["wedge"]
    assert counts.pop("remark").startswith("lost: ")  # the server had gone by then
    assert counts.pop("connections") == 1
    assert counts == {"received": 7, "recorded": 7, "dropped": 1, "corrupt": 1}
    assert [f.jpeg for f in McapSource(out)] == FRAMES[:2] + FRAMES[3:]


def images_of(folder: Path, unit: Path, count: int) -> Path:
    """Frames of a unit, each a little brighter than the one before."""
    blank = read_image(unit / "background.png")
    for i in range(count):
        write_image(folder / f"{i}.png", np.clip(blank.astype(int) + i, 0, 255).astype(np.uint8))
    return folder


@pytest.fixture
def at_leisure(monkeypatch: pytest.MonkeyPatch) -> None:
    """Files are watched frame by frame, however slow the machine is."""

    class Each:
        """`Newest` of a source that waits until its frame was taken."""

        def __init__(self, source: FrameSource) -> None:
            self.source, self.skipped, self.ended, self.remark = source.source, 0, False, ""
            self._frames = iter(source.source)

        def __enter__(self) -> "Each":
            return self

        def __exit__(self, *_: object) -> None:
            self.source.close()

        def take(self, timeout_s: float) -> TimedFrame | None:
            frame = next(self._frames, None)
            self.ended = frame is None
            return frame

    monkeypatch.setattr(recon.stream, "Newest", Each)


@pytest.mark.usefixtures("at_leisure")
def test_a_frame_of_another_size_is_counted_and_watched_on(
    tmp_path: Path, unit: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder, numbers = images_of(tmp_path / "images", unit, 5), tmp_path / "numbers.json"
    write_image(folder / "3.png", np.zeros((8, 8, 3), np.uint8))
    words = ("stream", folder, "--unit", unit, "--json", numbers)
    kept = tmp_path / "felt.mcap"
    assert run(*words, "--mcap", kept) == 0
    told = json.loads(numbers.read_text())
    assert (told["received"], told["corrupt"]) == (5, 1)
    with kept.open("rb") as stream:
        messages = make_reader(stream).iter_messages("/wedge/pose_state")
        assert sum(1 for _ in messages) == 4  # nothing is said of the frame that says nothing
    assert "8x8 pixels" not in told["remark"]  # that one was not the last
    write_image(folder / "5.png", np.zeros((8, 8, 3), np.uint8))
    kept.unlink()
    assert run(*words, "--mcap", kept) == 0
    told = json.loads(numbers.read_text())
    assert (told["received"], told["corrupt"], told["deepest_mm"]) == (6, 2, None)
    assert "8x8 pixels, not 160x120" in told["remark"]
    write_image(folder / "0.png", np.zeros((8, 8, 3), np.uint8))
    assert "8x8 pixels, not 160x120" in refused(capsys, *words)


@pytest.mark.usefixtures("at_leisure")
@pytest.mark.parametrize("kept", [True, False])
def test_frames_that_no_gel_has_felt_are_told_and_counted(
    tmp_path: Path, unit: Path, capsys: pytest.CaptureFixture[str], kept: bool
) -> None:
    blank, numbers = read_image(unit / "background.png"), tmp_path / "numbers.json"
    for index in range(5):
        write_image(tmp_path / "images" / f"{index}.png", 255 - blank if index % 2 else blank)
    words = ("stream", tmp_path / "images", "--unit", unit, "--json", numbers)
    assert run(*words, *(("--mcap", tmp_path / "felt.mcap") if kept else ())) == 0
    remark = json.loads(numbers.read_text())["remark"]
    assert remark == f"In 2 of 5 frames, {STRANGE}."
    assert f"[{remark}]" in capsys.readouterr().out


@pytest.mark.usefixtures("at_leisure")
@pytest.mark.parametrize("still", [True, False])
def test_a_stream_that_stands_still_is_said(
    tmp_path: Path, unit: Path, capsys: pytest.CaptureFixture[str], still: bool
) -> None:
    folder, numbers = images_of(tmp_path / "images", unit, 4), tmp_path / "numbers.json"
    for i in range(1, 4 if still else 0):
        write_image(folder / f"{i}.png", read_image(folder / "0.png"))
    assert run("stream", folder, "--json", numbers) == 0
    assert json.loads(numbers.read_text())["stands_still"] is still
    assert ("stands still" in capsys.readouterr().out) is still


@pytest.mark.usefixtures("at_leisure", "usual_ctrl_c")
def test_ctrl_c_ends_a_stream_and_its_numbers_are_written(
    tmp_path: Path, unit: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder, numbers = images_of(tmp_path / "images", unit, 9), tmp_path / "numbers.json"
    usual = Rate.tick

    def interrupted(rate: Rate) -> None:
        usual(rate)
        signal.raise_signal(signal.SIGINT)

    monkeypatch.setattr(Rate, "tick", interrupted)
    assert run("stream", folder, "--json", numbers) == 0
    assert json.loads(numbers.read_text())["received"] == 1
    monkeypatch.setattr(Rate, "tick", usual)
    monkeypatch.setattr(app.stream, "_taken", lambda *_: iter([signal.raise_signal(signal.SIGINT)]))
    assert run("stream", folder) == 130  # nothing had come


def test_a_damaged_image_is_neither_recorded_nor_sent(
    tmp_path: Path, unit: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder, out = images_of(tmp_path / "images", unit, 4), tmp_path / "touch.mcap"
    (folder / "1.png").write_bytes((folder / "1.png").read_bytes()[:80])
    assert run("record", folder, "--out", out) == 0
    assert "3 frames of wedge, dropped 0, corrupt 1" in (said := capsys.readouterr().out)
    assert "1.png" in said
    assert len(list(McapSource(out))) == 3
    again = tmp_path / "AGAIN.MCAP"
    assert run("record", out, "--out", again) == 0
    assert not McapSource(again).timed  # a folder's rate is made up, whoever records it
    assert run("replay", folder, "--port", 0) == 0
    assert "1.png" in capsys.readouterr().err
    for path in folder.iterdir():
        path.write_bytes(b"no PNG")
    assert "0.png" in refused(capsys, "record", folder, "--out", tmp_path / "none.mcap")
    said = refused(capsys, "replay", folder, "--port", 0, "--repeat")
    assert said.endswith("holds no whole frame: 4 damaged.")


@pytest.mark.usefixtures("usual_ctrl_c")
def test_a_stream_that_is_lost_and_back_is_said(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    said_lost = threading.Event()

    class Told(io.StringIO):
        """What a person reads, who ends the recording when frames come again."""

        def write(self, words: str) -> int:
            if said_lost.is_set() and words == "wedge: frames come.":
                signal.raise_signal(signal.SIGINT)
            if words.startswith("wedge: lost: "):
                said_lost.set()
            return super().write(words)

    def back(connection: socket.socket) -> None:
        while not said_lost.wait(0.01) and not server.over.is_set():
            pass
        connection.sendall(stream(*FRAMES))
        server.over.wait()

    out, told = tmp_path / "touch.mcap", Told()
    monkeypatch.setattr(sys, "stderr", told)
    with ScriptedServer(stream(*FRAMES[:3]), b"", back) as server:
        words = ["record", server.url, "--out", out, "--seconds", 10]
        assert run(*words) == 0
    assert said_lost.is_set()
    assert told.getvalue().splitlines()[-1] == "wedge: frames come."  # it ended there
    assert [f.jpeg for f in McapSource(out)] == FRAMES[:3] + FRAMES


def test_what_a_full_disk_leaves_is_told(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    flush, flushed = McapFile.flush, []

    def full(file: McapFile) -> None:
        if flushed:
            raise WedgeError("touch.mcap cannot be written: No space left on device.")
        flushed.append(flush(file))

    clip, out = write_clip(tmp_path / "clip.avi", 90), tmp_path / "touch.mcap"
    numbers = tmp_path / "numbers.json"
    monkeypatch.setattr(McapFile, "flush", full)
    assert run("record", clip, "--out", out, "--json", numbers) == 2
    told, kept = capsys.readouterr(), len(list(McapSource(out)))
    assert 0 < kept < 90
    assert f"{kept} frames of wedge, " in told.out and f"Recording: {out}" in told.out
    assert json.loads(numbers.read_text())["sensors"]["wedge"]["recorded"] == kept
    assert told.err.splitlines()[-1] == (
        "wedge: touch.mcap cannot be written: No space left on device."
    )


def test_a_stream_that_is_not_there_at_the_beginning_is_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    clip, out = write_clip(tmp_path / "clip.avi", 9), tmp_path / "touch.mcap"
    nowhere = f"http://127.0.0.1:{free_port()}"
    assert "nothing listens" in refused(capsys, "record", clip, nowhere, "--out", out)
    assert not out.exists()


def test_a_stream_that_fails_leaves_the_other_s_recording_alone(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for size_px in ((160, 120), (80, 60)):
        make_unit(size_px).save(tmp_path / f"unit{size_px[0]}")
    clip, out = write_clip(tmp_path / "clip.avi", 9), tmp_path / "touch.mcap"
    units = ["--unit", tmp_path / "unit80", tmp_path / "unit160"]
    sentence = refused(capsys, "record", clip, clip, "--out", out, *units)
    assert "160x120 pixels, but its unit is for 80x60" in sentence
    assert len(list(McapSource(out, "wedge1"))) == 9
    assert list(McapSource(out, "wedge0")) == []


def test_a_recording_without_a_frame_is_not_kept(
    tmp_path: Path, unit: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "touch.mcap"
    with ScriptedServer(HEAD) as server:
        words = ["record", server.url, "--out", out, "--seconds", 0.1]
        assert "no frame came from" in refused(capsys, *words)
    with ScriptedServer(stream(*FRAMES)) as server:
        words = ["record", server.url, "--out", out, "--unit", unit]
        assert "32x24 pixels, but its unit is for 160x120" in refused(capsys, *words)
    assert list(tmp_path.glob("*touch.mcap*")) == []


def test_a_recording_says_that_a_clock_is_not_set(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    sent = stream(*FRAMES, stamps=[Stamp(10**9 * (100 + i), 10**7 * i, i) for i in range(8)])

    def send(connection: socket.socket) -> None:
        connection.sendall(sent)
        server.over.wait()

    with ScriptedServer(send) as server:
        assert run("record", server.url, "--out", tmp_path / "a.mcap", "--seconds", 0.2) == 0
    assert "is not set" in capsys.readouterr().out


def test_a_recording_is_sent_as_a_sensor_would(tmp_path: Path) -> None:
    clip = write_clip(tmp_path / "clip.avi", 6)
    command = [sys.executable, "-m", "app", "replay", str(clip), "--repeat", "--port", "0"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        try:
            url = process.stdout.readline().split()[0]
            with open_source(url) as source:
                frames = [frame for frame, _ in zip(source, range(8), strict=False)]
        finally:
            process.kill()
    assert all(frame.image().shape == (120, 160, 3) for frame in frames)
    assert all(frame.clock == "sensor" for frame in frames)


def test_what_cannot_be_streamed_is_a_sentence(
    tmp_path: Path, unit: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    clip = write_clip(tmp_path / "clip.avi", 3)
    small = tmp_path / "small"
    make_unit((80, 60)).save(small)
    nothing = f"http://127.0.0.1:{free_port()}"
    assert "nothing listens" in refused(capsys, "stream", nothing)
    assert "160x120 pixels, not 80x60" in refused(capsys, "stream", clip, "--unit", small)
    assert "not a unit folder" in refused(capsys, "stream", clip, "--unit", tmp_path)
    words = ("--out", tmp_path / "a.mcap", "--unit", unit)
    assert "streams: 2, units: 1; name one" in refused(capsys, "record", clip, clip, *words)
    assert "streams: 1, units: 2; name one" in refused(capsys, "record", clip, *words, unit)
    assert "call it clip.mcap" in refused(capsys, "record", clip, "--out", clip)
    felt = ("stream", clip, "--unit", unit, "--mcap", tmp_path / "felt.txt")
    assert "call it felt.mcap" in refused(capsys, *felt)
    (tmp_path / "kept.mcap").write_bytes(b"kept")
    assert "exists" in refused(capsys, "record", clip, "--out", tmp_path / "kept.mcap")
    assert "must be above zero" in refused(capsys, "replay", clip, "--speed", 0)
    with ScriptedServer(b"") as taken:
        assert "cannot listen on" in refused(capsys, "replay", clip, "--port", taken.port)
    assert not (tmp_path / "a.mcap").exists()


def test_the_unit_inside_a_recording_is_found_however_its_name_is_written(
    tmp_path: Path, unit: Path
) -> None:
    out = tmp_path / "TOUCH.MCAP"
    assert run("record", write_clip(tmp_path / "clip.avi", 2), "--unit", unit, "--out", out) == 0
    with unit_of(str(out), None) as inside:
        assert inside is not None and (inside / "unit.toml").is_file()
