# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""The pad's corners are found in drawn frames and in the twin's raw view, the right way round."""

import cv2
import numpy as np
import pytest

from recon.geometry.pad import SIDES, base_side, find_pad, gel_corners
from sensor.design import FINGER, STANDARD, Wedge
from simulation.raw_view import pad_corners_px, raw_frame
from simulation.skin import gel_view

TRAPEZOID = np.array([(33.4, 58.2), (208.7, 61.5), (185.2, 250.6), (56.1, 248.9)])
FINE = 8


def drawn(corners: np.ndarray, size: tuple[int, int] = (240, 320), seed: int = 0) -> np.ndarray:
    """A lit pad with dots and round corners, a strip of direct view, and noise."""
    image = np.full((size[1], size[0]), 12.0)
    direct = np.array([(30, size[1] - 30), (size[0] - 30, size[1] - 30), (size[0], size[1])])
    cv2.fillConvexPoly(image, np.vstack([direct, [(0, size[1])]]).astype(np.int32), 120.0)
    big = np.zeros((size[1] * FINE, size[0] * FINE), np.uint8)
    cv2.fillConvexPoly(big, ((corners + 0.5) * FINE).round().astype(np.int32), 255)
    kernel = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (8 * FINE + 1, 8 * FINE + 1))
    big = cv2.morphologyEx(big, cv2.MORPH_OPEN, kernel)
    share = cv2.resize(big, size, interpolation=cv2.INTER_AREA) / 255
    y, _ = np.mgrid[: size[1], : size[0]]
    image = (1 - share) * image + share * (130 + 60 * y / size[1])
    for x in range(60, 190, 16):
        for row in range(80, 240, 16):
            cv2.circle(image, (x, row), 3, 25.0, -1)
    image = image + np.random.default_rng(seed).normal(0, 3, image.shape)
    return np.repeat(np.clip(image, 0, 255).astype(np.uint8)[..., None], 3, -1)


@pytest.mark.parametrize("turns", range(4))
def test_corners_are_found_beneath_their_rounding(turns: int) -> None:
    found = find_pad(np.ascontiguousarray(np.rot90(drawn(TRAPEZOID), -turns)))
    wanted = TRAPEZOID
    for turn in range(turns):  # a quarter turn clockwise: x becomes height - 1 - y
        height = (320, 240)[turn % 2]
        wanted = np.stack([height - 1 - wanted[:, 1], wanted[:, 0]], 1)
    assert found is not None
    away = np.linalg.norm(np.array(found)[:, None] - wanted, axis=2)
    assert away.min(1).max() < 0.6
    assert base_side(found) == SIDES[turns]  # the longer side was above
    first, second, third, fourth = gel_corners(found, base_side(found))
    left = np.linalg.norm(np.subtract(first, fourth))
    assert left > np.linalg.norm(np.subtract(second, third))


@pytest.mark.parametrize("times", [4, 8])
def test_a_camera_of_more_pixels_gives_the_same_corners(times: int) -> None:
    size = (240 * times, 320 * times)
    found = find_pad(cv2.resize(drawn(TRAPEZOID), size, interpolation=cv2.INTER_LINEAR))
    assert found is not None
    corners = (np.array(found) + 0.5) / times - 0.5
    assert np.linalg.norm(corners - TRAPEZOID, axis=1).max() < 0.6


@pytest.mark.parametrize("baffle", [True, False])  # without it, the gel is seen twice
@pytest.mark.parametrize("design", [STANDARD, FINGER])
def test_the_twins_raw_view_gives_the_corners_that_it_was_rendered_with(
    design: Wedge, baffle: bool
) -> None:
    view = gel_view(design, 160)
    shape = view.grid_mm[0].shape
    lit, rest = np.ones((*shape, 3), np.float32), np.zeros(shape)
    raw = raw_frame(design, view, lit, rest, baffle=baffle)
    frame = np.clip(raw * 160 + 5, 0, 255).astype(np.uint8)
    found = find_pad(frame)
    assert found is not None
    corners = gel_corners(found, base_side(found))
    away = np.linalg.norm(np.subtract(corners, pad_corners_px(design)), axis=1)
    assert away.max() < 0.02 * max(frame.shape[:2])


@pytest.mark.parametrize("level", [0, 128])
def test_an_even_frame_has_no_pad(level: int) -> None:
    assert find_pad(np.full((120, 160, 3), level, np.uint8)) is None


@pytest.mark.parametrize("azimuth_deg", [0, 60, 150])
@pytest.mark.parametrize("dark", [(), (0,), (1, 2), (0, 2)])
def test_the_shading_of_frames_that_show_the_gel_plane_has_no_pad(
    azimuth_deg: float, dark: tuple[int, ...]
) -> None:
    """A light brightens its side of the gel, and a level cuts a four-sided area out of that."""
    y, x = np.mgrid[-1:1:240j, -1:1:320j]
    frame = np.zeros((240, 320, 3))
    for color in range(3):
        angle = np.radians(azimuth_deg + 120 * color)
        at = np.clip(1.6 - np.hypot(x - 0.4 * np.cos(angle), y - 0.4 * np.sin(angle)), 0, None)
        frame[..., color] = 40 + 100 * at * np.clip(1.5 - 0.8 * np.abs(x), 0, 1)
    frame[..., list(dark)] = 0
    frame += np.random.default_rng(0).normal(0, 1, frame.shape)
    assert find_pad(np.clip(frame, 0, 255).astype(np.uint8)) is None


def test_a_mirror_turns_the_order_round() -> None:
    clockwise = ((0.0, 0.0), (9.0, 0.0), (9.0, 6.0), (0.0, 6.0))
    assert gel_corners(clockwise, "left") == (
        clockwise[3],
        clockwise[2],
        clockwise[1],
        clockwise[0],
    )
