# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""`wedge lens` on rendered chessboards: into a dataset, its calibration, and what is refused."""

import shutil
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from recon.geometry.lens import read_lens
from recon.images import write_image
from sensor.dataset import Dataset, write_labels
from tests.app.commands import run
from tests.chessboards import TILTS, TRUE, rendered
from tests.synthetic import make_dataset


@pytest.fixture(scope="module")
def chessboards(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("chessboards")
    for number, tilt in enumerate(TILTS):
        write_image(folder / f"board{number}.png", rendered(tilt, number))
    for name in ("notes.txt", "._board1.png"):  # a Mac's
        (folder / name).write_text("squares of 5 mm")
    return folder


def presses(folder: Path, *, labelled: bool) -> Dataset:
    """A set of frames as large as the chessboards'."""
    dataset = make_dataset(folder, presses=3)
    width, height = TRUE.frame_size_px
    for path in folder.glob("*.png"):
        with Image.open(path) as image:
            image.resize((width, height)).save(path)
    if not labelled:
        write_labels(folder / "labels.csv", [])
    return dataset


def test_chessboards_become_the_lens_beside_the_presses(
    chessboards: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder, picture = presses(tmp_path / "balls", labelled=False).folder, tmp_path / "lens.png"
    assert run("lens", chessboards, "--out", folder, "--picture", picture) == 0
    lens = read_lens(folder / "camera.toml")
    assert lens.frame_size_px == TRUE.frame_size_px
    assert lens.focal_px == pytest.approx(TRUE.focal_px, rel=0.02)
    said = capsys.readouterr().out
    assert all(f"board{number}.png" in said for number in range(len(TILTS)))
    assert f"{lens.rms_px:.2f} px off the lens" in said
    with Image.open(picture) as image:
        assert np.asarray(image.convert("L")).std() > 10


def test_what_shows_no_whole_board_is_named(
    chessboards: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    mixed = tmp_path / "mixed"
    shutil.copytree(chessboards, mixed)
    write_image(mixed / "lid.png", np.full((240, 320, 3), 90, np.uint8))
    assert run("lens", mixed, "--out", tmp_path / "balls") == 0
    assert "No whole board of that size was found in lid.png." in capsys.readouterr().out
    assert (tmp_path / "balls" / "camera.toml").is_file()


@pytest.mark.parametrize(("inset", "guessed"), [(0, True), (24, False)])
def test_boards_that_keep_to_the_middle_leave_a_guess_and_say_so(
    inset: int, guessed: bool, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = tmp_path / "boards"
    for number, tilt in enumerate(TILTS):
        frame = rendered(tilt, number)
        write_image(folder / f"{number}.png", frame[inset : 240 - inset, inset : 320 - inset])
    assert run("lens", folder, "--out", tmp_path / "balls") == 0
    said = "is a guess: take boards nearer to the frame's corners." in capsys.readouterr().out
    assert said == guessed


@pytest.mark.parametrize("fault", ["circles", "size", "unit", "no folder", "no pictures", "few"])
def test_a_place_or_pictures_that_do_not_fit_are_refused_and_nothing_is_written(
    fault: str, chessboards: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out, pictures = tmp_path / "balls", chessboards
    match fault:
        case "circles":
            presses(out, labelled=True)
            reason = "labels.csv has circles, which lie in other pixels"
        case "size":
            make_dataset(out, presses=2)
            write_labels(out / "labels.csv", [])
            reason = "the chessboards are pictures of 320x240 pixels, the frames in"
        case "unit":
            out.mkdir()
            (out / "unit.toml").write_text("")
            reason = "is a unit folder"
        case "no folder":
            pictures = tmp_path / "absent"
            reason = "absent is not a folder"
        case "no pictures":
            pictures = tmp_path / "empty"
            pictures.mkdir()
            reason = "empty holds no pictures"
        case "few":
            pictures = tmp_path / "few"
            for number in range(2):
                write_image(pictures / f"{number}.png", rendered(TILTS[number], number))
            reason = "a whole chessboard was found in 2 of 2 pictures"
    assert run("lens", pictures, "--out", out) == 2
    error = capsys.readouterr().err
    assert reason in error.splitlines()[-1]
    assert not (out / "camera.toml").exists()


@pytest.mark.parametrize("beside", ["presses", "chessboards"])
def test_a_picture_that_would_pass_for_a_press_or_a_board_is_refused(
    beside: str, chessboards: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "raw"
    picture = (out if beside == "presses" else chessboards) / "lens.png"
    assert run("lens", chessboards, "--out", out, "--picture", picture) == 2
    assert "would be taken for one of the pictures beside it" in capsys.readouterr().err
    assert not picture.exists() and not out.exists()
