# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
import csv
import errno
import json
import os
import shutil
from collections import Counter

import numpy as np
import pytest
from mcap.reader import make_reader
from PIL import Image

import app._growing_files
import app.track
from recon.calibration import unit_of_set
from recon.contact.disturbed import STRANGE
from recon.images import read_image, write_image
from recon.pipeline import Reconstructor
from recon.stream import Recorder, TimedFrame
from recon.stream.jpeg import encode_jpeg
from sensor.wire import Stamp
from tests.app.commands import run
from tests.recon.stream.servers import ScriptedServer, stream
from tests.sensor.test_files import failing, full_disk
from tests.synthetic import digitized, gradient_of, make_dataset, shaded


@pytest.fixture(scope="module")
def workplace(tmp_path_factory):
    """A unit, and a clip of a ball that comes, rolls sideways and leaves."""
    folder = tmp_path_factory.mktemp("workplace")
    dataset = make_dataset(folder / "set", presses=8)
    unit_of_set(dataset, "table").save(folder / "unit")
    places = [None, (50.0, 45.0, 17.0), (50.5, 45.0, 17.0), (51.0, 45.0, 17.0), None]
    rng = np.random.default_rng(0)
    (folder / "clip").mkdir()
    for index, place in enumerate(places):
        light = shaded(gradient_of(place))
        noisy = digitized(light + 0.5 / 255 * rng.standard_normal(light.shape))
        write_image(folder / "clip" / f"frame-{index}.png", noisy)
    return folder


@pytest.fixture(scope="module")
def tracked(workplace):
    """What `wedge track` makes of the clip: a folder, and the numbers beside it."""
    out = workplace / "tracked"
    words = (workplace / "unit", workplace / "clip", "--background", "first", "--out", out)
    assert run("track", *words, "--json", workplace / "poses.json") == 0
    return out, json.loads((workplace / "poses.json").read_text())


def test_a_clip_becomes_poses_a_plot_an_overlay_and_transforms(tracked):
    out, document = tracked
    with (out / "poses.csv").open() as stream:
        rows = list(csv.DictReader(stream))
    assert [row["state"] == "lost" for row in rows] == [True, False, False, False, True]
    assert {row["reason"] for row in rows if row["state"] == "lost"} == {"nothing touches"}
    assert rows[0]["x_mm"] == "" and float(rows[1]["qw"]) == 1
    # A smooth ball: where it went is seen, how it turned is not, and that is said.
    assert rows[3]["state"] == "weak"
    assert [row["state"] for row in document["poses"]] == [row["state"] for row in rows]
    assert document["poses"][0]["x_mm"] is None and document["poses"][0]["covariance"] is None
    assert document["first_contact"]["frame"] == 1
    with Image.open(out / "overlay.webp") as clip:
        assert clip.n_frames == 5
    assert (out / "poses.png").read_bytes()[:4] == b"\x89PNG"
    with (out / "poses.mcap").open("rb") as stream:
        counts = Counter(channel.topic for _, channel, _ in make_reader(stream).iter_messages())
    assert counts == {"/tf": 3, "/wedge/pose_state": 5, "/wedge/contact": 5}
    assert {row["markers"] for row in rows} == {"none"}


def test_a_frame_that_no_gel_has_felt_is_not_the_object(workplace, tracked, tmp_path):
    clip, (_, clear) = shutil.copytree(workplace / "clip", tmp_path / "clip"), tracked
    for place in ("frame-0b.png", "frame-2b.png"):
        write_image(clip / place, np.zeros_like(read_image(clip / "frame-0.png")))
    words = (workplace / "unit", clip, "--background", "first", "--json", tmp_path / "t.json")
    assert run("track", *words, "--out", tmp_path / "out") == 0
    poses = json.loads((tmp_path / "t.json").read_text())["poses"]
    dark = [row for row in poses if row["image"].endswith("b.png")]
    assert [(row["state"], row["reason"], row["x_mm"]) for row in dark] == 2 * [
        ("lost", STRANGE, None)
    ]
    for before, after in zip(
        clear["poses"], (row for row in poses if row not in dark), strict=True
    ):
        assert (before["state"], before["x_mm"]) == (after["state"], after["x_mm"])


