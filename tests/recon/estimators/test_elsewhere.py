# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Balls taught elsewhere on the pad, where the light's answer is known in closed form."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from recon.estimators.elsewhere import (
    CELLS,
    MOST,
    covered_by,
    elsewhere,
    here_and_elsewhere,
    times_elsewhere,
)
from recon.estimators.lesson import FEW
from recon.estimators.shading import Taught, fit_light, fit_shading
from recon.estimators.surroundings import ASPECTS
from recon.pixels import RIM_PX, BallPress, join, label_pixels

LIGHTS = np.array([[0.1, -0.9, 0.1], [0.8, 0.0, -0.8]])
"""How each colour answers the normal's components along x and y."""
PER_PRESS = 300


def even(position):
    return np.full((len(position), 3), 0.5)


def uneven(position):
    """Brighter to the right, blue above."""
    return 0.4 + position @ np.array([[0.1, 0.15, 0.1], [0.0, 0.05, -0.15]])


def color_at(slopes, position, blank, uphill=0.0):
    """A matt gel's change of colour, by ``uphill`` stronger toward the right edge."""
    normal = slopes / np.sqrt(1 + (slopes**2).sum(1, keepdims=True))
    return (normal @ LIGHTS) * (1 + uphill * position[:, :1]) * blank(position)


def balls(blank, presses=10, uphill=0.0, seed=0):
    """Contacts here and there, a quarter of their pixels flat; what lies around, as their colour.

    Each aspect is the colour of the pixel times one number, so that it must move as that does.
    """
    rng = np.random.default_rng(seed)
    press = np.repeat(np.arange(presses, dtype=np.int32), PER_PRESS)
    slopes = rng.uniform(-0.8, 0.8, (len(press), 2)).astype(np.float32)
    slopes[::4] = 0
    middle = rng.uniform(-0.8, 0.8, (presses, 2))[press]
    position = (middle + 0.15 * slopes).astype(np.float32)
    color = color_at(slopes, position, blank, uphill).astype(np.float32)
    taught = Taught(
        color=color,
        position=position,
        slopes=slopes,
        cap=np.zeros(len(press), np.float32),
        press=press,
    )
    around = np.concatenate([share * color for share in shares()], 1).astype(np.float32)
    return taught, around, fit_light(position, blank(position).astype(np.float32))


def shares():
    return np.linspace(-1, 1, ASPECTS)


def moved(taught, around, light, seed=0):
    rng = np.random.default_rng(seed)
    return elsewhere(taught, around, light, fit_shading(taught, light), 1.0, rng)


@given(presses=st.integers(1, 500))
def test_few_presses_are_taught_as_many_and_many_as_they_are(presses):
    times = times_elsewhere(presses)
    assert 0 <= times <= MOST
    assert times == 0 or presses * (1 + times) <= 2 * FEW
    assert times_elsewhere(presses + 1) <= times
    assert times == MOST or presses * (2 + times) > 2 * FEW


def pressed(centers_px, radius_px, seed=0):
    """Pixels of contacts on a pad of 480 x 320."""
    presses = [
        BallPress(
            file=f"{index}.png",
            difference=np.zeros((320, 480, 3), np.float32),
            center_px=center_px,
            contact_radius_px=radius_px,
            ball_radius_mm=100.0,
            mm_per_px=(0.1, 0.1),
        )
        for index, center_px in enumerate(centers_px)
    ]
    return join([label_pixels(press, index, seed) for index, press in enumerate(presses)])


@given(x=st.floats(80, 400), y=st.floats(80, 240), radius_px=st.floats(40, 79))
def test_a_contact_covers_the_cells_that_its_disc_reaches(x, y, radius_px):
    """Of cells a by b a disc dropped at random reaches (pi r^2 + 2 r (a + b)) / (a b) + 1."""
    covered = covered_by(pressed([(x, y)], radius_px)) * CELLS**2
    a, b, r = 480 / CELLS, 320 / CELLS, radius_px - RIM_PX
    reached = (np.pi * r**2 + 2 * r * (a + b)) / (a * b) + 1
    assert 0.84 <= covered / reached <= 1.09


def test_where_contacts_overlap_the_pad_is_covered_once():
    here, there = [(120.0, 160.0)], [(360.0, 160.0)]
    one = covered_by(pressed(here, 70.0))
    assert covered_by(pressed(3 * here, 70.0)) == one
    both = covered_by(pressed(here + there, 70.0))
    assert both == pytest.approx(one + covered_by(pressed(there, 70.0)))
    pixels = pressed(here, 70.0)
    assert covered_by(pixels[~pixels.contact]) == 0


def test_where_the_light_is_the_same_everywhere_only_the_place_changes():
    taught, around, light = balls(even)
    there, around_there = moved(taught, around, light)
    np.testing.assert_allclose(there.color, taught.color, rtol=0, atol=2e-3)
    np.testing.assert_allclose(around_there, around, rtol=0, atol=2e-3)
    assert np.array_equal(there.slopes, taught.slopes)
    assert np.array_equal(there.press, taught.press)
    assert not np.isclose(there.position, taught.position).any(1).any()


