# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""A ball is found wherever it touches, and nowhere where it does not."""

import numpy as np
import pytest

from recon.labels.circles import Circle
from recon.labels.find_circle import (
    DOUBTFUL,
    LEAST_BALL_PX,
    MOST_BALL,
    _likeliest,
    find_circle,
)
from recon.labels.outline import Outline
from sensor.errors import WedgeError
from tests.shading import pressed

SIZE_PX = (160, 120)
BALL_MM, MM_PER_PX = 3.0, (0.1, 0.1)
BALL_PX = 30.0


@pytest.mark.parametrize(
    ("center", "contact_px"),
    [((83.3, 55.8), 18.0), ((30.2, 90.4), 12.0), ((120.0, 40.0), 24.0), ((8.0, 60.0), 20.0)],
)
def test_a_ball_is_found_wherever_it_touches(
    center: tuple[float, float], contact_px: float
) -> None:
    circle = find_circle(pressed(SIZE_PX, center, contact_px, BALL_PX), BALL_MM, MM_PER_PX)
    assert circle is not None
    assert np.hypot(*np.subtract(circle.center_px, center)) < 0.6
    assert circle.radius_px == pytest.approx(contact_px, rel=0.05)
    assert circle.quality > 0.6


@pytest.mark.parametrize("center", [(-11.3, 60.0), (80.0, -11.3), (170.3, 60.0), (80.0, 130.3)])
def test_a_ball_beyond_the_edge_is_not_found_beside_it(center: tuple[float, float]) -> None:
    difference = pressed(SIZE_PX, center, 18.0, BALL_PX)
    assert find_circle(difference, BALL_MM, MM_PER_PX) is None


@pytest.mark.parametrize(
    ("center", "is_certain"),
    [((0.0, 60.0), True), ((9.0, 60.0), True), ((2.0, 2.0), False), ((157.0, 5.0), False)],
)
def test_a_circle_of_which_less_than_half_shows_is_doubtful(
    center: tuple[float, float], is_certain: bool
) -> None:
    circle = find_circle(pressed(SIZE_PX, center, 18.0, BALL_PX), BALL_MM, MM_PER_PX)
    assert circle is not None
    assert (circle.quality >= DOUBTFUL) == is_certain


@pytest.mark.parametrize(("strength", "is_certain"), [(0.0, True), (0.05, True), (0.6, False)])
def test_a_circle_beside_a_stronger_change_is_doubtful(strength: float, is_certain: bool) -> None:
    difference = pressed(SIZE_PX, (60.0, 60.0), 18.0, BALL_PX)
    difference[28:33, 128:133] += strength
    circle = find_circle(difference, BALL_MM, MM_PER_PX)
    assert circle is not None
    assert (circle.quality >= DOUBTFUL) == is_certain


