# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""What `wedge markers` found is kept, whatever ends it."""

import csv
import json
from collections.abc import Callable
from pathlib import Path

import pytest
from mcap.reader import make_reader

from recon.images import write_image
from recon.markers.tracking import MarkerTracker, Tracked
from tests.app.commands import run
from tests.app.test_clips import pictures, unit
from tests.app.test_touch_commands import PLACES
from tests.sensor.test_files import full_disk

__all__ = ["unit"]


def clip_of(unit: Path, folder: Path, frames: int) -> Path:
    """A folder of so many frames, of which three differ."""
    for i, image in enumerate(pictures(unit, 3)):
        write_image(folder / f"{i:03d}.png", image)
    for i in range(3, frames):
        (folder / f"{i:03d}.png").symlink_to(folder / f"{i % 3:03d}.png")
    return folder


def dots_in(out: Path) -> tuple[list[int], int]:
    """Frames in the table, each with all of its dots, and those in the recording."""
    with (out / "markers.csv").open(newline="") as stream:
        headings, *rows = csv.reader(stream)
    assert {len(row) for row in rows} == {len(headings)}
    numbers = [int(row[0]) for row in rows]
    assert numbers == sorted(numbers[:: len(PLACES)] * len(PLACES))
    with (out / "markers.mcap").open("rb") as stream:
        topics = [channel.topic for _, channel, _ in make_reader(stream).iter_messages()]
    return numbers[:: len(PLACES)], topics.count("/wedge/markers")


def test_a_disk_that_fills_up_ends_markers_but_takes_nothing(
    unit: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out, told = tmp_path / "out", tmp_path / "told.json"
    words = ("markers", unit, clip_of(unit, tmp_path / "clip", 80), "--out", out, "--json", told)
    with full_disk(200_000):
        assert run(*words) == 2
    said = capsys.readouterr().err
    # The clip would be larger than the table that did not fit.
    kept = ["markers.csv", "markers.mcap", "markers.png"]
    assert sorted(path.name for path in out.iterdir()) == kept
    followed, recorded = dots_in(out)
    assert 31 < len(followed) < 80
    assert followed == list(range(len(followed)))
    assert len(followed) - 31 <= recorded <= len(followed) + 1
    assert f"{out / 'markers.csv'} cannot be written: File too large. Frames 0 to" in said
    assert f"{followed[-1]} are kept in {out}: markers.mcap, markers.csv, markers.png;" in said
    document = json.loads(told.read_text())
    assert [row["frame"] for row in document["frames"]] == followed
    assert document["remarks"][-1] in said


@pytest.mark.parametrize("whole", [0, 3])
def test_what_ends_markers_takes_nothing_that_was_found(
    unit: Path,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
    whole: int,
) -> None:
    usual: Callable[..., Tracked] = MarkerTracker.track
    seen = []

    def interrupted(*given: object) -> Tracked:
        seen.append(1)
        if len(seen) > whole:
            raise KeyboardInterrupt
        return usual(*given)

    monkeypatch.setattr(MarkerTracker, "track", interrupted)
    out = tmp_path / "out"
    words = ("markers", unit, clip_of(unit, tmp_path / "clip", 6), "--out", out)
    assert run(*words) == 130
    if whole:
        kept = f"Results so far are kept in {out}: markers.mcap, markers.csv."
        assert kept in capsys.readouterr().err
        assert dots_in(out) == ([0, 1, 2], 3)
        before = {path.name: path.read_bytes() for path in out.iterdir()}
        assert run(*words) == 2  # and not over it
        assert f"{out} already exists and is not empty" in capsys.readouterr().err
        assert {path.name: path.read_bytes() for path in out.iterdir()} == before
    else:
        assert not out.exists()
