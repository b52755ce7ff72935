# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Copies in large pages hold the same numbers, and whole pages around them are theirs."""

import numpy as np
import pytest
from numpy.lib.array_utils import byte_bounds

from recon.fast.pages import LEAST_BYTES, PAGE_BYTES, in_large_pages


@pytest.mark.parametrize("shape", [(3, 480, 640), (2, 481, 643), (LEAST_BYTES // 4,)])
def test_a_copy_s_pages_are_its_own(shape: tuple[int, ...]) -> None:
    values = np.random.default_rng(0).normal(size=shape).astype(np.float32)
    copy = in_large_pages(values)
    np.testing.assert_array_equal(copy, values)
    assert copy.flags.carray and isinstance(copy.base, np.ndarray)
    begin, end = byte_bounds(copy)
    first, last = byte_bounds(copy.base)
    assert first <= begin // PAGE_BYTES * PAGE_BYTES
    assert -(-end // PAGE_BYTES) * PAGE_BYTES <= last


def test_small_arrays_stay_where_they_are() -> None:
    small = np.zeros(LEAST_BYTES - 1, np.uint8)
    assert in_large_pages(small) is small
