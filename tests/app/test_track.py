# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
import csv
import json

import numpy as np
import pytest
from PIL import Image
from rosbags.highlevel import AnyReader
from rosbags.typesys import Stores, get_typestore

from app.__main__ import main
from recon.calibration import calibrate
from recon.images import write_image
from recon.pose.rigid import motion
from recon.pose.transforms import tf_message, write_transforms
from recon.presses import read_presses
from tests.synthetic import digitized, gradient_of, make_dataset, shaded


def run(*words):
    with pytest.raises(SystemExit) as stop:
        main([str(word) for word in words])
    return stop.value.code


@pytest.fixture(scope="module")
def workplace(tmp_path_factory):
    """A unit, and a clip of a ball that comes, rolls sideways and leaves."""
    folder = tmp_path_factory.mktemp("workplace")
    dataset = make_dataset(folder / "set", presses=8)
    unit = calibrate(
        dataset,
        read_presses(dataset),
        estimator="table",
        serial="test",
        created="2026-01-01",
        metrics={},
        seed=0,
    )
    unit.save(folder / "unit")
    places = [None, (50.0, 45.0, 17.0), (50.5, 45.0, 17.0), (51.0, 45.0, 17.0), None]
    rng = np.random.default_rng(0)
    (folder / "clip").mkdir()
    for index, place in enumerate(places):
        light = shaded(gradient_of(place))
        noisy = digitized(light + 0.5 / 255 * rng.standard_normal(light.shape))
        write_image(folder / "clip" / f"frame-{index}.png", noisy)
    return folder


def test_a_clip_becomes_poses_a_plot_an_overlay_and_transforms(workplace, tmp_path):
    out = tmp_path / "out"
    words = (workplace / "unit", workplace / "clip", "--background", "first")
    assert run("track", *words, "--out", out, "--json", tmp_path / "poses.json") == 0
    with (out / "poses.csv").open() as stream:
        rows = list(csv.DictReader(stream))
    assert [row["state"] == "lost" for row in rows] == [True, False, False, False, True]
    assert {row["reason"] for row in rows if row["state"] == "lost"} == {"nothing touches"}
    assert rows[0]["x_mm"] == "" and float(rows[1]["qw"]) == 1
    # A smooth ball: where it went is seen, how it turned is not, and that is said.
    assert rows[3]["state"] == "weak"
    document = json.loads((tmp_path / "poses.json").read_text())
    assert [row["state"] for row in document["poses"]] == [row["state"] for row in rows]
    assert document["poses"][0]["x_mm"] is None
    with Image.open(out / "overlay.webp") as clip:
        assert clip.n_frames == 5
    assert (out / "poses.png").read_bytes()[:4] == b"\x89PNG"
    with AnyReader([out / "poses.mcap"]) as reader:
        stamps = [stamp for _, stamp, _ in reader.messages()]
    assert len(stamps) == 3


def test_transforms_are_read_back_in_metres(tmp_path):
    pose = motion(np.array([0.3, -0.4, 0.5, 10.0, -20.0, 5.0]))
    write_transforms(tmp_path / "poses.mcap", [(1_234_567_890_123_456_789, pose)])
    with AnyReader([tmp_path / "poses.mcap"]) as reader:
        ((connection, stamp, raw),) = reader.messages()
        message = reader.deserialize(raw, connection.msgtype)
    (found,) = message.transforms
    assert stamp == 1_234_567_890_123_456_789
    assert (found.header.frame_id, found.child_frame_id) == ("gel", "object")
    shift, turn = found.transform.translation, found.transform.rotation
    np.testing.assert_allclose([shift.x, shift.y, shift.z], pose[:3, 3] / 1000)
    assert abs(turn.x**2 + turn.y**2 + turn.z**2 + turn.w**2 - 1) < 1e-12
    ros = get_typestore(Stores.ROS2_HUMBLE)
    again = ros.deserialize_cdr(tf_message(0, pose), "tf2_msgs/msg/TFMessage")
    assert again.transforms[0].transform.rotation.w == turn.w


@pytest.mark.parametrize(
    ("extra", "words"),
    [
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
