# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""What `wedge stream` counts, what it says of frames that nobody can use, and Rerun's files."""

import json
import socket
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import app._sources
from app._sources import RATE_OVER_S, Rate
from recon.images import write_image
from recon.stream import McapSource, Recorder, TimedFrame
from recon.stream.jpeg import scan_start
from sensor.extras import how_to_install
from tests.app.commands import refused, run
from tests.recon.fast.units import make_unit
from tests.recon.stream.servers import FRAMES, ScriptedServer, free_port, stream, write_clip


def test_a_stream_whose_frames_are_all_damaged_inside_fails(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    scans = [frame[scan_start(frame) :] for frame in FRAMES]
    spoilt = [
        frame.replace(scan, scan[:9] + b"\xff\xd8" * 9)
        for frame, scan in zip(FRAMES, scans, strict=True)
    ]
    numbers = tmp_path / "numbers.json"
    with ScriptedServer(stream(*spoilt), b"") as server:
        words = ("stream", server.url, "--seconds", 0.5, "--json", numbers)
        assert "gave no whole frame: " in refused(capsys, *words)
    assert not numbers.exists()


def test_a_grey_stream_is_refused_for_being_grey(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    Image.new("L", (32, 24), 90).save(tmp_path / "grey.jpg")
    with ScriptedServer(stream((tmp_path / "grey.jpg").read_bytes()), b"") as server:
        said = refused(capsys, "stream", server.url, "--seconds", 0.5)
    assert "gave no whole frame: 1 damaged. The last one: the frame is grey" in said


def test_frames_that_change_their_size_are_recorded_and_said(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder, numbers = tmp_path / "images", tmp_path / "numbers.json"
    for index, size_px in enumerate([(48, 64), (48, 64), (24, 32), (48, 64)]):
        write_image(folder / f"{index}.png", np.zeros((*size_px, 3), np.uint8))
    words = ("record", folder, "--out", tmp_path / "touch.mcap", "--json", numbers)
    assert run(*words) == 0
    told = json.loads(numbers.read_text())["sensors"]["wedge"]
    said = "The frame size changes, first from 64x48 to 32x24 pixels."
    assert (told["recorded"], told["remark"]) == (4, said)
    output = capsys.readouterr()
    assert output.err.count(said) == output.out.count(said) == 1


def test_a_recording_of_which_one_stream_is_lost_at_the_end_fails_and_keeps_all(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    def hold(connection: socket.socket) -> None:
        connection.sendall(stream(*FRAMES))
        good.over.wait()

    out = tmp_path / "touch.mcap"
    with ScriptedServer(hold) as good, ScriptedServer(stream(*FRAMES[:3]), b"") as gone:
        words = ["record", good.url, gone.url, "--out", out, "--seconds", 0.5]
        said = refused(capsys, *words)
    assert said.startswith(f"wedge: when the recording ended, wedge1 was lost: {gone.url} ")
    assert [len(list(McapSource(out, name))) for name in ("wedge0", "wedge1")] == [8, 3]


def test_what_a_replayed_file_lacks_is_said(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    clip, kept = write_clip(tmp_path / "clip.avi", 9), tmp_path / "touch.mcap"
    assert run("record", clip, "--out", kept) == 0
    kept.write_bytes(kept.read_bytes()[:-400])
    capsys.readouterr()
    assert run("replay", kept, "--port", 0, "--speed", 100) == 0
    assert "broke off or is damaged" in capsys.readouterr().err


def recorded(path: Path, *jpegs: bytes) -> Path:
    """A recording with a chunk for each frame."""
    with Recorder(path, {"wedge": None}) as recorder:
        for index, jpeg in enumerate(jpegs):
            frame = TimedFrame(index=index, time_ns=index, arrived_ns=2 * 10**9 * index, jpeg=jpeg)
            recorder.add("wedge", frame)
    return path


def test_a_replay_tells_how_many_frames_are_damaged_and_sends_the_others(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    kept, numbers = tmp_path / "touch.mcap", tmp_path / "numbers.json"
    recorded(kept, FRAMES[0], b"no picture", FRAMES[1], FRAMES[2][:-2], FRAMES[3])
    flipped = FRAMES[0][:-9] + bytes([FRAMES[0][-9] ^ 1]) + FRAMES[0][-8:]
    kept.write_bytes(kept.read_bytes().replace(FRAMES[0], flipped))  # its chunk's checksum tells
    assert run("replay", kept, "--port", 0, "--json", numbers) == 0
    assert capsys.readouterr().out.splitlines()[-1] == "2 frames sent, corrupt 3"
    told = json.loads(numbers.read_text())
    assert (told["sent"], told["corrupt"]) == (2, 3)
    assert "is damaged in places" in told["remark"]
    nothing = recorded(tmp_path / "nothing.mcap", b"no picture", FRAMES[2][:-2])
    said = refused(capsys, "replay", nothing, "--port", 0, "--repeat")
    assert said.endswith("holds no whole frame: 2 damaged.")


@pytest.mark.parametrize("every_s", [0.016, 0.4, 1.5, 4.0])
def test_a_rate_is_that_of_frames_however_rare_until_they_stay_away(
    every_s: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    now_s = 100.0
    monkeypatch.setattr(app._sources.time, "monotonic", lambda: now_s)
    rate = Rate()
    assert rate.hz == 0
    for _ in range(50):
        now_s += every_s
        rate.tick()
    assert rate.hz == pytest.approx(1 / every_s)
    now_s += 1.5 * every_s
    assert rate.hz == pytest.approx(1 / every_s)
    now_s += RATE_OVER_S + every_s
    assert rate.hz == 0


def test_what_a_stream_showed_is_read_back_by_rerun(tmp_path: Path) -> None:
    pytest.importorskip("rerun", reason="Rerun is not installed: pip install rerun-sdk")
    unit = tmp_path / "unit"
    make_unit((160, 120)).save(unit)
    clip, shown = write_clip(tmp_path / "clip.avi", 9), tmp_path / "shown.rrd"
    numbers = tmp_path / "numbers.json"
    assert run("stream", clip, "--unit", unit, "--rerun", shown, "--json", numbers) == 0
    looked_at = 9 - json.loads(numbers.read_text())["skipped"]
    rerun = [sys.executable, "-m", "rerun", "rrd"]
    subprocess.run([*rerun, "verify", shown], check=True, capture_output=True)
    told = subprocess.run([*rerun, "stats", shown], check=True, capture_output=True, text=True)
    for entity in ("raw", "depth", "deepest_mm", "contact_mm2"):
        assert f"/{entity}: " in told.stdout
    assert f"num_rows = {4 * looked_at + 1}\n" in told.stdout  # and one says when it began
    unreachable = f"http://127.0.0.1:{free_port()}"
    assert run("stream", unreachable, "--seconds", 0.1, "--rerun", tmp_path / "none.rrd") == 2
    assert list(tmp_path.glob("*none.rrd*")) == []  # nothing half-written stays


def test_without_rerun_the_extra_is_named(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.setitem(sys.modules, "rerun", None)
    clip, shown = write_clip(tmp_path / "clip.avi", 2), tmp_path / "shown.rrd"
    assert how_to_install("rerun") in refused(capsys, "stream", clip, "--rerun", shown)
    assert not shown.exists()


@pytest.mark.parametrize("kept", [True, False])
def test_while_a_stream_is_lost_no_touch_is_shown(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], kept: bool
) -> None:
    make_unit((32, 24)).save(tmp_path / "unit")
    numbers = tmp_path / "numbers.json"
    with ScriptedServer(stream(*FRAMES), *9 * [b""]) as server:
        words = ("stream", server.url, "--unit", tmp_path / "unit", "--json", numbers)
        felt = ("--mcap", tmp_path / "felt.mcap") if kept else ()
        assert run(*words, *felt, "--seconds", 1.5) == 0
    told = json.loads(numbers.read_text())
    assert told["remark"].startswith("lost: ") and told["received"] == len(FRAMES)
    assert {told[name] for name in ("deepest_mm", "contact_mm2", "pose", "markers")} == {None}
    said = capsys.readouterr().out
    assert "[lost: " in said and "deepest" not in said and "pose" not in said


@pytest.mark.parametrize("command", ["stream", "record"])
def test_a_stream_that_breaks_again_and_again_is_said(
    command: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    def last(connection: socket.socket) -> None:
        connection.sendall(stream(*FRAMES))
        server.over.wait()

    out, numbers = tmp_path / "touch.mcap", tmp_path / "numbers.json"
    cut = stream(*FRAMES[:4])[: -len(FRAMES[3]) // 2]
    with ScriptedServer(cut, cut, last) as server:
        words = (command, server.url, *(("--out", out) if command == "record" else ()))
        assert run(*words, "--seconds", 1.2, "--json", numbers) == 0
    told = json.loads(numbers.read_text())
    told = told["sensors"]["wedge"] if command == "record" else told
    assert (told["received"], told["corrupt"], told["connections"]) == (14, 2, 3)
    said = capsys.readouterr()
    assert "corrupt 2" in said.out and "connections 3" in said.out
    again = "wedge: the stream was lost and is connected again."
    assert (again in said.err.splitlines()) is (command == "record")
