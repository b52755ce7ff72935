# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
import inspect

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from recon.geometry.lens import Lens
from recon.geometry.unwarp import Unwarp, prepare_unwarp
from sensor.errors import WedgeError
from tests.synthetic import homography

RAW = (320, 240)
PAD = (200, 150)
KEYSTONE = ((60.0, 30.0), (290.0, 40.0), (250.0, 220.0), (90.0, 210.0))
WIDE_LENS = Lens(
    frame_size_px=RAW,
    focal_px=(210.0, 212.0),
    center_px=(161.0, 118.0),
    radial=(-0.2, 0.04, -0.003),
    rms_px=0.2,
)


def apply(matrix, points):
    mapped = np.c_[points, np.ones(len(points))] @ matrix.T
    return mapped[:, :2] / mapped[:, 2:]


def outer_edges(size):
    right, bottom = size[0] - 0.5, size[1] - 0.5
    return [(-0.5, -0.5), (right, -0.5), (right, bottom), (-0.5, bottom)]


def with_spots(size, points, sigma=3.0):
    """A frame with a soft round spot at each point, far enough apart to be measured alone."""
    columns, rows = np.meshgrid(*map(np.arange, size))
    light = sum(np.exp(-((columns - x) ** 2 + (rows - y) ** 2) / (2 * sigma**2)) for x, y in points)
    return np.repeat(np.round(250 * light)[..., None], 3, 2).astype(np.uint8)


def centroid_near(image, point, reach=14):
    """Intensity-weighted mean place of the spot nearest to a point."""
    columns, rows = np.meshgrid(*map(np.arange, image.shape[1::-1]))
    weight = np.where(np.hypot(columns - point[0], rows - point[1]) < reach, image[..., 1], 0)
    return np.array([(weight * columns).sum(), (weight * rows).sum()]) / weight.sum()


@pytest.mark.parametrize("lens", [None, WIDE_LENS], ids=["pinhole", "wide lens"])
def test_known_points_of_the_gel_land_where_they_belong(lens):
    gel = np.array([(x, y) for x in (35.0, 100.0, 165.0) for y in (30.0, 75.0, 120.0)])
    ideal_corners = KEYSTONE if lens is None else lens.undistort(np.array(KEYSTONE))
    raw = apply(homography(outer_edges(PAD), ideal_corners), gel)
    if lens is not None:
        raw = lens.distort(raw)
    # A raw spot is round before the homography, so its centroid moves by the curvature of the map
    # over its width: painted small.
    unwarped = prepare_unwarp(RAW, KEYSTONE, PAD, lens)(with_spots(RAW, raw, sigma=1.5))
    found = np.array([centroid_near(unwarped, point, reach=8) for point in gel])
    np.testing.assert_allclose(found, gel, atol=0.05)


@pytest.mark.parametrize("lens", [None, WIDE_LENS], ids=["pinhole", "wide lens"])
def test_the_maps_are_the_exact_projective_map(lens):
    unwarp = prepare_unwarp(RAW, KEYSTONE, PAD, lens)
    ideal_corners = KEYSTONE if lens is None else lens.undistort(np.array(KEYSTONE))
    pixels = np.stack(np.meshgrid(*map(np.arange, PAD)), -1).reshape(-1, 2)
    expected = apply(homography(outer_edges(PAD), ideal_corners), pixels)
    if lens is not None:
        expected = lens.distort(expected)
    found = np.stack([m.ravel() for m in unwarp.maps], 1)
    np.testing.assert_allclose(found, expected, atol=2e-3)


def test_without_a_lens_straight_edges_of_the_pad_stay_straight_and_with_one_they_bend():
    bent = prepare_unwarp(RAW, KEYSTONE, PAD, WIDE_LENS).maps
    straight = prepare_unwarp(RAW, KEYSTONE, PAD).maps
    assert max(np.abs(b - s).max() for b, s in zip(bent, straight, strict=True)) > 3


