# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""What is kept of one arrangement of dots for the next fills as what is prepared anew."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from recon.markers.elastic import LARGEST_PX, RING_PX, ElasticFill

WIDTH, HEIGHT, PITCH_PX = 72, 54, 18
METHODS = tuple(RING_PX)
CENTERS = [(y, x) for y in range(0, HEIGHT, PITCH_PX) for x in range(0, WIDTH, PITCH_PX)]
ROWS, COLUMNS = np.indices((HEIGHT, WIDTH))
FIELD = np.random.default_rng(0).normal(size=(HEIGHT, WIDTH, 2))


def disc(y, x, radius_px):
    return np.hypot(ROWS - y, COLUMNS - x) < radius_px


@st.composite
def masks(draw):
    """A grid of dots of which some have moved, as far as into each other, and what lies about."""
    hidden = np.zeros((HEIGHT, WIDTH), bool)
    moved = draw(st.dictionaries(st.sampled_from(CENTERS), st.tuples(*[st.integers(-9, 9)] * 2)))
    for y, x in CENTERS:
        down, right = moved.get((y, x), (0, 0))
        hidden |= disc(y + down, x + right, 3.6)
    for y, x, height, width, value in draw(st.lists(st.tuples(*BLOCK), max_size=3)):
        hidden[y : y + height, x : x + width] = value
    return hidden


SIDE = st.integers(1, 30)
BLOCK = (st.integers(0, HEIGHT - 1), st.integers(0, WIDTH - 1), SIDE, SIDE, st.booleans())


@settings(max_examples=40, deadline=None)
@given(sequence=st.lists(masks(), min_size=2, max_size=4), method=st.sampled_from(METHODS))
def test_whatever_came_before_dots_are_filled_as_if_prepared_anew(sequence, method):
    fill = ElasticFill(sequence[0], method, 1.1)
    for hidden in sequence[1:]:
        fill = fill.moved(hidden)
        np.testing.assert_array_equal(fill(FIELD), ElasticFill(hidden, method, 1.1)(FIELD))


@pytest.mark.parametrize("method", METHODS)
def test_a_dot_is_kept_unless_something_changed_within_its_ring(method):
    """Pixels are added beside a dot, nearer and nearer."""
    alone, ring_px = disc(27, 36, 5.5), RING_PX[method]
    fill = ElasticFill(alone | disc(8, 8, 3.0), method, 1.0)
    for away_px in (ring_px + 2, ring_px + 1, ring_px, 1):
        hidden = fill.hidden.copy()
        hidden[27, 36 + 5 + away_px] = True
        kept = set(fill.moved(hidden).dots) & set(fill.dots)
        assert len(kept) == (2 if away_px > ring_px else 1)


def test_what_has_grown_into_tiles_and_back_is_filled_as_ever():
    dots = disc(27, 12, 6.0) | disc(27, 60, 6.0)
    bar = dots | disc(27, 30, 14.0)
    assert bar.sum() > LARGEST_PX
    fill = ElasticFill(dots, "surface", 1.0)
    for hidden in (bar, bar | disc(27, 44, 8.0), bar, dots):
        fill = fill.moved(hidden)
        wanted = ElasticFill(hidden, "surface", 1.0)(FIELD)
        np.testing.assert_array_equal(fill(FIELD), wanted)
    assert fill.moved(dots.copy()) is fill


def test_a_dot_is_not_mistaken_for_a_tile_of_the_same_box():
    """A cross fills a tile's box, and two large areas touch the tile at its corners."""
    hidden = np.zeros((HEIGHT, WIDTH), bool)
    hidden[16:32, 23:25] = hidden[23:25, 16:32] = True
    hidden[:, :14] = hidden[:, 34:48] = True
    for corner in (14, 15, 16, 31, 32, 33):
        hidden[corner, corner] = True
    fill, other = ElasticFill(hidden, "harmonic", 1.0), hidden.copy()
    other[50, 70] = True
    wanted = ElasticFill(other, "harmonic", 1.0)(FIELD)
    np.testing.assert_array_equal(fill.moved(other)(FIELD), wanted)


@pytest.mark.parametrize("method", METHODS)
def test_from_dots_to_nothing_or_all_hidden_and_back(method):
    dots = disc(27, 36, 5.5)
    fill = ElasticFill(dots, method, 1.0)
    for hidden in (np.ones_like(dots), np.zeros_like(dots), dots, np.ones_like(dots)):
        fill = fill.moved(hidden)
        np.testing.assert_array_equal(fill(FIELD), ElasticFill(hidden, method, 1.0)(FIELD))
        np.testing.assert_array_equal(fill(FIELD)[~hidden], FIELD[~hidden])
    assert not fill(FIELD).any()
