# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""A lens measured from rendered chessboards comes out as it was put in."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from recon.geometry.lens import (
    Boards,
    Lens,
    board_misses_px,
    calibrate_lens,
    find_boards,
    read_lens,
    seen_share,
    write_lens,
)
from recon.images import read_image
from sensor.errors import WedgeError
from tests.chessboards import PATTERN, TILTS, TRUE, board_points, rendered, straight_lens
from validation.datasets import shared_folder


@given(
    k1=st.floats(-0.3, 0.6),
    k2=st.floats(-0.1, 0.3),
    k3=st.floats(-0.05, 0.2),
    f=st.floats(150, 600),
)
def test_undistort_inverts_distort_over_the_whole_frame(
    k1: float, k2: float, k3: float, f: float
) -> None:
    try:
        lens = Lens(
            frame_size_px=(640, 480),
            focal_px=(f, 1.01 * f),
            center_px=(310.0, 235.0),
            radial=(k1, k2, k3),
            rms_px=0.2,
        )
    except WedgeError as error:
        assert "folds" in str(error)  # the seen radius stops growing before the corner
        return
    x, y = np.meshgrid(np.linspace(-0.5, 639.5, 21), np.linspace(-0.5, 479.5, 21))
    raw = np.stack([x, y], -1).reshape(-1, 2)
    assert np.abs(lens.distort(lens.undistort(raw)) - raw).max() < 1e-6
    offsets = (lens.undistort(raw) - lens.center_px) * (raw - lens.center_px)
    assert (offsets.sum(1) >= 0).all()  # never through the centre to the far side


def test_without_distortion_pixels_stay() -> None:
    lens = straight_lens((64, 48))
    points = np.array([[31.5, 23.5], [0.0, 0.0], [63.0, 47.0]])
    assert lens.undistort(points) == pytest.approx(points)
    assert lens.distort(points) == pytest.approx(points)


def test_a_lens_folds_where_the_picture_ends_and_not_where_the_world_does() -> None:
    """An ideal radius of 1.29 focal lengths is seen at 0.86, within the corner's 1.12."""
    with pytest.raises(WedgeError, match="folds"):
        Lens(
            frame_size_px=(640, 480),
            focal_px=(355.6, 355.6),
            center_px=(319.5, 239.5),
            radial=(-0.2, 0.0, 0.0),
            rms_px=0.1,
        )


def test_barrel_distortion_draws_points_toward_the_centre() -> None:
    corner = np.array([[0.0, 0.0]])
    center = np.array(TRUE.center_px)
    assert np.linalg.norm(TRUE.distort(corner) - center) < np.linalg.norm(corner - center)


def test_exact_corners_give_back_the_lens() -> None:
    seen = {str(i): TRUE.distort(board_points(tilt, i)) for i, tilt in enumerate(TILTS)}
    boards = Boards(frame_size_px=(320, 240), pattern=PATTERN, corners_px=seen, left_out=())
    lens = calibrate_lens(boards)
    assert lens.rms_px < 1e-3
    assert lens.focal_px == pytest.approx(TRUE.focal_px, rel=1e-3)
    assert lens.center_px == pytest.approx(TRUE.center_px, abs=0.2)
    points = np.concatenate(list(seen.values()))
    assert np.abs(lens.undistort(points) - TRUE.undistort(points)).max() < 0.1


def test_a_corner_that_was_seen_elsewhere_misses_by_that_much() -> None:
    seen = {str(i): TRUE.distort(board_points(tilt, i)) for i, tilt in enumerate(TILTS)}
    boards = Boards(frame_size_px=(320, 240), pattern=PATTERN, corners_px=seen, left_out=())
    assert max(np.abs(miss).max() for miss in board_misses_px(boards, TRUE).values()) < 1e-3
    seen["0"] = seen["0"] + np.where(np.arange(48) == 20, 0.3, 0.0)[:, None]
    misses = board_misses_px(boards, TRUE)
    assert np.linalg.norm(misses["0"], axis=1).argmax() == 20
    assert misses["0"][20] == pytest.approx((0.3, 0.3), abs=0.05)
    assert misses["0"].mean(0) == pytest.approx((0.0, 0.0), abs=0.01)  # as the board follows


def test_boards_reach_as_far_as_their_outermost_corner() -> None:
    lens = straight_lens((101, 101))
    for place, share in (((50.0, 50.0), 0.0), ((-0.5, 100.5), 1.0), ((50.0, 75.25), 0.5 / 2**0.5)):
        corners = np.array([place, (50.0, 50.0)])
        boards = Boards(
            frame_size_px=(101, 101), pattern=(2, 1), corners_px={"a": corners}, left_out=()
        )
        assert seen_share(boards, lens) == pytest.approx(share)


def test_pictures_give_back_the_lens_and_name_what_shows_no_board() -> None:
    images = {f"board{i}.png": rendered(tilt, i) for i, tilt in enumerate(TILTS)}
    images["blank.png"] = np.full((240, 320, 3), 200, np.uint8)
    boards = find_boards(images)
    assert boards.pattern == PATTERN
    assert boards.left_out == ("blank.png",)
    lens = calibrate_lens(boards)
    assert lens.rms_px < 0.15
    assert lens.focal_px == pytest.approx(TRUE.focal_px, rel=0.02)


