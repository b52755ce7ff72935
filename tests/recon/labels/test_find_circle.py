# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""A ball is found wherever it touches, and nowhere where it does not."""

import numpy as np
import pytest

from recon.labels.find_circle import find_circle
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


def test_oblong_pixels_and_large_frames_are_the_same_press() -> None:
    difference = pressed(SIZE_PX, (83.3, 55.8), 18.0, BALL_PX)
    stretched = np.repeat(np.repeat(difference, 3, axis=0), 4, axis=1)
    circle = find_circle(stretched, BALL_MM, (0.1 / 4, 0.1 / 3))
    assert circle is not None
    assert circle.center_px[0] == pytest.approx((83.3 + 0.5) * 4 - 0.5, abs=2.5)
    assert circle.center_px[1] == pytest.approx((55.8 + 0.5) * 3 - 0.5, abs=2.0)
    assert circle.radius_px == pytest.approx(18.0 * np.sqrt(12), rel=0.05)


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
