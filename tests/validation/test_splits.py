# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Splits are by press, seeded, and never mix what teaches with what judges."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sensor.errors import WedgeError
from validation.splits import splits


@given(st.integers(5, 200), st.integers(2, 5), st.integers(0, 1000))
def test_every_press_is_judged_once_and_never_by_itself(count, folds, seed):
    parts = splits(count, folds, seed)
    judged = sorted(index for part in parts for index in part.test)
    assert judged == list(range(count))
    for part in parts:
        assert set(part.train) | set(part.test) == set(range(count))
        assert not set(part.train) & set(part.test)
        assert abs(len(part.test) - count / folds) < 1


@given(st.integers(40, 200), st.integers(0, 1000))
def test_the_papers_split_where_there_are_enough_presses(count, seed):
    (part,) = splits(count, 1, seed)
    assert (len(part.train), len(part.test)) == (32, 8)
    assert not set(part.train) & set(part.test)


@given(st.integers(2, 39), st.integers(0, 1000))
def test_four_fifths_where_there_are_fewer(count, seed):
    (part,) = splits(count, 1, seed)
    assert len(part.train) + len(part.test) == count
    assert abs(len(part.train) - 0.8 * count) <= 1
    assert part.test


def test_seed_decides():
    assert splits(48, 1, 3) == splits(48, 1, 3)
    assert splits(48, 1, 3) != splits(48, 1, 4)


@pytest.mark.parametrize("folds", [2, 5])
def test_seed_decides_which_presses_are_judged_together(folds):
    assert splits(40, folds, 0) == splits(40, folds, 0)
    assert splits(40, folds, 0) != splits(40, folds, 1)


@pytest.mark.parametrize(("count", "folds"), [(0, 1), (1, 1), (4, 5), (3, 0), (3, -1)])
def test_too_few_presses_are_refused(count, folds):
    with pytest.raises(WedgeError):
        splits(count, folds, 0)
