# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""`wedge capture` takes no held touch for the blank gel where it knows where the lights are."""

import math
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pytest

from app._capture_session import CaptureSession
from recon.images import read_image, write_image
from recon.labels.capture import BLANK_FRAMES, STILL_FRAMES
from recon.stream import TimedFrame
from sensor.dataset import Dataset, read_dataset
from tests.app.commands import refused
from tests.synthetic import BALL_RADIUS_MM, LIGHTS_DEG, make_dataset


def captured(like: Dataset, files: list[tuple[str, int]], out: Path) -> CaptureSession:
    """A session that was shown frames of a dataset, each so many times in fresh noise."""
    session = CaptureSession(
        out,
        presses=3,
        other=like,
        ball_radius_mm=BALL_RADIUS_MM,
        pad_size_mm=(1.0, 1.0),
        pad_by=None,
        caliper_mm=None,
        background=None,
    )
    rng = np.random.default_rng(0)
    for index, file in enumerate(file for file, times in files for _ in range(times)):
        picture = read_image(like.folder / file).astype(int)
        pixels = (picture + rng.integers(-1, 2, picture.shape)).clip(0, 255).astype(np.uint8)
        session.look(TimedFrame(index=index, time_ns=index, arrived_ns=index, pixels=pixels))
    return session


@pytest.mark.parametrize("lights_deg", [LIGHTS_DEG, {"R": 90.0, "B": -90.0}])
def test_the_blank_gel_is_taken_anew_once_a_held_ball_is_lifted(
    lights_deg: Mapping[str, float], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    like = make_dataset(tmp_path / "like", presses=3, lights_deg=lights_deg)
    held, *pressed = (label.file for label in like.labels)
    shown = [(held, BLANK_FRAMES + 4), ("background.png", STILL_FRAMES + BLANK_FRAMES + 4)]
    for file in pressed:
        shown += [(file, STILL_FRAMES + 2), ("background.png", 3)]
    session = captured(like, shown, tmp_path / "out")
    assert "it is taken anew" in capsys.readouterr().err
    assert session.taken == ["press-001.png", "press-002.png"]
    blank = read_image(tmp_path / "out" / "background.png").astype(float)
    assert np.abs(blank - read_image(like.folder / "background.png")).mean() < 1
    for label, truth in zip(read_dataset(tmp_path / "out").labels, like.labels[1:], strict=True):
        assert math.dist(label.center_px, truth.center_px) < 1.0


def test_a_folder_whose_blank_picture_shows_a_touch_gives_no_press(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    like = make_dataset(tmp_path / "like", presses=1)
    pictures = {"bg-0.png": like.labels[0].file, "ball-1.png": "background.png"}
    for name, file in pictures.items():
        write_image(tmp_path / "frames" / name, read_image(like.folder / file))
    words = ("--like", like.folder, "--out", tmp_path / "out")
    said = refused(capsys, "capture", tmp_path / "frames", *words)
    assert "something touches on the picture of the blank gel: give another" in said