@pytest.mark.parametrize("command", ["track", "cloud"])
def test_when_something_first_touches_is_told_of_clips_and_in_seconds_where_there_are_times(
    workplace, tmp_path, capsys, command
):
    recording = tmp_path / "told.mcap"
    with Recorder(recording, {"wedge": None}) as recorder:
        for index, path in enumerate(sorted((workplace / "clip").iterdir())):
            times = {"time_ns": 10**9 + index * 10**8, "arrived_ns": 10**9 + index * 10**8}
            frame = TimedFrame(index=index, jpeg=encode_jpeg(read_image(path)), **times)
            recorder.add("wedge", frame)
    for source, said, frame in (
        (recording, "First contact: frame 1, 0.100 s after the first.\n", 1),
        (workplace / "clip", "First contact: frame 1.\n", 1),
        (workplace / "set", "", None),  # presses, none of which has to do with the one before
    ):
        told = tmp_path / "told.json"
        words = (workplace / "unit", source, "--out", tmp_path / source.stem, "--json", told)
        assert run(command, *words) == 0
        document = json.loads(told.read_text())
        first = document["first_contact"]
        assert (first and first["frame"]) == frame and document["touched_at_start"] is False
        out = capsys.readouterr().out
        assert said in out and ("First contact" in out) == bool(said)


@pytest.mark.parametrize("command", ["track", "cloud"])
def test_the_first_contact_has_its_number_in_a_stream_that_lost_a_frame(
    workplace, tmp_path, command
):
    jpegs = [encode_jpeg(read_image(path)) for path in sorted((workplace / "clip").iterdir())]
    sent = stream(*jpegs, stamps=[Stamp(index=index) for index in (0, 2, 3, 4, 5)])
    told = tmp_path / "told.json"
    with ScriptedServer(sent, b"") as server:
        words = (workplace / "unit", server.url, "--frames", 5, "--json", told)
        assert run(command, *words, "--out", tmp_path / "out") == 0
    assert json.loads(told.read_text())["first_contact"]["frame"] == 2


@pytest.mark.parametrize("command", ["track", "cloud"])
def test_what_touches_from_the_first_frame_on_has_no_first_contact(
    workplace, tmp_path, capsys, command
):
    clip, told = tmp_path / "clip", tmp_path / "told.json"
    clip.mkdir()
    for index in (1, 2, 3):
        shutil.copy(workplace / "clip" / f"frame-{index}.png", clip)
    for first in ("frame-1.png", "frame-0.png"):  # then damaged, which says nothing of the touch
        (clip / first).touch()
        words = (workplace / "unit", clip, "--out", tmp_path / first, "--json", told)
        assert run(command, *words) == 0
        assert "something touches in the first frame" in capsys.readouterr().out
        document = json.loads(told.read_text())
        assert document["first_contact"] is None and document["touched_at_start"] is True


def test_the_covariance_of_a_pose_is_written_shifts_first(tracked):
    row = tracked[1]["poses"][3]
    covariance = np.zeros((6, 6))
    covariance[np.triu_indices(6)] = row["covariance"]
    covariance += np.triu(covariance, 1).T
    assert np.linalg.eigvalsh(covariance).min() > 0
    shift, turn = (np.sqrt(np.trace(block)) for block in (covariance[:3, :3], covariance[3:, 3:]))
    np.testing.assert_allclose(shift, row["translation_std_mm"], rtol=1e-4)
    np.testing.assert_allclose(np.degrees(turn), row["rotation_std_deg"], rtol=1e-4)


