# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Readings between pixels: as SciPy's splines, exact for planes up to the border, zero beyond."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.ndimage import map_coordinates

from recon.pose.level import Level, blurred, looked_up
from recon.pose.registration import pixel_grid_mm

SIZE_PX, PITCH_MM = (9, 7), (0.1, 0.13)
RIM_PX = {0: 1, 1: 0}
"""Pixels at the border between which a reading has too few neighbours, by halvings."""


def plane_of(points: np.ndarray) -> np.ndarray:
    x, y = points[..., 0], points[..., 1]
    return np.stack([2 + 3 * x - 5 * y, x + y, 7 * y, np.ones_like(x)], -1).astype(np.float32)


@pytest.mark.parametrize("halvings", [0, 1])
def test_a_plane_is_read_as_it_is_up_to_the_border_and_as_zero_beyond(halvings: int) -> None:
    x_mm, y_mm = pixel_grid_mm(SIZE_PX, PITCH_MM)
    values = plane_of(np.stack(np.meshgrid(x_mm, y_mm), -1))
    level = Level(values=values, samples=values, x_mm=x_mm, y_mm=y_mm, halvings=halvings)
    every = np.stack(np.meshgrid(np.arange(-1.95, 11, 0.3), np.arange(-1.95, 9, 0.3)), -1).reshape(
        -1, 2
    )
    places = (every - (np.array(SIZE_PX) - 1) / 2) * PITCH_MM
    points = np.column_stack([places, 0 * places[:, 0]]).astype(np.float32)
    rim = RIM_PX[halvings]
    inside = ((every > rim) & (every < np.array(SIZE_PX) - 1 - rim)).all(1)
    found = looked_up(level, points.T).T
    assert 100 < np.count_nonzero(inside) < len(points) - 100
    np.testing.assert_allclose(found[inside], plane_of(points)[inside], atol=1e-5)
    assert not found[~inside].any()


@pytest.mark.parametrize(("halvings", "order"), [(0, 3), (1, 1), (2, 1)])
@given(seed=st.integers(0, 10_000))
def test_a_map_is_read_as_by_a_spline(halvings: int, order: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    maps = rng.standard_normal((*SIZE_PX[::-1], 4)).astype(np.float32)
    x_mm, y_mm = pixel_grid_mm(SIZE_PX, PITCH_MM)
    level = Level(values=maps, samples=maps, x_mm=x_mm, y_mm=y_mm, halvings=halvings)
    column, row = (rng.uniform(1.01, count - 2.01, 50) for count in SIZE_PX)
    x, y = x_mm[0] + PITCH_MM[0] * column, y_mm[0] + PITCH_MM[1] * row
    found = looked_up(level, np.stack([x, y, 0 * x]).astype(np.float32)).T
    for index, one in enumerate(np.moveaxis(maps, -1, 0)):
        wanted = map_coordinates(one, [row, column], order=order, prefilter=False)
        np.testing.assert_allclose(found[:, index], wanted, atol=1e-4)


@pytest.mark.parametrize("place", [-1e6, 1e6])
@pytest.mark.parametrize("halvings", [0, 1])
def test_a_point_far_away_reads_nothing(place: float, halvings: int) -> None:
    x_mm, y_mm = pixel_grid_mm(SIZE_PX, PITCH_MM)
    ones = np.ones((*SIZE_PX[::-1], 4), np.float32)
    level = Level(values=ones, samples=ones, x_mm=x_mm, y_mm=y_mm, halvings=halvings)
    assert not looked_up(level, np.full((3, 1), place, np.float32)).any()


def test_a_mean_inside_a_mask_is_of_what_lies_there() -> None:
    mask = np.zeros((12, 15), np.float32)
    mask[3:8, 4:9] = 1
    values = np.where(mask[..., None] > 0, np.float32([2, -3]), np.float32(1e6))
    found = np.dstack(blurred(list(np.moveaxis(values, -1, 0)), mask, 1.5))
    np.testing.assert_allclose(found[mask > 0], np.tile([2, -3], (25, 1)), rtol=1e-5)


def test_an_even_bend_is_no_detail_of_a_contact() -> None:
    rows, columns = np.indices((40, 50))
    mask = np.hypot(columns - 24, rows - 20) < 15
    bent = np.dstack([0.01 * columns, -0.01 * rows, 0 * rows, mask]).astype(np.float32)
    fine = bent.copy()
    fine[..., 0] += 0.01 * (columns % 2) * mask
    x_mm, y_mm = pixel_grid_mm((50, 40), PITCH_MM)
    even, textured = (
        Level(values=item, samples=item, x_mm=x_mm, y_mm=y_mm, halvings=0).detail.values
        for item in (bent, fine)
    )
    assert np.abs(even[..., :2]).max() < 0.005 < np.abs(textured[..., 0]).max()