def test_a_lens_straightens_frames_that_show_the_gel_plane_already():
    width, height = RAW
    ideal = np.array([[80.0, 60.0], [width / 2, height / 2], [250.0, 190.0]])
    frame = with_spots(RAW, WIDE_LENS.distort(ideal), sigma=1.5)
    unwarp = prepare_unwarp(RAW, lens=WIDE_LENS)
    assert unwarp.size_px == RAW
    found = np.array([centroid_near(unwarp(frame), point, reach=8) for point in ideal])
    np.testing.assert_allclose(found, ideal, atol=0.1)


@given(st.integers(1, 12), st.integers(1, 12), st.integers(0, 2**32 - 1))
def test_a_pad_that_fills_the_frame_comes_back_itself(width, height, seed):
    frame = np.random.default_rng(seed).integers(0, 256, (height, width, 3), np.uint8)
    size = (width, height)
    unwarped = prepare_unwarp(size, tuple(outer_edges(size)), size)(frame)
    np.testing.assert_allclose(unwarped, frame / 255, atol=2e-6)
    np.testing.assert_allclose(prepare_unwarp(size)(frame), frame / 255, atol=1e-7)


@pytest.mark.parametrize(
    ("order", "turned"),
    [
        ((1, 2, 3, 0), lambda frame: np.rot90(frame)),
        ((2, 3, 0, 1), lambda frame: np.rot90(frame, 2)),
        ((3, 0, 1, 2), lambda frame: np.rot90(frame, 3)),
        ((1, 0, 3, 2), lambda frame: frame[:, ::-1]),
        ((3, 2, 1, 0), lambda frame: frame[::-1]),
        ((0, 3, 2, 1), lambda frame: frame.transpose(1, 0, 2)),
    ],
    ids=["quarter", "half", "three quarters", "left-right", "up-down", "transposed"],
)
def test_the_order_of_the_corners_turns_and_mirrors_the_picture(order, turned):
    frame = np.random.default_rng(0).integers(0, 256, (9, 14, 3), np.uint8)
    edges = outer_edges((14, 9))
    expected = turned(frame)
    corners = tuple(edges[i] for i in order)
    unwarped = prepare_unwarp((14, 9), corners, expected.shape[1::-1])(frame)
    np.testing.assert_allclose(unwarped, expected / 255, atol=2e-6)


@pytest.mark.parametrize("size", [(5, 4), (40, 37), (300, 250)])
def test_an_even_picture_stays_even_to_the_edges(size):
    frame = np.full((24, 32, 3), 128, np.uint8)
    unwarped = prepare_unwarp((32, 24), tuple(outer_edges((32, 24))), size)(frame)
    np.testing.assert_allclose(unwarped, 128 / 255, atol=1e-6)


def test_values_are_shares_of_full_scale_and_colours_keep_their_place():
    frame = np.zeros((4, 5, 3), np.uint8)
    frame[..., 0], frame[..., 2] = 255, 51
    unwarped = prepare_unwarp((5, 4))(frame)
    assert unwarped.dtype == np.float32
    np.testing.assert_allclose(unwarped[2, 3], [1, 0, 0.2], atol=1e-7)


@pytest.mark.parametrize(
    "frame",
    [np.zeros((240, 320, 3)), np.zeros((240, 320), np.uint8), np.zeros((240, 320, 4), np.uint8)],
)
def test_what_is_no_colours_in_bytes_is_refused(frame):
    unchecked = inspect.unwrap(Unwarp.check)  # the tests' own check of types comes first, else
    with pytest.raises(WedgeError, match=r"\(height, width, 3\) uint8, not \(240, 320"):
        unchecked(prepare_unwarp(RAW), frame)


@pytest.mark.parametrize("corners", [None, KEYSTONE])
def test_a_frame_of_another_size_is_refused(corners):
    unwarp = prepare_unwarp(RAW, corners, PAD if corners else None)
    with pytest.raises(WedgeError, match="the frame is 240x320 pixels, not 320x240"):
        unwarp(np.zeros((320, 240, 3), np.uint8))


