# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""The doubt's table tells a doubt that knows where errors are from one that does not."""

import numpy as np
import pytest

from benchmarks.doubt import on_balls, on_surfaces, told


def test_a_doubt_that_knows_the_errors_ranks_them_and_has_their_size():
    error = np.random.default_rng(0).permutation(np.arange(1, 1001) / 1000)
    row = told("known", [(error[:400], 2 * error[:400]), (error[400:], 2 * error[400:])])
    assert row.count == 2
    assert row.largest_tenth_to_smaller_half == pytest.approx(0.9505 / 0.2505)
    assert row.doubt_to_error == pytest.approx(2)


def test_a_doubt_that_knows_nothing_ranks_nothing():
    rng = np.random.default_rng(0)
    row = told("blind", [(rng.uniform(0, 1, 20000), rng.uniform(0, 1, 20000))])
    assert row.largest_tenth_to_smaller_half == pytest.approx(1, abs=0.1)


@pytest.mark.parametrize("source", [on_balls, on_surfaces])
def test_the_shipped_doubt_is_where_the_error_is(source):
    row = told("some", source(4))
    assert row.count == 4
    assert row.largest_tenth_to_smaller_half > 3
    assert 0.3 < row.doubt_to_error < 4
