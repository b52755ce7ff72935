# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""What the commands write: one file for each thing, none read."""

import os
import re
from collections import Counter
from pathlib import Path

import pytest
from PIL import Image

from app.__main__ import main
from app._output import RowFile, keep_inputs, output_names, print_table
from sensor.errors import WedgeError
from tests.sensor.test_files import full_disk

HEADINGS = ("unit", "Gx", "", "why", "file")
ROWS = [
    ("twin-standard", "0.012 [0.010, 0.014]", "", "", "units/a-folder-of-a-long-name/press-1.png"),
    ("twin-finger", "172345 [0.070, 0.090]", "", "[red] touched at its edge", "b/2.png"),
]


def test_a_table_ends_with_a_whole_row_where_the_disk_is_full(tmp_path: Path) -> None:
    path = tmp_path / "rows.csv"
    with full_disk(100), RowFile(path, ["first", "second", "third"]) as table:
        with pytest.raises(WedgeError, match=r"rows\.csv cannot be written: File too large"):
            for _ in range(20):
                table.add(['a "b", c', None, 7])
    row = '"a ""b"", c",,7\n'
    rows = (100 - len("first,second,third\n")) // len(row)
    assert path.read_text() == "first,second,third\n" + rows * row
    with pytest.raises(WedgeError, match=r"rows\.csv exists: name a new file\.$"):
        RowFile(path, ["first"])


def test_a_name_that_is_not_utf_8_is_no_end_of_a_table(tmp_path: Path) -> None:
    with RowFile(tmp_path / "rows.csv", ["image"]) as table:
        table.add([os.fsdecode(b"\xff.png")])
    assert (tmp_path / "rows.csv").read_text(encoding="utf-8") == "image\n\\udcff.png\n"


def test_names_are_those_of_the_images_and_of_the_frame_in_an_archive() -> None:
    images = ["a/press.png", "b/frames.npz#17", "frames.npz#1"]
    assert output_names(images, [".npy"]) == ["press", "frames-17", "frames-1"]


@pytest.mark.parametrize(
    ("images", "twice"),
    [
        (("a/press.png", "b/press.jpg"), "press.npy"),
        (("frames.npz#1", "frames-1.png"), "frames-1.npy"),
        (("press.png", "press-doubt.png"), "press-doubt.png"),
        (("press-doubt.png", "press.png"), "press-doubt.png"),
    ],
)
def test_two_images_of_one_file_are_refused(images: tuple[str, ...], twice: str) -> None:
    with pytest.raises(WedgeError, match=f"two images would be written to {twice}: rename one"):
        output_names(images, (".npy", ".png", "-doubt.png"))


