# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""A grid grows over dots as far as its steps change little by little."""

import numpy as np
import pytest

from recon.markers.lattice import grid_steps, grow_lattice


def test_a_grid_is_followed_whose_steps_grow_to_three_times_their_length():
    columns_px = np.cumsum(10 * 1.1 ** np.arange(13))
    points = np.stack(np.meshgrid(columns_px, 20.0 * np.arange(8)), -1).reshape(-1, 2)
    lattice = grow_lattice(points)
    found = np.zeros((len(points), 2), int)
    found[lattice.dots] = lattice.cells
    assert sorted(lattice.dots) == list(range(len(points)))
    wanted = np.stack(np.divmod(np.arange(len(points)), 13), 1)
    np.testing.assert_array_equal(found - found[0], wanted)


@pytest.mark.parametrize("order", [1, -1])
@pytest.mark.parametrize("turn_deg", [-30, 0, 20])
def test_steps_lead_right_along_a_row_and_down_along_a_column(turn_deg, order):
    angle = np.radians(turn_deg)
    turn = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
    points = 20.0 * np.stack(np.meshgrid(np.arange(6.0), np.arange(5.0)), -1).reshape(-1, 2)
    np.testing.assert_allclose(grid_steps((points @ turn)[::order]), 20 * turn, atol=1e-9)
