# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""The map of presses leads over the whole pad and says what they leave out."""

import itertools

import numpy as np
import pytest

from recon.coverage import COLUMNS, FAR, ROWS, Coverage

PITCH = (0.1, 0.1)


def led(presses: int) -> Coverage:
    """Presses in the middle of each cell that the map asked for."""
    coverage = Coverage((320, 240), PITCH)
    for _ in range(presses):
        coverage.add(coverage.next_px)
    return coverage


def test_presses_where_the_map_asks_for_them_cover_the_pad_at_any_number() -> None:
    coverage = Coverage((320, 240), PITCH)
    rows: list[int] = []
    columns: list[int] = []
    for _ in range(2 * ROWS * COLUMNS):
        row, column = coverage.next_cell
        rows.append(row)
        columns.append(column)
        coverage.add(coverage.next_px)
    assert (coverage.counts == 2).all()  # so each place is in the cell that was asked for
    assert np.hypot(rows[0] - (ROWS - 1) / 2, columns[0] - (COLUMNS - 1) / 2) < 1  # the middle
    first = set(zip(rows[:5], columns[:5], strict=True))
    assert {(0, 0), (0, COLUMNS - 1), (ROWS - 1, 0), (ROWS - 1, COLUMNS - 1)} <= first
    for count in range(8, 20):  # each half of the pad has its share
        assert abs(np.mean(rows[:count]) - (ROWS - 1) / 2) < 0.35
        assert abs(np.mean(columns[:count]) - (COLUMNS - 1) / 2) < 0.45


@pytest.mark.parametrize("presses", [8, 10, 14, 20, 40])
def test_ten_presses_where_they_were_asked_for_leave_nothing_out(presses: int) -> None:
    assert led(presses).left_out is None
    assert led(presses).gaps_mm.max() < FAR * 32


def test_what_lies_far_from_every_press_is_named() -> None:
    upper = Coverage((320, 240), PITCH)
    for row in range(2):
        for column in range(COLUMNS):
            upper.add(((column + 0.5) * 64, (row + 0.5) * 60))
    assert upper.left_out is not None
    assert upper.left_out.startswith("5 of 20 places of the pad, such as bottom, left (base), lie")
    assert Coverage((320, 240), PITCH).left_out is not None


def test_a_single_place_that_is_left_out_is_named_as_one() -> None:
    most = Coverage((320, 240), PITCH)
    for row, column in itertools.product(range(ROWS), range(COLUMNS)):
        if row < 2 or column > 1:
            most.add(((column + 0.5) * 64, (row + 0.5) * 60))
    assert most.left_out is not None
    assert most.left_out.startswith("1 of 20 places of the pad, bottom, left (base), lies farther")


@pytest.mark.parametrize(
    ("size_px", "mm_per_px"), [((320, 120), (0.1, 0.2)), ((160, 240), (0.2, 0.1))]
)
def test_what_is_left_out_does_not_depend_on_how_oblong_pixels_are(size_px, mm_per_px) -> None:
    even, oblong = Coverage((320, 240), PITCH), Coverage(size_px, mm_per_px)
    for place in np.random.default_rng(0).uniform(0, 1, (40, 2)) * (1, 0.6):
        for coverage in (even, oblong):
            width, height = coverage.size_px
            coverage.add((place[0] * width, place[1] * height))
        assert oblong.left_out == even.left_out and oblong.next_cell == even.next_cell
    assert even.left_out is not None