def test_frames_before_the_beginning_are_passed_over_but_for_the_blank_one(workplace, tmp_path):
    words = (workplace / "unit", workplace / "clip", "--background", "first", "--begin", 2)
    assert run("track", *words, "--out", tmp_path / "out", "--json", tmp_path / "poses.json") == 0
    poses = json.loads((tmp_path / "poses.json").read_text())["poses"]
    assert [row["frame"] for row in poses] == [2, 3, 4]
    assert poses[0]["state"] == "tracking" and poses[0]["x_mm"] == 0  # the object as it is there


@pytest.mark.parametrize(
    ("most", "extra", "followed", "said"),
    [
        (3, (), [0, 1, 2], "Frames 0 to 2 were followed"),
        (2, ("--begin", 1), [1, 2], "continue with --begin 3"),
        (5, (), [0, 1, 2, 3, 4], ""),
        (3, ("--frames", 3), [0, 1, 2], ""),
    ],
)
def test_where_one_run_ends_before_its_source_does_it_says_so(
    workplace, tmp_path, capsys, monkeypatch, most, extra, followed, said
):
    monkeypatch.setattr(app.track, "MOST_FRAMES", most)
    words = (workplace / "unit", workplace / "clip", "--background", "first", *extra)
    assert run("track", *words, "--out", tmp_path / "out", "--json", tmp_path / "poses.json") == 0
    document = json.loads((tmp_path / "poses.json").read_text())
    assert [row["frame"] for row in document["poses"]] == followed
    assert len(document["remarks"]) == bool(said)
    told = capsys.readouterr().err
    assert all(said in remark and remark in told for remark in document["remarks"])


def poses_in(out):
    """Frames in the table and in the recording, both read to their end."""
    with (out / "poses.csv").open() as stream:
        rows = list(csv.reader(stream))
    assert {len(row) for row in rows} == {len(app.track.COLUMNS.split(","))}
    with (out / "poses.mcap").open("rb") as stream:
        topics = [channel.topic for _, channel, _ in make_reader(stream).iter_messages()]
    return [int(row[0]) for row in rows[1:]], topics.count("/wedge/pose_state")


def test_a_disk_that_fills_up_ends_a_run_but_takes_nothing(workplace, tmp_path, capsys):
    (tmp_path / "clip").mkdir()
    for index in range(70):
        frame = workplace / "clip" / f"frame-{(0, 1, 2, 3, 2)[index % 5]}.png"
        (tmp_path / "clip" / f"{index:03d}.png").symlink_to(frame)
    words = ("track", workplace / "unit", tmp_path / "clip", "--background", "first", "--out")
    out, rest = tmp_path / "out", tmp_path / "rest"
    with full_disk(1_000_000):
        assert run(*words, out, "--json", tmp_path / "poses.json") == 2
    said = capsys.readouterr().err
    assert sorted(path.name for path in out.iterdir()) == [
        "overlay.webp",
        "poses.csv",
        "poses.mcap",
        "poses.png",
    ]
    followed, recorded = poses_in(out)
    assert followed == list(range(len(followed))) and 31 <= len(followed) < 70
    assert len(followed) - 31 <= recorded <= len(followed) and recorded > 0
    assert f"{out / 'poses.mcap'} cannot be written: File too large." in said
    assert f"Frames 0 to {followed[-1]} are kept in {out}: poses.mcap, poses.csv" in said
    document = json.loads((tmp_path / "poses.json").read_text())
    assert [row["frame"] for row in document["poses"]] == followed
    assert document["remarks"][-1] in said
    assert f"Continue with --begin {len(followed)}." in said
    assert run(*words, rest, "--begin", len(followed)) == 0
    assert [*followed, *poses_in(rest)[0]] == list(range(70))


