# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""`wedge data import` says which scale it took, and `wedge data` ignores no option."""

import shutil
from pathlib import Path

import pytest

from app._importing import _say
from recon.geometry.lens import Lens, read_lens, write_lens
from recon.images import read_image, write_image
from sensor.dataset import LENS_FILE, DatasetCard, read_dataset
from sensor.design import FINGER
from tests.app.commands import refused, run
from tests.synthetic import (
    BALL_RADIUS_MM,
    KEYSTONE_PX,
    MM_PER_PX,
    SIZE_PX,
    make_dataset,
    pad_size_mm,
)
from validation.importers.raw_frames import Prepared


@pytest.fixture
def flat(tmp_path: Path, in_this_process: None) -> Path:
    """Raw frames that show the gel plane, without a pad's rim or a caliper's picture."""
    made = make_dataset(tmp_path / "made", presses=3)
    (tmp_path / "flat").mkdir()
    for name in ("background.png", *(label.file for label in made.labels)):
        shutil.copy(made.folder / name, tmp_path / "flat" / name)
    return tmp_path / "flat"


def imported(flat: Path, *words: object) -> tuple[object, ...]:
    out = flat.with_name("out")
    return ("data", "import", flat, "--out", out, "--ball-radius-mm", BALL_RADIUS_MM, *words)


