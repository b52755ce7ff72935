# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""The ROS 2 node against a stand-in for ROS: what it publishes, and what it says of bad input."""

import contextlib
import importlib.util
import shutil
import subprocess
import sys
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any

import numpy as np
import pytest
from PIL import Image

from recon.calibration import unit_of_set
from recon.fast import FastReconstructor
from recon.images import read_image
from recon.stream import Counts, TimedFrame, open_source
from recon.stream.jpeg import decode_jpeg
from recon.stream.ros import FORMAT
from tests.plugins.turns import play_by_turns
from tests.synthetic import make_dataset

STUBS = Path(__file__).parent / "stubs"
FILE = Path(__file__).parents[2] / "plugins" / "ros2" / "gelsight_wedge_node.py"


@pytest.fixture
def node(monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    monkeypatch.syspath_prepend(STUBS)
    spec = importlib.util.spec_from_file_location("gelsight_wedge_node", FILE)
    assert spec and spec.loader
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def desk(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A unit, and a folder of one JPEG of a press."""
    folder = tmp_path_factory.mktemp("desk")
    unit_of_set(make_dataset(folder / "balls"), "table").save(folder / "unit")
    (folder / "frames").mkdir()
    press = Image.fromarray(read_image(folder / "balls" / "press00.png"))
    press.save(folder / "frames" / "0.jpg", quality=95)
    return folder


def run(node: ModuleType, **parameters: Any) -> tuple[int, Any]:
    import rclpy

    rclpy.ASKED.clear()
    rclpy.ASKED.update(parameters)
    return node.main([]), rclpy


def test_a_frame_is_published_as_it_came_and_as_depth(node: ModuleType, desk: Path) -> None:
    with open_source(desk / "frames") as source:
        (frame,) = source
    status, ros = run(
        node, source=str(desk / "frames"), unit=str(desk / "unit"), frame_id="left_finger"
    )
    assert (status, ros.LOGGED) == (0, [])
    (picture,) = ros.PUBLISHED["~/image_raw/compressed"]
    shown = decode_jpeg(picture.data.tobytes()).astype(float)
    assert np.abs(shown - frame.image()).mean() < 1
    assert picture.format == FORMAT
    assert picture.header.frame_id == "left_finger"
    (depth,) = ros.PUBLISHED["~/depth"]
    assert (depth.encoding, depth.step) == ("32FC1", 4 * depth.width)
    meters = np.frombuffer(depth.data.tobytes(), "<f4").reshape(depth.height, depth.width)
    depth_mm = FastReconstructor.load(desk / "unit")(frame).depth_mm
    assert meters == pytest.approx(depth_mm / 1000, rel=1e-6)
    assert meters.max() > 1e-4
    stamp = depth.header.stamp
    assert stamp.sec * 10**9 + stamp.nanosec == frame.time_ns


def test_a_folder_plays_at_its_pace(
    node: ModuleType, desk: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    turns, whole = play_by_turns(monkeypatch), node.compressed_message

    def taken(*words: Any) -> Any:
        turns.taken.release()
        return whole(*words)

    monkeypatch.setattr(node, "compressed_message", taken)
    for number in range(12):
        shutil.copy(desk / "frames" / "0.jpg", tmp_path / f"{number}.jpg")
    status, ros = run(node, source=str(tmp_path))
    stamps = [message.header.stamp for message in ros.PUBLISHED["~/image_raw/compressed"]]
    assert status == 0
    assert np.diff([stamp.nanosec for stamp in stamps]) == pytest.approx(1e9 / 30, abs=1)
    assert len(stamps) == 12
    assert turns.due_s == pytest.approx(np.arange(12) / 30)


def test_a_jpeg_is_passed_on_unchanged(node: ModuleType) -> None:
    from sensor_msgs.msg import CompressedImage

    frame = TimedFrame(index=0, time_ns=1_800_000_000_250_000_001, arrived_ns=0, jpeg=b"\xff\xd8..")
    message = node.compressed_message(CompressedImage(), frame, "left")
    assert message.data.tobytes() == frame.jpeg
    assert (message.header.stamp.sec, message.header.stamp.nanosec) == (1_800_000_000, 250_000_001)


def test_without_a_unit_there_is_no_depth(node: ModuleType, desk: Path) -> None:
    status, ros = run(node, source=str(desk / "frames"))
    assert status == 0
    assert list(ros.PUBLISHED) == ["~/image_raw/compressed"]


def test_bad_input_is_one_logged_sentence(node: ModuleType, desk: Path) -> None:
    for parameters in ({"source": "nowhere"}, {"source": str(desk / "frames"), "unit": "nowhere"}):
        status, ros = run(node, **parameters)
        assert status == 2
        assert len(ros.LOGGED) == 1
        assert "nowhere" in ros.LOGGED[0]


def test_a_frame_of_another_size_is_one_logged_sentence(
    node: ModuleType, desk: Path, tmp_path: Path
) -> None:
    Image.fromarray(np.zeros((24, 32, 3), np.uint8)).save(tmp_path / "0.png")
    status, ros = run(node, source=str(tmp_path), unit=str(desk / "unit"))
    assert status == 2
    (sentence,) = ros.LOGGED
    assert "the frame is 32x24 pixels, not " in sentence


def test_one_odd_frame_has_no_depth_and_the_others_have(
    node: ModuleType, desk: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    blank = read_image(desk / "balls" / "background.png")
    frames = [
        TimedFrame(index=i, time_ns=i, arrived_ns=i, pixels=pixels)
        for i, pixels in enumerate([blank, blank[:24], blank])
    ]
    monkeypatch.setattr(node, "open_source", lambda _: SimpleNamespace(live=True))
    monkeypatch.setattr(node, "Newest", lambda _: _Each(frames))
    status, ros = run(node, source="any", unit=str(desk / "unit"))
    assert status == 0
    assert [len(messages) for messages in ros.PUBLISHED.values()] == [3, 2]
    (sentence,) = ros.LOGGED
    assert "one frame gave no depth: the frame is" in sentence


class _Each(contextlib.AbstractContextManager):
    """Gives every frame, as no live source is bound to."""

    def __init__(self, frames: list[TimedFrame]) -> None:
        self.source, self.frames = SimpleNamespace(counts=Counts()), frames

    @property
    def ended(self) -> bool:
        return not self.frames

    def take(self, _: float) -> TimedFrame:
        return self.frames.pop(0)

    def __exit__(self, *_: object) -> None: ...


def test_without_ros_it_says_what_to_source() -> None:
    done = subprocess.run([sys.executable, FILE], capture_output=True, text=True, check=False)
    assert done.returncode == 2
    assert "setup.bash" in done.stderr
    assert done.stderr.count("\n") == 1


def test_it_ends_without_a_word_when_its_source_or_ctrl_c_ends_it(
    node: ModuleType, desk: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    ended: list[Any] = []
    monkeypatch.setattr("threading.excepthook", ended.append)
    assert run(node, source=str(desk / "frames"))[0] == 0

    def interrupted(newest: Any, timeout_s: float) -> None:
        import rclpy

        rclpy.try_shutdown()  # before Python's own handler of SIGINT, as rclpy has it
        raise KeyboardInterrupt

    monkeypatch.setattr(node.Newest, "take", interrupted)
    status, ros = run(node, source=str(desk / "frames"))
    assert (status, ros.LOGGED, ended) == (0, [], []) and not ros.ok()
