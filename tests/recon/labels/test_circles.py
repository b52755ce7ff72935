# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Circles drawn by hand are mended, on shading of known truth."""

import numpy as np
import pytest

from recon.labels import circles
from recon.labels.ball_fit import Near, unexplained
from recon.labels.circles import Circle, refit_circle, refit_circles
from tests.shading import pressed

SIZE_PX = (160, 120)
BALL_PX = 30.0


@pytest.mark.parametrize("contact_px", [12.0, 18.0, 24.0])
@pytest.mark.parametrize("wrong", [(3.0, -2.0, 1.25), (-3.0, 1.0, 0.85), (0.0, 0.0, 1.0)])
def test_a_circle_drawn_wrong_is_mended(
    contact_px: float, wrong: tuple[float, float, float]
) -> None:
    center = (83.3, 55.8)
    shift_x, shift_y, scale = wrong
    difference = pressed(SIZE_PX, center, contact_px, BALL_PX)
    drawn = (center[0] + shift_x, center[1] + shift_y)
    circle = refit_circle(difference, drawn, scale * contact_px, BALL_PX)
    assert np.hypot(*np.subtract(circle.center_px, center)) < 0.5
    assert circle.radius_px == pytest.approx(contact_px, rel=0.03)
    assert circle.quality > 0.7


def test_printed_dots_do_not_move_a_circle() -> None:
    center = (83.3, 55.8)
    difference = pressed(SIZE_PX, center, 20.0, BALL_PX)
    for x in range(10, 160, 20):
        for y in range(8, 120, 20):
            difference[y : y + 3, x : x + 3] = -0.4
            difference[y : y + 3, x + 3 : x + 5] = 0.4
    circle = refit_circle(difference, (85.0, 54.0), 22.0, BALL_PX)
    assert np.hypot(*np.subtract(circle.center_px, center)) < 0.5
    assert circle.radius_px == pytest.approx(20.0, rel=0.03)


def test_a_second_contact_lowers_the_quality() -> None:
    ball = pressed(SIZE_PX, (45.0, 60.0), 15.0, BALL_PX)
    holder = pressed(SIZE_PX, (125.0, 60.0), 15.0, BALL_PX)
    alone = refit_circle(ball, (45.0, 60.0), 15.0, BALL_PX)
    both = refit_circle(ball + holder, (45.0, 60.0), 15.0, BALL_PX)
    assert both.quality < 0.7 * alone.quality
    assert both.radius_px == pytest.approx(alone.radius_px, rel=0.02)


def test_noise_alone_has_no_quality() -> None:
    noise = np.random.default_rng(0).normal(0, 0.02, (120, 160, 3)).astype(np.float32)
    assert refit_circle(noise, (80.0, 60.0), 20.0, BALL_PX).quality < 0.1


def test_a_circle_far_from_the_ball_is_glanced_at_and_takes_nothing_from_the_best(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    difference = pressed(SIZE_PX, (45.0, 60.0), 15.0, BALL_PX)
    right, wrong = (47.0, 58.0, 16.0), (120.0, 60.0, 16.0)
    looks, near = [], circles._pixels_near
    monkeypatch.setattr(circles, "_pixels_near", lambda *of: looks.append(of[1:]) or near(*of))
    together = refit_circles(difference, [wrong, right], BALL_PX)
    assert [(look[0], look[2]) for look in looks] == [
        (wrong[:2], circles.GLANCED),
        (right[:2], circles.GLANCED),
        (right[:2], circles.PIXELS),
    ]
    assert together[1] == refit_circle(difference, right[:2], right[2], BALL_PX)
    assert together[0].quality < 0.1 < 0.7 < together[1].quality
    assert refit_circles(difference, [], BALL_PX) == []


def test_pixels_on_one_line_are_explained_as_far_as_they_tell():
    # Their normals have no part across the line, so some of the colour's terms are zero or alike.
    x = np.linspace(-9.0, 9.0, 60)
    lean = -x / BALL_PX  # of a ball's normal along the line
    color = np.stack([0.5 * lean, 0.2 * lean**2, lean - lean**3])
    near = Near(x_px=x, y_px=np.zeros_like(x), color=color)
    contact = np.array([0.0, 0.0, 12.0, 1.0])
    assert np.abs(unexplained(contact, near, np.ones_like(x), BALL_PX)).max() < 1e-9


@pytest.mark.parametrize(
    ("center", "kept"), [((-3.0, 130.0), (0.0, 119.0)), ((165.0, -1.0), (159.0, 0.0))]
)
def test_a_label_s_centre_lies_on_the_frame(
    center: tuple[float, float], kept: tuple[float, float]
) -> None:
    label = Circle(center_px=center, radius_px=9.0, quality=0.5).label("a.png", SIZE_PX)
    assert label.center_px == kept
