# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""What a touch is at several resolutions: a surface's slopes, heights above still gel, tiles."""

from dataclasses import replace

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.fft import next_fast_len

from benchmarks.touches import SyntheticTouch, pressed
from recon.pose.level import Level
from recon.pose.pyramid import (
    FULL_RESOLUTION_PX,
    Pyramid,
    _mirrored,
    still_window,
)
from recon.pose.registration import pixel_grid_mm
from recon.pose.rigid import applied, motion
from recon.pose.template import TILES, Template, residuals, sums_by_tile
from tests.recon.pose.touched import coarse_bead

FEW, MANY = ((0.11, 0.15), (180, 100)), ((0.04, 0.08), (450, 200))
"""Pitch and size of frames that are read at full resolution, and at half."""


def exact(pitch_mm: tuple[float, float], size_px: tuple[int, int]) -> SyntheticTouch:
    return pressed(coarse_bead(), np.eye(4), None, size_px=size_px, mm_per_px=pitch_mm)


def halved(touch: SyntheticTouch, level: Level) -> np.ndarray:
    """A touch's slopes at the pixels of a level of half its resolution."""
    x_mm, y_mm = pixel_grid_mm(touch.contact.shape[::-1], touch.mm_per_px)
    left, top = np.searchsorted(x_mm, level.x_mm[0]), np.searchsorted(y_mm, level.y_mm[0])
    height, width = level.values.shape[:2]
    found: np.ndarray = touch.gradient[top::2, left::2][:height, :width]
    return found


@pytest.mark.parametrize("frame", [FEW, MANY])
def test_a_level_is_of_all_gel_that_is_held(frame) -> None:
    touch = exact(*frame)
    held = {
        tuple(place)
        for place in np.argwhere(touch.contact[::2, ::2] & (cv2.pyrDown(touch.contact * 1.0) > 0.6))
    }
    level = Pyramid(touch).level(1)
    x_mm, y_mm = pixel_grid_mm(touch.contact.shape[::-1], touch.mm_per_px)
    row, column = np.nonzero(level.values[..., 3])
    left, top = np.searchsorted(x_mm, level.x_mm[0]) // 2, np.searchsorted(y_mm, level.y_mm[0]) // 2
    np.testing.assert_allclose(level.x_mm, x_mm[::2][left : left + len(level.x_mm)], atol=1e-9)
    assert held <= set(zip(row + top, column + left, strict=True))


@pytest.mark.parametrize("frame", [FEW, MANY])
def test_slopes_of_a_surface_lose_nothing(frame) -> None:
    touch = exact(*frame)
    contact_px = np.count_nonzero(touch.contact)
    assert (contact_px < FULL_RESOLUTION_PX) == (frame is FEW)
    level = Pyramid(touch).level(1)
    inside = level.values[..., 3] > 0
    inside[:, 1:-1] &= inside[:, 2:] & inside[:, :-2]
    inside[1:-1] &= inside[2:] & inside[:-2]
    truth = halved(touch, level)
    off = (level.values[..., :2] - truth)[inside]
    assert (np.mean(off**2, 0) < 0.07**2 * np.mean(truth[inside] ** 2, 0)).all()