def test_the_given_scale_of_flat_frames_is_taken(
    flat: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(*imported(flat, "--mm-per-px", MM_PER_PX[0])) == 0
    card = read_dataset(flat.with_name("out")).card
    assert card.mm_per_px == MM_PER_PX and card.corners_px is None
    assert "Scale as given: 0.1 mm/px." in capsys.readouterr().out.splitlines()


def test_the_scale_that_is_assumed_is_said(flat: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(*imported(flat, "--pad-size-mm", 13.2, 9)) == 0
    assert read_dataset(flat.with_name("out")).card.mm_per_px == pytest.approx((0.11, 0.11))
    (line,) = (x for x in capsys.readouterr().out.splitlines() if "mm/px" in x)
    assert "as long as the pad, 13.2 mm, so the scale is 0.11000 mm/px" in line


def test_a_scale_that_a_caliper_measures_is_not_given_as_well(
    flat: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    shutil.copy(flat / "press00.png", flat / "5mm-1.png")
    words = imported(flat, "--mm-per-px", 0.1)
    assert "5mm-1.png is a picture of a caliper" in refused(capsys, *words)
    assert not flat.with_name("out").exists()


def lens(width: int) -> Lens:
    return Lens(
        frame_size_px=(width, SIZE_PX[1]),
        focal_px=(150.0, 150.0),
        center_px=(60.0, 45.0),
        radial=(-0.05, 0.0, 0.0),
        rms_px=0.1,
    )


def test_the_lens_beside_raw_frames_is_used_and_said(
    flat: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    write_lens(flat / LENS_FILE, lens(SIZE_PX[0]))
    assert run(*imported(flat, "--mm-per-px", 0.1)) == 0
    assert read_lens(flat.with_name("out") / LENS_FILE) == lens(SIZE_PX[0])
    assert "lens is read from the camera.toml" in capsys.readouterr().out


def test_the_lens_of_another_camera_is_refused(
    flat: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    write_lens(flat / LENS_FILE, lens(130))
    sentence = refused(capsys, *imported(flat, "--mm-per-px", 0.1))
    assert f"{flat / LENS_FILE}: the lens was measured on 130x90 frames" in sentence
    assert not flat.with_name("out").exists()


@pytest.mark.parametrize(
    ("words", "option"),
    [
        (("list", "--out", "x"), "--out"),
        (("list", "--mm-per-px", "0.1"), "--mm-per-px"),
        (("list", "--ball-radius-mm", "2"), "--ball-radius-mm"),
        (("list", "--pad-size-mm", "20", "20"), "--pad-size-mm"),
        (("path", "taxim-gelsight", "--json", "x"), "--json"),
        (("path", "taxim-gelsight", "--out", "x"), "--out"),
        (("import", "y", "--out", "x", "--json", "z"), "--json"),
    ],
)
def test_an_option_that_the_action_would_ignore_is_refused(
    words: tuple[str, ...],
    option: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    assert f"`wedge data {words[0]}` takes no {option}" in refused(capsys, "data", *words)
    assert not any(tmp_path.iterdir())


def test_what_is_a_dataset_already_is_not_imported(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    made = make_dataset(tmp_path / "made", presses=2)
    words = ("data", "import", made.folder, "--ball-radius-mm", "4", "--out", tmp_path / "out")
    assert f"{made.folder} is already a dataset" in refused(capsys, *words)
    assert not (tmp_path / "out").exists()


def test_two_scales_are_refused(flat: Path, capsys: pytest.CaptureFixture[str]) -> None:
    words = imported(flat, "--mm-per-px", 0.1, "--pad-size-mm", 12, 9)
    assert "give one of them" in refused(capsys, *words)


@pytest.mark.parametrize("without_ball", [2, 3])
@pytest.mark.parametrize("pad", ["in use", "left aside", "none"])
def test_a_pad_that_may_be_none_is_said(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], pad: str, without_ball: int
) -> None:
    labels = make_dataset(tmp_path / "set", presses=2).labels
    card = DatasetCard(
        name="mine",
        source="test",
        licence="CC0-1.0",
        mm_per_px=MM_PER_PX,
        ball_radius_mm=BALL_RADIUS_MM,
        background=("background.png",),
        corners_px=KEYSTONE_PX if pad == "in use" else None,
        pad_size_mm=pad_size_mm() if pad == "in use" else None,
    )
    prepared = Prepared(
        card=card,
        presses=(*(x.file for x in labels), *(f"other{i}.png" for i in range(without_ball))),
        left_out=(),
        labels=labels,
        scale=None,
        caliper=0,
        lens=False,
        left_aside=KEYSTONE_PX if pad == "left aside" else None,
    )
    _say(prepared, tmp_path / "out", "Scale as given: 0.1 mm/px.")
    said = capsys.readouterr().out
    assert ("they are ignored, as --mm-per-px" in said) == (pad == "left aside")
    assert ("No corners of a pad" in said) == (pad == "none")
    corners = f"wedge label {tmp_path / 'out'} --corners"
    assert (corners in said) == (pad == "in use" and without_ball > len(labels))


def test_presses_in_damaged_pictures_and_in_those_of_another_size_are_left_out_and_named(
    flat: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    good = (flat / "press00.png").read_bytes()
    (flat / "cut.png").write_bytes(good[: len(good) // 2])
    write_image(flat / "small.png", read_image(flat / "press00.png")[::2, ::2])
    words = imported(flat, "--mm-per-px", MM_PER_PX[0])
    assert run(*words) == 0
    told = capsys.readouterr()
    said, out = told.err, flat.with_name("out")
    assert "left out 2 presses:" in said and "Balls found in 3 of 3 pictures" in told.out
    assert "  cut.png: cannot be decoded, it may be truncated: " in said
    assert "  small.png: is 60x45 pixels, but background.png is 120x90: " in said
    assert not {"cut.png", "small.png"} & {path.name for path in out.iterdir()}
    assert {x.file for x in read_dataset(out).labels} == {f"press0{i}.png" for i in range(3)}
    shutil.rmtree(out)
    for i in range(3):
        (flat / f"press0{i}.png").unlink()
    assert f"{flat / 'cut.png'} cannot be decoded" in refused(capsys, *words)
    (flat / "cut.png").rename(flat / "background.png")
    assert f"{flat / 'background.png'} cannot be decoded" in refused(capsys, *words)
    assert not out.exists()


def test_the_pad_is_as_long_as_the_design_s(flat, capsys):
    assert run(*imported(flat, "--design", "finger")) == 0
    pitch_mm = FINGER.pad_size_mm[0] / SIZE_PX[0]
    assert read_dataset(flat.with_name("out")).card.mm_per_px == pytest.approx((pitch_mm, pitch_mm))
    words = imported(flat, "--design", "finger", "--pad-size-mm", 12, 9)
    assert "use one of them" in refused(capsys, *words)


def test_who_goes_on_with_an_earlier_run_is_told_its_options(flat, tmp_path, capsys):
    shutil.copytree(make_dataset(tmp_path / "old", presses=2).folder, tmp_path / "unit-presses")
    own = tmp_path / "own.toml"
    own.write_text('base = "finger"\nname = "own"\n')
    said = refused(
        capsys, "calibrate", flat, "--ball-radius-mm", BALL_RADIUS_MM, "--out", tmp_path / "unit",
        "--design", own, "--estimator", "table", "--seed", 3,
    )  # fmt: skip
    wanted = f"{tmp_path}/unit --estimator table --design {own} --seed 3`"
    assert f"continue with `wedge calibrate {tmp_path}/unit-presses --out {wanted}" in said
