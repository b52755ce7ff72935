# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""What lies around a pixel, of patterns whose derivatives are known."""

import numpy as np
import pytest

from recon.estimators.default import prepared_colors
from recon.estimators.surroundings import (
    ASPECTS,
    LEVELS,
    NEAR,
    STEPS,
    columns_around,
    full_size,
    of_other_sizes,
    quartered,
    surroundings,
)

INNER = np.s_[60:-60, 60:-60]


def around(pattern):
    """Of one colour: (h, w, aspect) at full size, the middle of the frame."""
    colors = np.repeat(pattern[..., None], 3, -1).astype(np.float32)
    every = full_size(surroundings(quartered(colors)), colors)
    assert every.shape == (*pattern.shape, 3 * ASPECTS)
    np.testing.assert_array_equal(every[..., 0::3], every[..., 2::3])
    return every[INNER][..., 0::3]


def grid(height=240, width=320):
    y, x = np.mgrid[:height, :width]
    return (x - width / 2) / height, (y - height / 2) / height


def test_of_one_colour_nothing_lies_around():
    assert np.abs(around(np.full((240, 320), 0.3))).max() < 1e-6


def test_a_steady_change_is_told_along_each_axis_and_bends_nowhere():
    x, y = grid()
    found = around(0.5 * x - 0.2 * y)
    expected = [0, 0, 0.5 * NEAR, -0.2 * NEAR, 0, 0]
    np.testing.assert_allclose(found, np.broadcast_to(expected, found.shape), atol=2e-4)


@pytest.mark.parametrize(
    ("pattern", "more_along_x", "twisted"), [(lambda x, y: x**2 - y**2, 4, 0), (np.multiply, 0, 2)]
)
def test_a_saddle_is_told_from_the_same_turned_by_an_eighth(pattern, more_along_x, twisted):
    found = around(pattern(*grid()))
    np.testing.assert_allclose(found[..., 4], more_along_x * NEAR**2, rtol=0.02, atol=1e-5)
    np.testing.assert_allclose(found[..., 5], twisted * NEAR**2, rtol=0.02, atol=1e-5)


def test_a_bump_is_darker_around_and_most_so_widely():
    x, y = grid()
    found = around(np.exp(-(x**2 + y**2) / (2 * 0.05**2)))
    middle = found[found.shape[0] // 2, found.shape[1] // 2]
    assert middle[1] < 2 * middle[0] < 0
    assert np.abs(middle[2:]).max() < 0.01


@pytest.mark.parametrize("size", [0.8, 1.3, 1.8])
def test_an_object_of_another_size_is_foreseen(size):
    def dent(times_as_large):
        x, y = (along / times_as_large for along in grid())
        pattern = 0.4 * x + 0.1 * y + 2 * x**2 - 3 * x * y - y**2
        middle = around(pattern)
        return middle[middle.shape[0] // 2, middle.shape[1] // 2]

    own, larger = dent(1), dent(size)
    foreseen = of_other_sizes(own[None], np.array([size], np.float32))[0]
    exact = [0, 2, 3, 4, 5]  # a bowl's wide level falls by the square, a real contact's by less
    np.testing.assert_allclose(foreseen[exact], larger[exact], rtol=0.02, atol=2e-4)
    least, between, _ = sorted([own, foreseen, larger], key=lambda seen: abs(seen[1]))
    assert between is foreseen and (least is larger) == (size > 1)


def in_the_middle(height, width):
    """What is prepared of a pattern without symmetry, at the pixel where its phase is the same."""
    y, x = np.mgrid[:height, :width]
    y, x = (y - height // 2) / height, (x - width // 2) / height
    pattern = np.sin(9 * x + 1) * np.cos(7 * y + 0.5)
    found = prepared_colors(np.repeat(pattern[..., None], 3, -1).astype(np.float32))
    return found[height // 2, width // 2]


@pytest.mark.parametrize("size", [(120, 160), (240, 320), (480, 640), (239, 311), (320, 320)])
def test_frames_of_any_size_show_the_same(size):
    found, expected = in_the_middle(*size), in_the_middle(960, 1280)
    assert found.shape == (3 * (1 + ASPECTS),)
    first = 3 * (1 + LEVELS)
    told = first + np.flatnonzero(np.abs(expected[first:]) > 0.04)
    assert len(told) == 3 * len(STEPS)  # what changes along x and y
    np.testing.assert_allclose(found[told], expected[told], rtol=0.04)
    # In a small frame the averages are as wide as what is near.
    levels = 0.005 if size[0] >= 200 else 0.03
    np.testing.assert_allclose(found[3:], expected[3:], atol=levels)


def test_the_columns_of_some_colours_are_theirs():
    assert columns_around([0, 1, 2]) == list(range(3, 3 * (1 + ASPECTS)))
    assert columns_around([0, 2])[:4] == [3, 5, 6, 8]