@given(
    box=st.tuples(*[st.integers(0, 89)] * 2, *[st.integers(1, 60)] * 2),
    size=st.tuples(st.integers(90, 400), st.integers(90, 300)),
)
def test_a_still_window_lies_around_and_its_waves_are_soon_found(box, size) -> None:
    contact = np.zeros(size, bool)
    contact[box[0] : box[0] + box[2], box[1] : box[1] + box[3]] = True
    margin = round(np.sqrt(contact.sum()))
    for span, count, axis in zip(still_window(contact), size, (1, 0), strict=True):
        held = np.flatnonzero(contact.any(axis))
        assert 0 <= span.start <= max(held[0] - margin, 0)
        assert min(held[-1] + margin + 1, count) <= span.stop <= count
        length = span.stop - span.start
        assert length == count or next_fast_len(length // 2) == length / 2


def test_heights_are_above_the_gel_around_and_not_above_a_collar() -> None:
    touch = exact(*FEW)
    collar = np.zeros_like(touch.contact)
    rows, columns = still_window(touch.contact)
    collar[rows, columns][1:-1, 1:-1] = True
    collar &= ~touch.contact
    raised = replace(touch, depth_mm=touch.depth_mm + np.float32(0.2) * collar)
    heights = []
    for item in (touch, raised, replace(touch, depth_mm=touch.depth_mm + np.float32(0.3))):
        values = Pyramid(item).level(1).values
        heights.append(values[values[..., 3] > 0, 2])
    np.testing.assert_allclose(heights[1], heights[0], atol=1e-6)
    np.testing.assert_allclose(heights[2], heights[0], atol=1e-5)


def test_a_contact_that_the_frame_cuts_off_is_not_the_gel_around() -> None:
    (pitch_mm, size_px), aside = FEW, motion(np.array([0, 0, 0, 9.0, 0, 0]))
    touch = pressed(coarse_bead(), aside, None, size_px=size_px, mm_per_px=pitch_mm)
    assert touch.contact[:, -1].any()
    deeper = replace(touch, depth_mm=touch.depth_mm + np.float32(0.2) * touch.contact)
    before, after = (Pyramid(item).level(1).values for item in (touch, deeper))
    inside = before[..., 3] > 0
    np.testing.assert_allclose((after - before)[inside, 2], 0.2, atol=1e-5)


def plane(points_mm: tuple[np.ndarray, np.ndarray], normal: np.ndarray, at: np.ndarray) -> Level:
    """All over a frame, through a point."""
    x, y = np.meshgrid(*points_mm)
    slopes, ones = normal[:2] / normal[2], np.ones_like(x)
    depth = (x - at[0]) * slopes[0] + (y - at[1]) * slopes[1] - at[2]
    values = np.dstack([slopes[0] * ones, slopes[1] * ones, depth, ones]).astype(np.float32)
    return Level(values=values, samples=values, x_mm=points_mm[0], y_mm=points_mm[1], halvings=1)


def sloped(slopes: np.ndarray) -> Template:
    """Points of a plane through the origin."""
    x, y = (part.reshape(-1) for part in np.meshgrid(*2 * [np.linspace(-3, 3, 20)]))
    return Template(
        points=np.column_stack([x, y, -slopes[0] * x - slopes[1] * y]).astype(np.float32),
        slopes=np.tile(slopes, (len(x), 1)).astype(np.float32),
        change=np.zeros((6, 3, len(x)), np.float32),
        steepness=np.full(len(x), np.sqrt(1 + slopes @ slopes), np.float32),
        noise_change=np.eye(6),
        depth_weight=1.0,
        depth_doubt_mm2=0.0,
    )


@pytest.mark.parametrize("turn", [(0, 0, 0), (0.3, -0.2, 0.5), (-0.6, 0.4, 2)])
def test_what_a_plane_is_off_by_is_told_in_the_reference_s_frame(turn) -> None:
    guess, slopes = motion(np.array([*turn, 0.3, -0.4, 0.2])), np.array([0.7, -0.4])
    deeper = applied(guess, np.array([0, 0, -0.1]))
    level = plane(pixel_grid_mm((81, 61), (0.2, 0.3)), guess[:3, :3] @ [*slopes, 1], deeper)
    residual, both = residuals(sloped(slopes), level, guess)
    assert both.all()
    np.testing.assert_allclose(residual[:2], 0, atol=1e-5)
    np.testing.assert_allclose(residual[2], 0.1, atol=1e-5)


@pytest.mark.parametrize(("angle", "seen"), [(80, True), (100, False), (180, False)])
def test_of_a_side_that_is_turned_away_nothing_is_seen(angle: float, seen: bool) -> None:
    level = plane(pixel_grid_mm((81, 61), (0.2, 0.3)), np.array([0, 0, 1.0]), np.zeros(3))
    guess = motion(np.array([np.radians(angle), 0, 0, 0, 0, 0]))
    assert (residuals(sloped(np.zeros(2)), level, guess)[1] == seen).all()


def test_pixels_of_a_tile_lie_together() -> None:
    pyramid = Pyramid(exact(*FEW))
    template = pyramid.templates[pyramid.finest]
    places = template.points[:, :2]
    widest = np.ptp(places, axis=0) / TILES * 1.001
    assert 0.75 * TILES**2 < len(np.unique(template.tiles)) <= TILES**2
    for tile in np.unique(template.tiles):
        assert (np.ptp(places[template.tiles == tile], axis=0) <= widest).all()


@pytest.mark.parametrize("axis", [0, 1])
@pytest.mark.parametrize("side", [-1, 1])
def test_a_border_s_points_are_their_own_mirror_images(axis: int, side: int) -> None:
    (pitch_mm, size_px), border = FEW, np.zeros((1, 3))
    border[0, axis] = side * size_px[axis] * pitch_mm[axis] / 2
    points, shares, shape = _mirrored(
        border, np.ones((3, 1, 2)), size_px[::-1], pitch_mm, axis, side
    )
    np.testing.assert_allclose(points, np.zeros((2, 3)), atol=1e-12)
    assert shape[1 - axis] == 2 * size_px[axis] and shape[axis] == size_px[1 - axis]
    # A sum of one depth counts it once, and a slope into the border is none.
    np.testing.assert_allclose(shares.sum(1)[[1 - axis, 2]], np.sqrt(2))
    np.testing.assert_allclose(shares.sum(1)[axis], 0)


@given(seed=st.integers(0, 10_000))
def test_sums_by_tile_are_those_of_each_tiles_pixels(seed: int) -> None:
    rng = np.random.default_rng(seed)
    rows, tile = rng.standard_normal((3, 40)), rng.integers(0, 6, 40)
    sums = sums_by_tile(rows, tile, 7)
    wanted = [rows[:, tile == index].sum(1) for index in range(7)]
    np.testing.assert_allclose(sums, wanted, atol=1e-12)
