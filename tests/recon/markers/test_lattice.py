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


def lattice_px(along_row, along_column, size=9):
    """Places of a grid, jittered by a hundredth of a step, and their cells."""
    rows, columns = np.divmod(np.arange(size * size), size)
    cells = np.stack([rows, columns], 1)
    places = cells @ np.array([along_column, along_row], float)
    jitter_px = 0.01 * np.linalg.norm(along_row)
    return places + np.random.default_rng(0).normal(0, jitter_px, places.shape), cells


@pytest.mark.parametrize("missing", [1, 2])
@pytest.mark.parametrize("first", range(2, 6))
@pytest.mark.parametrize("steps_px", [((20, 0), (0, 20)), ((25, 0), (7, 25)), ((14, 3), (-6, 28))])
def test_lines_without_dots_are_stepped_over_and_counted(steps_px, first, missing):
    places, cells = lattice_px(*steps_px)
    gone = (cells >= first) & (cells < first + missing)
    for kept in (~gone[:, 0], ~gone[:, 1], ~gone.any(1)):
        lattice = grow_lattice(places[kept])
        assert len(lattice.dots) == kept.sum()
        same = lattice.cells - cells[kept][lattice.dots]
        assert (same == same[0]).all()


def test_a_speck_beyond_a_gap_is_not_stepped_onto():
    places, cells = lattice_px((20, 0), (0, 20))
    specks = places[(cells[:, 0] == 8) & (cells[:, 1] % 4 == 1)]
    grid = places[cells[:, 0] < 7]
    lattice = grow_lattice(np.concatenate([grid, specks]))
    assert sorted(lattice.dots) == list(range(len(grid)))


@pytest.mark.parametrize("turn_deg", [0, 12, 45, 90])
@pytest.mark.parametrize("ratio", [1.0, 1.6, 1.8, 2.4, 3.0])
def test_rows_may_be_three_times_as_far_apart_as_the_dots_in_them(ratio, turn_deg):
    angle = np.radians(turn_deg)
    along_row = 12 * np.array([np.cos(angle), np.sin(angle)])
    along_column = 12 * ratio * np.array([-np.sin(angle), np.cos(angle)])
    places, _ = lattice_px(along_row, along_column)
    lattice = grow_lattice(places)
    assert len(lattice.dots) == len(places)
    assert len(np.unique(lattice.cells, axis=0)) == len(places)
    assert lattice.spacing_px == pytest.approx(12, rel=0.02 if ratio >= 1.8 else ratio)


@pytest.mark.parametrize(
    ("rows_px", "is_grid"), [((0, 30), True), ((0, 50), False), ((0, 50, 100), True)]
)
def test_two_lines_far_apart_are_no_grid(rows_px, is_grid):
    points = np.stack(np.meshgrid(20.0 * np.arange(12), rows_px), -1).reshape(-1, 2)
    assert (grow_lattice(points) is not None) == is_grid