def test_a_disk_that_turns_out_full_at_the_end_costs_the_pictures_alone(
    workplace, tmp_path, capsys, monkeypatch
):
    monkeypatch.setattr(os, "fsync", failing(errno.ENOSPC))
    out = tmp_path / "out"
    words = (workplace / "unit", workplace / "clip", "--background", "first", "--out", out)
    assert run("track", *words) == 2
    said = capsys.readouterr().err
    assert "poses.csv cannot be written: No space left on device. Frames 0 to 4 are kept" in said
    assert "Continue with" not in said
    assert sorted(path.name for path in out.iterdir()) == ["poses.csv", "poses.mcap"]
    assert poses_in(out) == ([0, 1, 2, 3, 4], 5)


@pytest.mark.parametrize("whole", [0, 3])
def test_what_ends_a_run_takes_nothing_that_was_found(
    workplace, tmp_path, capsys, monkeypatch, whole
):
    usual, seen = Reconstructor.__call__, []

    def interrupted(self, frame, before=None):
        seen.append(frame)
        if len(seen) > whole:
            raise KeyboardInterrupt
        return usual(self, frame, before)

    monkeypatch.setattr(Reconstructor, "__call__", interrupted)
    out = tmp_path / "out"
    words = (workplace / "unit", workplace / "clip", "--background", "first", "--out", out)
    assert run("track", *words) == 130
    if whole:
        assert (
            f"Results so far are kept in {out}: poses.mcap, poses.csv." in capsys.readouterr().err
        )
        assert poses_in(out) == ([0, 1, 2], 3)
    else:
        assert not out.exists()


def test_a_run_takes_nothing_of_another_that_began_just_now(
    workplace, tmp_path, capsys, monkeypatch
):
    monkeypatch.setattr(
        app._growing_files, "refuse_kept_folder", lambda _: None
    )  # empty a moment ago
    (tmp_path / "poses.mcap").write_bytes(b"another's")
    assert run("track", workplace / "unit", workplace / "clip", "--out", tmp_path) == 2
    assert "poses.mcap exists" in capsys.readouterr().err
    assert (tmp_path / "poses.mcap").read_bytes() == b"another's"


@pytest.mark.parametrize("there", [False, True])
def test_a_run_without_a_frame_leaves_the_folder_as_it_was(workplace, tmp_path, there):
    out = tmp_path / "out"
    if there:
        out.mkdir(mode=0o750)
    words = (workplace / "unit", workplace / "clip", "--begin", 99, "--out", out)
    assert run("track", *words) == 2
    assert out.exists() == there
    if there:
        assert not any(out.iterdir()) and out.stat().st_mode & 0o777 == 0o750


def test_an_hour_of_frames_may_be_asked_for(workplace, tmp_path):
    words = (workplace / "unit", workplace / "clip", "--background", "first", "--frames", 108_000)
    assert run("track", *words, "--out", tmp_path / "out") == 0


def test_a_first_pose_that_is_none_is_named(workplace, tmp_path, capsys):
    (tmp_path / "scaled.txt").write_text("1000 0 0 0 0 1000 0 0 0 0 1000 0 0 0 0 1")
    words = (workplace / "unit", workplace / "clip", "--start", tmp_path / "scaled.txt")
    assert run("track", *words, "--out", tmp_path / "out") == 2
    assert "scaled.txt is not a rigid transform" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("extra", "words"),
    [
        (("--begin", "-1"), "--begin"),
        (("--begin", "99"), "holds no frame 99"),
        (("--frames", "0"), "--frames"),
        (("--mesh", "nowhere.stl"), "nowhere.stl"),
        (("--start", "nowhere.txt"), "nowhere.txt"),
        (("--background", "nowhere.png"), "nowhere.png"),
    ],
)
def test_bad_input_is_one_sentence(workplace, tmp_path, capsys, extra, words):
    out = tmp_path / "out"
    status = run("track", workplace / "unit", workplace / "clip", "--out", out, *extra)
    said = capsys.readouterr().err
    assert status == 2 and words in said and "Traceback" not in said
    assert not out.exists()
