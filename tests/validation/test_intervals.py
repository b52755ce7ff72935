# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Intervals over presses hold the truth as often as they say, few presses or many."""

import numpy as np
import pytest
from scipy import stats

from validation.intervals import LEAST_PRESSES, bootstrap_intervals

SETS = 1000
"""Of presses, drawn for each share: it is good to 0.7 %."""


def intervals(errors, pixels):
    """Of the mean over the pixels of all presses, for each column."""
    found = bootstrap_intervals(
        lambda drawn: drawn @ (errors * pixels) / (drawn @ pixels), len(errors), 0
    )
    return np.transpose(found)


@pytest.mark.parametrize("presses", [3, 5, 8, 10, 20, 48])
@pytest.mark.parametrize("sizes", [0.0, 0.5], ids=["of one size", "of all sizes"])
@pytest.mark.parametrize(
    ("scatter", "least"),
    [(None, 0.92), (0.5, 0.91), (1.0, 0.87)],
    ids=["normal", "skewed", "heavily skewed"],
)
def test_intervals_hold_the_mean_nineteen_times_of_twenty(presses, sizes, scatter, least):
    """At any number of presses, and a little less where a rare press errs far more than others."""
    rng = np.random.default_rng(presses)
    shape = presses, SETS
    pixels = rng.lognormal(0, sizes, shape)
    if scatter is None:
        errors, mean = rng.normal(1, 0.25, shape), 1.0
    else:
        errors, mean = rng.lognormal(0, scatter, shape), np.exp(scatter**2 / 2)
    low, high = intervals(np.abs(errors), pixels)
    assert least <= np.mean((low <= mean) & (mean <= high)) <= 0.97
    assert (low > 0).all()


@pytest.mark.parametrize("presses", [3, 5, 8, 48])
def test_an_interval_is_students_on_a_scale_of_ratios(presses):
    errors = np.random.default_rng(presses).gamma(4, 1, (presses, 50))
    low, high = intervals(errors, np.ones_like(errors))
    mean = errors.mean(0)
    assert low * high == pytest.approx(mean**2)
    known = stats.t.ppf(0.975, presses - 1) * stats.sem(errors) / mean
    assert np.log(high / mean) == pytest.approx(known, rel=0.06)


def test_the_same_seed_draws_the_same_presses():
    errors = np.random.default_rng(0).gamma(4, 1, (8, 1))
    ends = [bootstrap_intervals(lambda drawn: drawn @ errors, 8, seed) for seed in (0, 0, 1)]
    assert ends[0] == ends[1] != ends[2]


def test_an_interval_begins_at_zero_only_where_no_press_errs():
    errors = np.array([[0.0, 0.0], [0.0, 0.0], [0.0, 1.0]])
    (never, once) = intervals(errors, np.ones_like(errors)).T.tolist()
    assert never == [0, 0] and 0 < once[0] < 1 / 3 < once[1]


def test_two_presses_tell_too_little():
    """Three intervals of ten would reach beyond ten times the mean, of three presses none."""
    assert [
        bootstrap_intervals(lambda drawn: drawn.sum(1)[:, None], presses, 0) is None
        for presses in range(1, 5)
    ] == [presses < LEAST_PRESSES for presses in range(1, 5)]
    beyond = []
    for presses in (2, 3):
        errors = np.abs(np.random.default_rng(presses).normal(1, 0.25, (presses, SETS)))
        reach = stats.t.ppf(0.975, presses - 1) * stats.sem(errors) / errors.mean(0)
        beyond.append(np.mean(np.exp(reach) > 10))
    assert beyond[0] > 0.25 and beyond[1] < 0.01


def test_draws_that_do_not_tell_are_left_out():
    errors = np.array([1.0, 2.0, 3.0, 4.0])

    def mean(drawn):
        return (drawn @ errors / drawn.sum(1))[:, None]

    def told(drawn):  # nothing by one draw in 256, of the first press alone
        return np.where(drawn[:, :1] > 3, np.nan, mean(drawn))

    (every,), (most,) = (bootstrap_intervals(numbers, 4, 0) for numbers in (mean, told))
    assert every != most == pytest.approx(every, rel=0.02)
