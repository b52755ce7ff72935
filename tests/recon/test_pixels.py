# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from recon.ball import ball_cap
from recon.pixels import BallPress, join, label_pixels, positions

WIDTH, HEIGHT = 64, 48


def press(x=30.2, y=22.7, radius_px=9.0, ball_mm=1.2, mm_per_px=(0.1, 0.1)):
    """A press whose red and green say where each pixel lies."""
    columns, rows = np.meshgrid(np.arange(WIDTH), np.arange(HEIGHT))
    difference = np.stack([columns, rows, np.zeros_like(rows)], -1).astype(np.float32)
    return BallPress(
        file="press.png",
        difference=difference,
        center_px=(x, y),
        contact_radius_px=radius_px,
        ball_radius_mm=ball_mm,
        mm_per_px=mm_per_px,
    )


presses = st.builds(
    press,
    x=st.floats(0, WIDTH - 1),
    y=st.floats(0, HEIGHT - 1),
    radius_px=st.floats(3, 25),
    ball_mm=st.floats(2.6, 6),
)


def places(pixels):
    return [tuple(place) for place in pixels.color[:, :2].astype(int)]


@given(presses, st.integers(0, 50), st.integers(0, 50))
@settings(max_examples=40)
def test_pixels_are_those_of_the_error_tables_definition(one, index, seed):
    """Counted pixel by pixel, as the definition reads; on a limit itself, rounding decides."""
    radius, (x, y) = one.contact_radius_px, one.center_px
    contact_end = min(radius - 1, 0.9 * one.ball_radius_mm / 0.1)
    others_start = 1.3 * radius
    contact, others = set(), set()
    for row in range(HEIGHT):
        for column in range(WIDTH):
            distance = math.hypot(column - x, row - y)
            assume(min(abs(distance - contact_end), abs(distance - others_start)) > 1e-9)
            if distance < contact_end:
                contact.add((column, row))
            if distance > others_start:
                others.add((column, row))
    pixels = label_pixels(one, index, seed)
    found = places(pixels)
    assert len(set(found)) == len(found)
    assert set(places(pixels[pixels.contact])) == contact
    drawn = set(places(pixels[~pixels.contact]))
    assert drawn <= others and len(drawn) == round(0.05 * len(others))
    assert (pixels.press == index).all()


@pytest.mark.parametrize("mm_per_px", [(0.1, 0.1), (0.1, 0.12)])
def test_contact_has_the_caps_gradient_and_the_rest_none(mm_per_px):
    one = press(mm_per_px=mm_per_px, ball_mm=1.5)
    cap = ball_cap((WIDTH, HEIGHT), one.center_px, one.contact_radius_mm, 1.5, mm_per_px)
    pixels = label_pixels(one, 0, 0)
    columns, rows = np.array(places(pixels)).T
    expected = np.where(pixels.contact[:, None], cap.gradient[rows, columns], 0)
    np.testing.assert_allclose(pixels.gradient, expected, atol=1e-6)
    assert pixels.contact.sum() > 100 and (~pixels.contact).sum() > 50


def test_slopes_end_at_0_9_of_the_balls_radius():
    steep = press(radius_px=9.9, ball_mm=1.0, mm_per_px=(0.1, 0.1))
    contact = label_pixels(steep, 0, 0)
    contact = contact[contact.contact]
    columns, rows = np.array(places(contact)).T
    farthest = np.hypot(columns - 30.2, rows - 22.7).max()
    assert 8.0 < farthest < 9.0  # the rim alone would allow 8.9, the slope 9.0
    fine = label_pixels(press(radius_px=29.9, ball_mm=0.6, mm_per_px=(0.02, 0.02)), 0, 0)
    slopes = np.linalg.norm(fine.gradient[fine.contact], axis=1)
    assert 2.0 < slopes.max() <= 2.07


@given(presses)
@settings(max_examples=25)
def test_no_slope_is_steeper_than_2_07_and_nothing_is_nan(one):
    pixels = label_pixels(one, 0, 0)
    assert np.isfinite(pixels.gradient).all()
    assert (np.linalg.norm(pixels.gradient, axis=1) <= 2.07).all()


def test_the_same_seed_draws_the_same_pixels_and_another_press_or_seed_others():
    def drawn(index, seed):
        pixels = label_pixels(press(), index, seed)
        return set(places(pixels[~pixels.contact]))

    assert drawn(3, 7) == drawn(3, 7)
    assert drawn(3, 7) != drawn(3, 8) and drawn(3, 7) != drawn(4, 7)
    assert drawn(7, 3) != drawn(3, 7)


def test_a_press_that_covers_the_frame_leaves_no_others():
    pixels = label_pixels(press(radius_px=100.0, ball_mm=20.0), 0, 0)
    assert pixels.contact.all() and len(pixels) == WIDTH * HEIGHT


def test_joined_pixels_split_again_by_press():
    parts = [label_pixels(press(x=20.0 + 3 * i), i, 0) for i in range(4)]
    together = join(parts)
    assert len(together) == sum(map(len, parts))
    for index, part in enumerate(parts):
        again = together[together.press == index]
        for name in ("color", "position", "gradient", "contact", "press"):
            np.testing.assert_array_equal(getattr(again, name), getattr(part, name))


@given(st.integers(1, 50), st.integers(1, 50))
def test_positions_run_evenly_from_edge_to_edge(width, height):
    found = positions((width, height))
    assert found.shape == (height, width, 2) and found.dtype == np.float32
    np.testing.assert_allclose(found[:, :, 0] + found[:, ::-1, 0], 0, atol=1e-6)
    np.testing.assert_allclose(found[0, 0], [1 / width - 1, 1 / height - 1], atol=1e-6)
    if width > 1:
        np.testing.assert_allclose(np.diff(found[0, :, 0]), 2 / width, atol=1e-6)


def test_the_contact_radius_in_mm_is_that_of_the_circle_of_equal_area():
    one = press(radius_px=10.0, mm_per_px=(0.1, 0.4))
    assert one.contact_radius_mm == pytest.approx(2.0)
    assert one.size_px == (WIDTH, HEIGHT)


@pytest.mark.parametrize(("mm_per_px", "side_mm"), [((0.1, 0.25), 6.4), ((0.25, 0.1), 4.8)])
def test_the_frames_shorter_side_is_the_one_of_fewer_mm_not_of_fewer_pixels(mm_per_px, side_mm):
    assert press(mm_per_px=mm_per_px).shorter_side_mm == pytest.approx(side_mm)


def test_gel_that_nobody_saw_blank_is_taken_for_gray():
    one = press()
    seen = np.random.default_rng(0).random((HEIGHT, WIDTH, 3)).astype(np.float32)
    known = label_pixels(replace(one, blank=seen), 0, 0)
    columns, rows = np.array(places(known)).T
    np.testing.assert_array_equal(known.blank, seen[rows, columns])
    assert (label_pixels(one, 0, 0).blank == 0.5).all()


def test_how_deep_a_ball_goes_below_its_rim_is_told_in_shares_of_the_shorter_side():
    pixels = label_pixels(press(radius_px=9.0, ball_mm=1.5), 0, 0)  # 0.9, 1.2, 1.5: a right angle
    np.testing.assert_allclose(pixels.cap, (1.5 - 1.2) / 4.8, rtol=1e-6)
