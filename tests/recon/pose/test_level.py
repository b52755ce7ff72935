# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Maps read between their pixels: as SciPy's splines read them, and zero where there is no map."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.ndimage import map_coordinates

from recon.pose.level import Level, looked_up

WIDTH, HEIGHT = 23, 17
PITCH_MM = (0.1, 0.13)


def level(maps: np.ndarray, halvings: int) -> Level:
    x_mm, y_mm = (
        pitch * (np.arange(count) - 0.5 * count)
        for pitch, count in zip(PITCH_MM, (WIDTH, HEIGHT), strict=True)
    )
    maps = maps.astype(np.float32)
    return Level(values=maps, samples=maps, x_mm=x_mm, y_mm=y_mm, halvings=halvings)


def points(there: Level, column: np.ndarray, row: np.ndarray) -> np.ndarray:
    x_mm = there.x_mm[0] + PITCH_MM[0] * column
    y_mm = there.y_mm[0] + PITCH_MM[1] * row
    return np.stack([x_mm, y_mm, np.zeros_like(x_mm)], -1).astype(np.float32)


@pytest.mark.parametrize(("halvings", "order"), [(0, 3), (1, 1), (2, 1)])
@given(seed=st.integers(0, 10_000))
def test_a_map_is_read_as_by_a_spline(halvings: int, order: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    maps = rng.standard_normal((HEIGHT, WIDTH, 4))
    column, row = rng.uniform(1.01, WIDTH - 2.01, 50), rng.uniform(1.01, HEIGHT - 2.01, 50)
    there = level(maps, halvings)
    found = looked_up(there, points(there, column, row))
    for index, one in enumerate(np.moveaxis(maps, -1, 0)):
        wanted = map_coordinates(one, [row, column], order=order, prefilter=False)
        np.testing.assert_allclose(found[:, index], wanted, atol=1e-4)


@pytest.mark.parametrize(("halvings", "beyond"), [(0, 1.0), (1, 0.0)])
@pytest.mark.parametrize("axis", [0, 1])
@pytest.mark.parametrize("upper", [False, True])
def test_a_map_ends_where_a_pixel_that_is_weighed_is_missing(
    halvings: int, beyond: float, axis: int, upper: bool
) -> None:
    there, last = level(np.ones((HEIGHT, WIDTH, 4)), halvings), (WIDTH, HEIGHT)[axis] - 1
    middle, end = np.array([8.0, 8.0]), last - beyond if upper else beyond
    for inward, seen in ((0.1, 1.0), (-0.1, 0.0)):
        middle[axis] = end - inward if upper else end + inward
        found = looked_up(there, points(there, middle[:1], middle[1:]))
        np.testing.assert_allclose(found, seen, atol=1e-5)


@pytest.mark.parametrize("place", [-1e6, 1e6])
@pytest.mark.parametrize("halvings", [0, 1])
def test_a_point_far_away_reads_nothing(place: float, halvings: int) -> None:
    there = level(np.ones((HEIGHT, WIDTH, 4)), halvings)
    assert not looked_up(there, np.full((1, 3), place, np.float32)).any()