def test_too_few_boards_or_mixed_sizes_are_refused() -> None:
    blank = np.full((240, 320, 3), 200, np.uint8)
    with pytest.raises(WedgeError, match="found in 0 of 4 pictures"):
        find_boards({str(i): blank for i in range(4)})
    with pytest.raises(WedgeError, match="differ in size"):
        find_boards({"a.png": blank, "b.png": blank[:200]})
    with pytest.raises(WedgeError, match="no picture of a chessboard was given"):
        find_boards({})


def test_a_lens_survives_its_file(tmp_path: Path) -> None:
    write_lens(tmp_path / "camera.toml", TRUE)
    assert read_lens(tmp_path / "camera.toml") == TRUE


@pytest.mark.parametrize(
    ("old", "new", "fault"),
    [
        ("radial", "radail", "unknown key radail; did you mean radial"),
        ("rms_px = 0.1", "", "rms_px is missing"),
        ("[200.0, 202.0]", "[200.0, -1]", "focal_px"),
        ("[162.0, 118.0]", "[162.0]", "center_px"),
        ("[-0.2, 0.06, 0.0]", "[-0.25]", "radial"),
        ("[-0.2, 0.06, 0.0]", "[-0.9, 0.0, 0.0]", "folds"),
        ("[162.0, 118.0]", "[nan, 118.0]", "finite"),
        (
            "[-0.2, 0.06, 0.0]",
            "[1e308, 1e308, 1e308]",
            "radial .* fits no lens: 1e.308 would move",
        ),
        ("[-0.2, 0.06, 0.0]", "[0.0, 0.0, 1e308]", "radial .* fits no lens"),
        ("[-0.2, 0.06, 0.0]", "[1e154, 1e154, -1e154]", "radial .* fits no lens"),
        ("[162.0, 118.0]", "[1e308, 118.0]", "center_px must lie between -640 and 960"),
        ("[162.0, 118.0]", "[162.0, -1e5]", "center_px must lie"),
        ("[200.0, 202.0]", "[200.0, 1e5]", "focal_px must lie between 32 and 32000"),
        ("[200.0, 202.0]", "[1e-3, 202.0]", "focal_px must lie"),
        ("[320, 240]", "[320, 0.4]", "frame_size_px must be 1 to 8192"),
        ("[320, 240]", "[1000000, 240]", "frame_size_px must be 1 to 8192"),
    ],
)
def test_a_bad_file_is_named_with_its_fault(tmp_path: Path, old: str, new: str, fault: str) -> None:
    path = tmp_path / "camera.toml"
    write_lens(path, TRUE)
    path.write_text(path.read_text().replace(old, new))
    with pytest.raises(WedgeError, match=fault) as caught:
        read_lens(path)
    assert str(caught.value).startswith(str(path))


@given(
    focal=st.floats(),
    center=st.floats(),
    radial=st.tuples(st.floats(), st.floats(), st.floats()),
    size=st.tuples(st.integers(-1, 10**9), st.integers(-1, 10**9)),
)
@settings(max_examples=300)
@example(focal=1e300, center=160.0, radial=(0.0, 0.0, 0.0), size=(320, 240))
@example(focal=float("nan"), center=160.0, radial=(0.0, 0.0, 0.0), size=(320, 240))
@example(focal=200.0, center=1e308, radial=(0.0, 0.0, 0.0), size=(320, 240))
@example(focal=200.0, center=160.0, radial=(1e308, 1e308, 1e308), size=(320, 240))
@example(focal=200.0, center=160.0, radial=(0.0, float("nan"), 0.0), size=(320, 240))
@example(focal=200.0, center=160.0, radial=(30.0, 30.0, 30.0), size=(320, 240))
def test_whatever_the_numbers_a_lens_is_refused_or_inverts(
    focal: float, center: float, radial: tuple[float, float, float], size: tuple[int, int]
) -> None:
    try:
        lens = Lens(
            frame_size_px=size,
            focal_px=(focal, focal),
            center_px=(center, center),
            radial=radial,
            rms_px=0.1,
        )
    except WedgeError:
        return
    raw = np.array([[0.0, 0.0], [size[0] - 1.0, size[1] - 1.0], [size[0] / 2, size[1] / 2]])
    assert np.abs(lens.distort(lens.undistort(raw)) - raw).max() < 1e-6 * max(size)


def test_a_wide_angle_camera_is_calibrated_from_real_boards() -> None:
    folder = shared_folder() / "pi-chessboards"
    if not folder.is_dir():
        pytest.skip(f"{folder} is absent")
    boards = find_boards({path.name: read_image(path) for path in sorted(folder.glob("*.jpg"))})
    assert (boards.pattern, boards.left_out) == (PATTERN, ())
    lens = calibrate_lens(boards)
    assert lens.rms_px < 0.35
    for corners in boards.corners_px.values():  # straight lines on paper are straight again
        for line in lens.undistort(corners).reshape(PATTERN[1], PATTERN[0], 2):
            offset = line - line.mean(0)
            assert np.linalg.svd(offset)[1][1] / np.sqrt(len(line)) < 0.5
