# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""The quick median is the median, of whatever numbers in whatever order."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from recon.medians import FEW, channel_medians, median, sample_size

FLOATS = st.floats(-1e3, 1e3, width=32)


@given(arrays(np.float32, st.integers(1, 60), elements=FLOATS))
def test_of_few_numbers(values: np.ndarray) -> None:
    assert median(values) == pytest.approx(np.median(values.astype(float)))


@settings(max_examples=40, deadline=None)
@given(
    seed=st.integers(0, 2**32 - 1),
    count=st.integers(FEW // 2, 24 * FEW),
    steps=st.sampled_from([None, 1, 8, 200]),
    order=st.sampled_from(["shuffled", "rising", "periodic"]),
)
def test_of_many_numbers(seed: int, count: int, steps: int | None, order: str) -> None:
    # Where every n-th number is unlike the others, the sample's bracket misses.
    values = np.random.default_rng(seed).normal(size=count)
    if steps:
        values = np.round(values * steps) / steps
    if order == "rising":
        values.sort()
    if order == "periodic":
        values[:: count // sample_size(count)] += 9
    assert median(values) == np.median(values)


@pytest.mark.parametrize("share", [1 / 5, 1 / 2])
def test_of_many_of_which_the_sample_sees_one_value_alone(share: float) -> None:
    values = np.arange(10 * FEW, dtype=np.float32)
    seen = values % (values.size // sample_size(values.size)) == 0
    values[np.argsort(~seen, kind="stable")[: round(share * values.size)]] = -7
    assert (values[seen] == -7).all()
    assert median(values) == np.median(values)


def test_of_none_it_is_zero() -> None:
    assert median(np.zeros((0, 3))) == 0


def test_of_an_image_it_is_that_of_all_its_pixels() -> None:
    image = np.random.default_rng(0).normal(size=(90, 120, 3))
    assert median(image[:, ::2]) == np.median(image[:, ::2])


def test_of_each_colour() -> None:
    image = np.random.default_rng(0).normal([0, 5, -3], size=(50, 60, 3)).astype(np.float32)
    assert channel_medians(image) == pytest.approx(np.median(image, (0, 1)), abs=1e-6)
