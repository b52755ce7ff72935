# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Readings between pixels: exact for planes up to the frame's border, zero beyond it."""

import numpy as np
import pytest

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
    found = looked_up(level, points)
    assert 100 < np.count_nonzero(inside) < len(points) - 100
    np.testing.assert_allclose(found[inside], plane_of(points)[inside], atol=1e-5)
    assert not found[~inside].any()


def test_a_mean_inside_a_mask_is_of_what_lies_there() -> None:
    mask = np.zeros((12, 15), np.float32)
    mask[3:8, 4:9] = 1
    values = np.where(mask[..., None] > 0, np.float32([2, -3]), np.float32(1e6))
    found = blurred(values, mask, 1.5)
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
