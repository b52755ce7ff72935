# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""A mean over presses, its interval, and how often one is accused that has not moved."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats

from validation.drift import Number, difference
from validation.report.drift import plain, value


def number(values, counts=None):
    sums = np.asarray(values, float)
    return Number(
        title="t", unit="mm", sums=sums, counts=np.ones_like(sums) if counts is None else counts
    )


def test_the_intervals_are_students_and_welchs():
    rng = np.random.default_rng(0)
    a, b = rng.normal(1, 0.2, 7), rng.normal(1.5, 0.6, 12)
    known = stats.t.interval(0.95, 6, a.mean(), stats.sem(a))
    assert number(a).ci95 == pytest.approx(known)
    welch = stats.ttest_ind(b, a, equal_var=False).confidence_interval(0.99)
    assert difference(number(b), number(a)) == pytest.approx((welch.low, welch.high))


def test_what_cannot_be_negative_is_told_without_a_minus():
    scattered = number([0.001, 0.012, 0.03])
    low, high = scattered.ci95
    assert low == 0 and high == pytest.approx(stats.t.interval(0.95, 2, *moments(scattered))[1])
    bias = replace(scattered, signed=True)
    assert bias.ci95 == pytest.approx(stats.t.interval(0.95, 2, *moments(bias)))
    assert value(scattered).endswith("\n0 to 0.0507") and "\n-0.022 to" in value(bias)


def moments(item):
    return item.sums.mean(), stats.sem(item.sums)


@given(st.floats(-1e9, 1e9))
def test_numbers_are_written_out_and_mean_what_they_say(x):
    text = plain(x)
    assert set(text) <= set("-.0123456789") and float(text) == float(f"{round(x, 6):.3g}")
    assert text != "-0" and plain(x, "+")[0] in "+-"


def test_pixels_weigh_in_the_mean_and_presses_in_its_error():
    weighted = number([10.0, 60.0], np.array([10.0, 20.0]))
    assert weighted.mean == pytest.approx(70 / 30)
    assert number([1.0]).standard_error == np.inf
    assert difference(number([1.0]), number([9.0, 9.1])) == (-np.inf, np.inf)
    assert number([2.0, 2.0]).ci95 is None
    assert number([2.0, 2.0, 2.0]).ci95 == (2.0, 2.0)


def test_one_in_a_hundred_is_accused_where_nothing_moves():
    rng = np.random.default_rng(1)
    drawn = rng.normal(0, 1, (800, 2, 9))
    ends = [difference(number(a), number(b)) for a, b in drawn]
    assert np.mean([low > 0 or high < 0 for low, high in ends]) == pytest.approx(0.01, abs=0.01)
