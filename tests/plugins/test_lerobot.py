# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""The LeRobot camera against a stand-in for LeRobot: its naming rules, and what each read gives."""

import importlib
import re
import sys
import tomllib
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from PIL import Image

from recon.stream import FolderSource, Recorder, TimedFrame, open_source
from tests.plugins.streams import Stream
from tests.plugins.turns import play_by_turns

STUBS = Path(__file__).parent / "stubs"
DISTRIBUTION = Path(__file__).parents[2] / "plugins" / "lerobot_camera_gelsight_wedge"


@pytest.fixture
def plugin(monkeypatch: pytest.MonkeyPatch) -> Iterator[ModuleType]:
    monkeypatch.syspath_prepend(STUBS)
    monkeypatch.syspath_prepend(DISTRIBUTION)
    yield importlib.import_module(DISTRIBUTION.name)
    for name in [n for n in sys.modules if n.startswith("lerobot")]:
        del sys.modules[name]


def test_lerobot_finds_it_by_its_name(plugin: ModuleType) -> None:
    project = tomllib.loads((DISTRIBUTION / "pyproject.toml").read_text())["project"]
    assert project["name"].startswith("lerobot_camera_")
    assert (DISTRIBUTION / project["name"] / "__init__.py").is_file()  # LeRobot imports that name
    from lerobot.cameras.configs import CameraConfig

    config_class = CameraConfig.KNOWN["gelsight_wedge"]
    device = re.sub("Config$", "", config_class.__name__)
    assert config_class is getattr(plugin, config_class.__name__)
    parent = importlib.import_module(config_class.__module__.rpartition(".")[0])
    assert getattr(parent, device) is getattr(plugin, device)  # where LeRobot looks for it


def test_its_requirements_are_those_of_the_repository() -> None:
    ours = tomllib.loads((DISTRIBUTION.parents[1] / "pyproject.toml").read_text())["project"]
    project = tomllib.loads((DISTRIBUTION / "pyproject.toml").read_text())["project"]
    assert project["version"] == ours["version"]
    assert any(r.startswith(f"{ours['name']}[live]") for r in project["dependencies"])
    assert "live" in ours["optional-dependencies"]


@contextmanager
def connected(plugin: ModuleType, source: str | Path, **more: Any) -> Iterator[Any]:
    camera = plugin.GelSightWedgeCamera(
        plugin.GelSightWedgeCameraConfig(source=str(source), **more)
    )
    camera.connect()
    try:
        yield camera
    finally:
        camera.disconnect_if_connected()


def test_each_read_gives_the_newest_frame(plugin: ModuleType) -> None:
    with Stream() as stream:
        stream.put(10)
        with connected(plugin, stream.url) as camera:
            assert camera.is_connected
            assert (camera.width, camera.height) == (64, 48)
            for level in (50, 90):
                stream.put(level)
                assert camera.async_read(5000).mean() == pytest.approx(level, abs=2)
            stream.put(130)
            assert camera.read().mean() == pytest.approx(130, abs=2)
            assert camera.read_latest(60_000).mean() == pytest.approx(130, abs=2)
            with pytest.raises(TimeoutError):
                camera.async_read(1)  # the same frame is not given twice
            with pytest.raises(TimeoutError):
                camera.read_latest(0)
        assert not camera.is_connected


def test_channels_come_in_the_order_that_was_asked_for(plugin: ModuleType, tmp_path: Path) -> None:
    from lerobot.cameras.configs import ColorMode

    with Stream() as stream:
        stream.put((200, 100, 20))
        with connected(plugin, stream.url) as camera:
            assert list(map(float, camera.read_latest(60_000)[0, 0])) == pytest.approx(
                [200, 100, 20], abs=3
            )
        with connected(plugin, stream.url, color_mode=ColorMode.BGR) as camera:
            assert list(map(float, camera.read_latest(60_000)[0, 0])) == pytest.approx(
                [20, 100, 200], abs=3
            )


def test_it_is_connected_once_and_closed_once(plugin: ModuleType) -> None:
    from lerobot.utils.errors import DeviceAlreadyConnectedError, DeviceNotConnectedError

    with Stream() as stream:
        stream.put(10)
        with connected(plugin, stream.url) as camera:
            with pytest.raises(DeviceAlreadyConnectedError):
                camera.connect()
            camera.disconnect()
            for call in (camera.disconnect, camera.read, camera.async_read, camera.read_latest):
                with pytest.raises(DeviceNotConnectedError):
                    call()
            camera.connect()
            assert camera.is_connected


def test_a_folder_plays_at_its_pace_and_is_connected_until_it_is_closed(
    plugin: ModuleType, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    turns = play_by_turns(monkeypatch)
    for level in range(12):
        Image.fromarray(np.full((48, 64, 3), level, np.uint8)).save(tmp_path / f"{level}.png")
    seen = []
    with connected(plugin, tmp_path) as camera:
        with pytest.raises(TimeoutError, match=f"{tmp_path}.* has ended"):
            while True:
                turns.taken.release()
                seen.append(camera.read().mean())
        assert seen == list(range(1, 12))  # the first one told the size
        assert turns.due_s == pytest.approx(np.arange(12) / 30)
        assert camera.is_connected  # else LeRobot's arm would not let go of its motors
        camera.disconnect()
        assert not camera.is_connected


def test_the_latest_frame_of_a_recording_is_as_old_as_its_playing(
    plugin: ModuleType, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path, years_ago_ns = tmp_path / "touch.mcap", 1_500_000_000 * 10**9
    with Recorder(path, {"wedge": None}) as recorder:
        for index in range(2):
            times = {"time_ns": years_ago_ns + index, "arrived_ns": years_ago_ns + index}
            pixels = np.full((48, 64, 3), 100 * index, np.uint8)
            recorder.add("wedge", TimedFrame(index=index, **times, pixels=pixels))
    turns = play_by_turns(monkeypatch)
    with connected(plugin, path) as camera:
        assert camera.read_latest(60_000).mean() == pytest.approx(0, abs=1)
        with pytest.raises(TimeoutError, match="no frame from the last 0 ms"):
            camera.read_latest(0)
        turns.taken.release()
        assert camera.read().mean() == pytest.approx(100, abs=1)
        assert camera.read_latest(60_000).mean() == pytest.approx(100, abs=1)


@pytest.mark.parametrize(
    ("more", "says"), [({"width": 640, "height": 480}, "64 x 48, not 640 x 480"), ({}, "")]
)
def test_what_is_not_there_or_of_another_size_is_refused(
    plugin: ModuleType, tmp_path: Path, more: dict[str, int], says: str
) -> None:
    Image.fromarray(np.zeros((48, 64, 3), np.uint8)).save(tmp_path / "0.png")
    source = tmp_path if more else "nowhere"
    with pytest.raises(ConnectionError, match=says or "nowhere"), connected(plugin, source, **more):
        pass
    with open_source(tmp_path) as opened:
        assert isinstance(opened, FolderSource)