@pytest.mark.parametrize(("shift", "is_certain"), [(0.0, True), (0.2, True), (0.5, False)])
def test_a_circle_whose_outline_lies_elsewhere_is_doubtful(
    shift: float, is_certain: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    difference = pressed(SIZE_PX, (83.3, 55.8), 18.0, BALL_PX)
    outline = Outline(center_px=(83.3 + shift * 18.0, 55.8), spread=0.0)
    monkeypatch.setattr("recon.labels.find_circle.outline_of", lambda *_: outline)
    circle = find_circle(difference, BALL_MM, MM_PER_PX)
    assert circle is not None
    assert (circle.quality >= DOUBTFUL) == is_certain


def test_oblong_pixels_and_large_frames_are_the_same_press() -> None:
    difference = pressed(SIZE_PX, (83.3, 55.8), 18.0, BALL_PX)
    stretched = np.repeat(np.repeat(difference, 3, axis=0), 4, axis=1)
    circle = find_circle(stretched, BALL_MM, (0.1 / 4, 0.1 / 3))
    assert circle is not None
    assert circle.center_px[0] == pytest.approx((83.3 + 0.5) * 4 - 0.5, abs=2.5)
    assert circle.center_px[1] == pytest.approx((55.8 + 0.5) * 3 - 0.5, abs=2.0)
    assert circle.radius_px == pytest.approx(18.0 * np.sqrt(12), rel=0.05)


@pytest.mark.parametrize("times", [(3, 1), (1, 3)])
def test_pixels_that_are_repeated_are_the_same_picture(times: tuple[int, int]) -> None:
    """The edge of the frame stays where it is: a pixel's middle moves to that of its copies."""
    difference = pressed(SIZE_PX, (83.3, 55.8), 18.0, BALL_PX)
    wide, high = times
    repeated = np.repeat(np.repeat(difference, high, axis=0), wide, axis=1)
    one = find_circle(difference, BALL_MM, MM_PER_PX)
    other = find_circle(repeated, BALL_MM, (0.1 / wide, 0.1 / high))
    assert one is not None and other is not None
    x, y = one.center_px
    wanted = ((x + 0.5) * wide - 0.5, (y + 0.5) * high - 0.5)
    assert other.center_px == pytest.approx(wanted, abs=0.05)


@pytest.mark.parametrize("seed", range(4))
def test_no_ball_is_found_on_a_blank_gel(seed: int) -> None:
    rng = np.random.default_rng(seed)
    noise = rng.normal(0, 0.02, (120, 160, 3)).astype(np.float32)
    drift = np.linspace(0, 0.02, 160, dtype=np.float32)[None, :, None]  # a lamp grows warm
    assert find_circle(noise + drift, BALL_MM, MM_PER_PX) is None


def test_a_straight_edge_is_told_from_a_ball() -> None:
    ball = find_circle(pressed(SIZE_PX, (80.0, 60.0), 18.0, BALL_PX), BALL_MM, MM_PER_PX)
    bar = np.random.default_rng(0).normal(0, 0.01, (120, 160, 3)).astype(np.float32)
    bar[40:46, 20:140] += (0.3, 0.0, -0.3)
    bar[70:76, 20:140] += (-0.3, 0.0, 0.3)
    circle = find_circle(bar, BALL_MM, MM_PER_PX)
    assert ball is not None
    assert circle is None or circle.quality < 0.7 * ball.quality


@pytest.mark.parametrize("times", [0.01, 0.3, 0.99, 1.01])
@pytest.mark.parametrize("mm_per_px", [0.1, 1e-4, 25.4])
def test_a_ball_too_small_for_the_frame_is_refused_at_any_scale(
    times: float, mm_per_px: float
) -> None:
    difference, scale = pressed(SIZE_PX, (80.0, 60.0), 18.0, BALL_PX), (mm_per_px, mm_per_px)
    radius_mm = times * LEAST_BALL_PX * mm_per_px
    if times > 1:
        find_circle(difference, radius_mm, scale)
    else:
        with pytest.raises(WedgeError, match="in metres"):
            find_circle(difference, radius_mm, scale)


def test_the_largest_ball_is_searched_for_and_a_larger_one_refused() -> None:
    difference, width_mm = pressed(SIZE_PX, (80.0, 60.0), 18.0, BALL_PX), SIZE_PX[0] * 0.1
    find_circle(difference, MOST_BALL * width_mm, MM_PER_PX)
    with pytest.raises(WedgeError, match=r"times as long as the frames, 16 mm at 0\.1 mm/px"):
        find_circle(difference, 1.01 * MOST_BALL * width_mm, MM_PER_PX)


@pytest.mark.parametrize(("quality", "chosen"), [(0.9005, 0), (0.91, 1)])
def test_of_circles_that_explain_as_much_the_narrowest_is_taken(quality, chosen):
    circles = [
        Circle(center_px=(80.0, 60.0), radius_px=12.0, quality=0.9),
        Circle(center_px=(80.0, 50.0), radius_px=18.0, quality=quality),
        Circle(center_px=(40.0, 60.0), radius_px=6.0, quality=0.5),
    ]
    assert _likeliest(circles) is circles[chosen]
    assert _likeliest([]) is None
