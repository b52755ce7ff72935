# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Every command that finds circles centres those of one sensor in the same way."""

import shutil
from pathlib import Path

import pytest

from recon.labels import find_circles
from recon.presses import press_reader
from sensor.dataset import BallLabel, read_dataset
from tests.app.commands import run
from tests.synthetic import BALL_RADIUS_MM, SIZE_PX, make_dataset


@pytest.fixture
def frames(tmp_path: Path) -> Path:
    """Pictures of a gel plane, without labels."""
    made = make_dataset(tmp_path / "made", presses=find_circles.FEWEST)
    (tmp_path / "frames").mkdir()
    for name in ("background.png", *(label.file for label in made.labels)):
        shutil.copy(made.folder / name, tmp_path / "frames" / name)
    return tmp_path / "frames"


def labels(frames: Path, out: Path, command: str) -> tuple[BallLabel, ...]:
    """What a command finds in the frames."""
    if command == "label":
        shutil.copytree(frames.parent / "made", out)
        (out / "labels.csv").unlink()
        words = ["label", out, "--no-page"]
    else:
        size = ("--pad-size-mm", 0.1 * SIZE_PX[0], 0.1 * SIZE_PX[1])
        words = [*command.split(), frames, "--out", out, "--ball-radius-mm", BALL_RADIUS_MM, *size]
    assert run(*words) == 0
    return read_dataset(out).labels


@pytest.mark.usefixtures("in_this_process")
@pytest.mark.parametrize("command", ["label", "data import", "capture"])
def test_widely_spread_outlines_give_way_to_the_shading(
    command: str, frames: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    by_outline = labels(frames, tmp_path / "outline", command)
    monkeypatch.setattr(find_circles, "WIDEST_SPREAD", -1.0)
    by_shading = labels(frames, tmp_path / "shading", command)
    reader = press_reader(read_dataset(tmp_path / "shading"))
    circles = [find_circles.found_circle(reader, label.file) for label in by_shading]
    assert len(circles) == find_circles.FEWEST
    for label, other, circle in zip(by_shading, by_outline, circles, strict=True):
        assert circle is not None and circle.shading_px is not None
        assert label.center_px == pytest.approx(circle.shading_px, abs=0.01)
        assert other.center_px == pytest.approx(circle.center_px, abs=0.01)
    assert by_shading != by_outline