@pytest.fixture
def inputs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A unit, a dataset, a folder of frames and files of no content, in the working folder."""
    for name in (
        *("unit/unit.toml", "unit/background.png"),
        *("set/dataset.toml", "set/labels.csv", "set/raw/press.png"),
        *("frames/000.png", "frames/report.json", "frames/more/000.png", "frames.npz"),
        "frames/001.BMP",
        *("clip.mp4", "touch.mcap", "blank.png", "ball.stl", "start.txt", "a#1.png"),
    ):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).touch()
    (tmp_path / "design.toml").write_text('base = "standard"\n')
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.parametrize(
    ("read", "written", "kept"),
    [
        ("frames", "frames/000.png", True),
        ("frames", "frames/001.BMP", True),
        ("frames/", "unit/../frames/000.png", True),
        ("frames", "frames/report.json", False),
        ("frames", "frames/more/000.png", False),
        ("frames", "frames/new.png", False),
        ("set", "set/raw/press.png", True),
        ("unit", "unit/unit.toml", True),
        ("frames.npz#17", "frames.npz", True),
        ("a#1.png", "a#1.png", True),
        ("http://10.55.0.1:8080", "frames/000.png", False),
        (None, "frames/000.png", False),
    ],
)
def test_what_is_read_is_kept_and_nothing_else(
    inputs: Path, read: str | None, written: str, kept: bool
) -> None:
    if kept:
        with pytest.raises(
            WedgeError, match=f"{Path(written)} is an input and would be overwritten"
        ):
            keep_inputs([read], [None, Path(written)])
    else:
        keep_inputs([read], [None, Path(written)])


@pytest.mark.parametrize(
    "words",
    [
        "accept unit set --json set/labels.csv",
        "accept unit set --junit unit/unit.toml",
        "accept unit set --stream touch.mcap --json touch.mcap",
        "calibrate set --out new --json set/dataset.toml",
        "calibrate set --out new --design design.toml --json design.toml",
        "cloud unit frames --out new --json frames/000.png",
        "cloud unit clip.mp4 --out new --design design.toml --json design.toml",
        "evaluate unit set --json set/raw/press.png",
        "fabricate --design design.toml --json design.toml",
        "markers unit frames --out new --json frames/000.png",
        "markers unit clip.mp4 --out new --background blank.png --json blank.png",
        "record touch.mcap --out new.mcap --json touch.mcap",
        "record touch.mcap --unit unit --out new.mcap --json unit/background.png",
        "stream touch.mcap --unit unit --json touch.mcap",
        "stream touch.mcap --unit unit --rerun touch.mcap",
        "sweep gel.curved --design design.toml --json design.toml",
        "table set --markdown set/labels.csv",
        "table set --html set/labels.csv",
        "track unit clip.mp4 --out new --json clip.mp4",
        "track unit clip.mp4 --out new --mesh ball.stl --json ball.stl",
        "track unit clip.mp4 --out new --start start.txt --json start.txt",
        "tune frames --unit unit --json frames/000.png",
        "tune clip.mp4 --unit unit --json unit/unit.toml",
    ],
)
def test_no_command_writes_over_what_it_reads(
    inputs: Path, words: str, capsys: pytest.CaptureFixture[str]
) -> None:
    before = {path: path.read_bytes() for path in inputs.rglob("*") if path.is_file()}
    with pytest.raises(SystemExit) as stop:
        main(words.split())
    said = capsys.readouterr().err
    assert stop.value.code == 2
    assert (
        f"{words.split()[-1]} is an input and would be overwritten" in said
        and said.count("\n") == 1
    )
    assert {path: path.read_bytes() for path in inputs.rglob("*") if path.is_file()} == before


def test_numbers_are_not_written_over_the_recording_that_they_are_of(
    inputs: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    Image.new("RGB", (64, 48)).save("frames/000.png")
    with pytest.raises(SystemExit):
        main(["record", "frames", "--out", "new.mcap", "--json", "new.mcap"])
    assert not Path("new.mcap").exists()
    assert "new.mcap cannot be written: it is named for another output" in capsys.readouterr().err


@pytest.mark.parametrize("width", [30, 80, 90, 100, 130])
def test_a_terminal_however_narrow_cuts_no_figure_and_no_name(
    width: int, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("FORCE_COLOR", "1")  # rich takes stdout for a terminal
    monkeypatch.setenv("COLUMNS", str(width))
    print_table(HEADINGS, ROWS)
    shown = re.sub(r"\x1b\[[\d;]*m", "", capsys.readouterr().out)
    counted = Counter(shown.split())
    for cells in ROWS:
        assert not Counter(" ".join(cells).split()) - counted
    if width >= 90:  # else each row is stacked, and the terminal breaks what is too long
        assert max(map(len, shown.splitlines())) <= width
        assert counted["file"] == 1
    else:
        assert counted["file"] == len(ROWS)


def test_a_table_in_a_pipe_has_one_line_for_each_row(capsys: pytest.CaptureFixture[str]) -> None:
    rows = [(*cells[:-1], "long/" * 100 + cells[-1]) for cells in ROWS]
    print_table(HEADINGS, rows)
    lines = [line.strip() for line in capsys.readouterr().out.splitlines()]
    lines = [line for line in lines if line]
    assert [[c for c in cells if c] for cells in rows] == [
        re.split(r" {2,}", line) for line in lines[-2:]
    ]
    assert len(lines) == 4  # headings and the line below them