@pytest.mark.parametrize("uphill", [0.0, 0.3])
def test_colours_become_those_of_the_place(uphill):
    taught, around, light = balls(uneven, presses=12, uphill=uphill)
    there, around_there = moved(taught, around, light)
    true = color_at(there.slopes, there.position, uneven, uphill)
    off = np.abs(there.color - true).mean()
    assert off < 0.2 * np.abs(taught.color - true).mean()
    true_around = np.concatenate([share * true for share in shares()], 1)
    off_around = np.abs(around_there - true_around).mean()
    assert off_around < 0.2 * np.abs(around - true_around).mean()


@pytest.mark.parametrize("untold", [0.0, 1.0, 2.0])
def test_what_the_model_does_not_explain_of_a_colour_comes_along(untold):
    taught, around, light = balls(even, presses=12)
    own = 0.05 * np.random.default_rng(3).standard_normal(taught.color.shape).astype(np.float32)
    odd = Taught(**{**vars(taught), "color": taught.color + own})
    shading, rng = fit_shading(taught, light), np.random.default_rng(0)
    there, _ = elsewhere(odd, around, light, shading, untold, rng)
    np.testing.assert_allclose(there.color - taught.color, untold * own, rtol=0, atol=5e-3)


def test_each_time_elsewhere_has_its_own_strength():
    taught, around, light = balls(even, presses=12)
    own = 0.05 * np.random.default_rng(3).standard_normal(taught.color.shape).astype(np.float32)
    odd = Taught(**{**vars(taught), "color": taught.color + own})
    shading, strengths = fit_shading(taught, light), np.array([0.0, 2.0])
    every, _ = here_and_elsewhere(odd, around, light, shading, strengths, 0)
    for color, strength in zip(np.split(every.color, 3), (1.0, *strengths), strict=True):
        np.testing.assert_allclose(color - taught.color, strength * own, rtol=0, atol=5e-3)


@given(seed=st.integers(0, 50))
def test_no_pixel_leaves_the_pad_and_no_part_of_it_is_left_out(seed):
    taught, around, light = balls(even, presses=4)
    there, _ = moved(taught, around, light, seed)
    assert np.abs(there.position).max() <= 1
    ninth = ((there.position + 1) * 1.5).astype(int).clip(0, 2) @ [3, 1]
    assert (np.bincount(ninth, minlength=9) > len(ninth) / 18).all()


def test_flat_gel_keeps_its_colour():
    taught, around, light = balls(uneven)
    there, _ = moved(taught, around, light)
    flat = ~taught.slopes.any(1)
    assert not there.color[flat].any()


@pytest.mark.parametrize("channels", [[0], [0, 2], [0, 1, 2]])
def test_one_and_two_colours_move_as_three_do(channels):
    taught, around, light = balls(uneven, presses=12)
    lit = Taught(**{**vars(taught), "color": taught.color[:, channels]})
    columns = [3 * aspect + channel for aspect in range(ASPECTS) for channel in channels]
    there, around_there = moved(lit, around[:, columns], light[:, channels])
    true = color_at(there.slopes, there.position, uneven)[:, channels]
    assert np.abs(there.color - true).mean() < 0.2 * np.abs(lit.color - true).mean()
    assert around_there.shape == (len(around), len(columns))


def test_what_single_presses_have_of_their_own_no_longer_stays_at_their_place():
    taught, around, light = balls(even, presses=40)
    own = 0.05 * np.random.default_rng(3).standard_normal((40, 3))[taught.press]
    odd = Taught(**{**vars(taught), "color": (taught.color + own).astype(np.float32)})

    def at_places(some):
        """How far colours of one place are off on the whole, over an 8 by 8 grid."""
        left = some.color - color_at(some.slopes, some.position, even)
        cell = np.clip(((some.position + 1) * 4).astype(int), 0, 7) @ [8, 1]
        means = [left[cell == k].mean(0) for k in np.unique(cell) if (cell == k).sum() > 30]
        return np.sqrt(np.mean(np.square(means)))

    both, beside = here_and_elsewhere(odd, around, light, fit_shading(odd, light), np.ones(3), 0)
    assert len(both.color) == len(beside) == 4 * len(odd.color)
    assert at_places(both) < 0.9 * at_places(odd)


def test_the_seed_draws_the_places_and_none_elsewhere_leaves_all_as_it_is():
    taught, around, light = balls(uneven)
    told = taught, around, light, fit_shading(taught, light)
    once = np.ones(1)
    first, again, other = (here_and_elsewhere(*told, once, seed)[0].position for seed in (1, 1, 2))
    assert np.array_equal(first, again) and not np.array_equal(first, other)
    same, beside = here_and_elsewhere(*told, np.ones(0), 1)
    assert np.array_equal(same.color, taught.color) and np.array_equal(beside, around)