@pytest.mark.parametrize(
    "corner", [(-0.51, 5.0), (319.51, 5.0), (320.0, 5.0), (10.0, 239.51), (10.0, -7.0)]
)
def test_a_corner_outside_the_frame_is_refused_by_name(corner):
    with pytest.raises(WedgeError, match=r"corners_px: .* lies outside the 320x240 frame"):
        prepare_unwarp(RAW, (corner, *KEYSTONE[1:]), PAD)


@pytest.mark.parametrize("given", [{"corners_px": KEYSTONE}, {"size_px": PAD}])
@pytest.mark.parametrize("lens", [None, WIDE_LENS])
def test_corners_without_a_size_and_a_size_without_corners_are_refused(given, lens):
    with pytest.raises(WedgeError, match="corners_px and size_px must be given together"):
        prepare_unwarp(RAW, lens=lens, **given)


@pytest.mark.parametrize("corners", [None, KEYSTONE])
def test_a_lens_of_other_frames_is_refused(corners):
    with pytest.raises(WedgeError, match="measured on 320x240 frames, but these are 640x480"):
        prepare_unwarp((640, 480), corners, PAD if corners else None, WIDE_LENS)


@pytest.mark.parametrize("size_px", [(320, 231), (319, 240), (319, 231)])
def test_frames_that_a_video_has_cut_to_even_sizes_are_told_how_to_come_whole(size_px):
    """As OpenCV writes them; what is cut otherwise is another camera's."""
    prepared = prepare_unwarp(size_px)
    for more_x in range(-3, 3):
        for more_y in range(-3, 3):
            width, height = size_px[0] + more_x, size_px[1] + more_y
            if (width, height) == size_px:
                continue
            with pytest.raises(WedgeError, match=f"is {width}x{height} pixels, not ") as told:
                prepared.check(np.zeros((height, width, 3), np.uint8))
            is_cut = (width, height) == (size_px[0] // 2 * 2, size_px[1] // 2 * 2)
            assert ("even sizes, so name a folder" in str(told.value)) == is_cut


@pytest.mark.parametrize("frame", ["press.png", None, [1, 2, 3]])
def test_what_is_no_array_is_refused_by_what_it_is(frame):
    unchecked = inspect.unwrap(Unwarp.check)
    with pytest.raises(WedgeError, match=f"not {type(frame).__name__}: read its file"):
        unchecked(prepare_unwarp(RAW), frame)


def gray(lowest, highest):
    """Noise of which three channels are one."""
    levels = np.random.default_rng(0).integers(lowest, highest + 1, (240, 320, 1), np.uint8)
    return np.repeat(levels, 3, axis=2)


@pytest.mark.parametrize("levels", [(0, 1), (254, 255), (0, 255)])
def test_a_grey_frame_of_three_channels_is_refused(levels):
    with pytest.raises(WedgeError, match="the frame is grey, not in colour"):
        prepare_unwarp(RAW).check_colored(gray(*levels))


@pytest.mark.parametrize("channel", range(3))
@pytest.mark.parametrize("place", [(1, 1), (160, 32)])
def test_one_pixel_that_has_a_colour_makes_a_frame_colored(channel, place):
    frame = gray(50, 200)
    frame[place][channel] += 1
    prepare_unwarp(RAW).check_colored(frame)


@pytest.mark.parametrize("level", [0, 128, 255])
def test_a_dark_or_an_even_frame_is_not_called_grey(level):
    prepare_unwarp(RAW).check_colored(np.full((240, 320, 3), level, np.uint8))


@pytest.mark.parametrize("channel", range(3))
def test_a_single_light_makes_no_frame_grey(channel):
    frame = gray(50, 200)
    frame[..., [k for k in range(3) if k != channel]] = 0
    prepare_unwarp(RAW).check_colored(frame)
