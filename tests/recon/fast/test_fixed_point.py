# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Sixteen bits hold unlike neurons: one that looks at few inputs, one whose bias is the most."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from recon.estimators import gradient_field
from recon.estimators.mlp import Mlp
from recon.fast import fixed_point
from recon.fast.network import FrameMlp
from tests.recon.fast.units import SLOPE, planes, random_mlp

pytestmark = pytest.mark.skipif(
    not fixed_point.AVAILABLE, reason="this processor lacks the instructions"
)


@given(seed=st.integers(0, 99), alike=st.integers(1, 16))
def test_rounded_weights_sum_up_what_they_were_shown(seed: int, alike: int) -> None:
    random = np.random.default_rng(seed)
    seen = np.tanh(random.normal(size=(400, 32)) + random.normal(size=32))
    seen[:, :alike] = seen[:, :1]  # inputs that say the same
    weights = random.uniform(-9, 9, (32, 32))
    whole, left = fixed_point.rounded(weights, seen)

    def off(found: np.ndarray, constant: np.ndarray) -> float:
        return float(np.square(seen @ (found - weights) + constant).mean())

    np.testing.assert_array_equal(whole, np.rint(whole))
    assert np.abs(whole - weights).max() < 3
    each_alone = np.rint(weights)
    assert off(whole, left) < off(each_alone, (seen @ (weights - each_alone)).mean(0))


def error_of(network: Mlp) -> float:
    difference = np.random.default_rng(0).normal(0, 0.1, (8, 64, 3)).astype(np.float32)
    out = np.full((2, 8, 64), np.nan, np.float32)
    FrameMlp(network, (64, 8), in_words=True)(planes(difference), out)
    return float(np.abs(np.moveaxis(out, 0, -1) - gradient_field(network, difference)).max())


def test_a_neuron_s_few_weights_are_as_exact_as_another_s_many() -> None:
    network = random_mlp()
    layers = tuple((weight.copy(), bias) for weight, bias in network.layers)
    for weight, _ in layers[1:]:
        weight[4:, 0] = 0
    assert error_of(replace(network, layers=layers)) < 2 * SLOPE


def test_a_bias_that_is_more_than_all_weights_overflows_no_sum() -> None:
    network = random_mlp()
    first, *hidden, last = network.layers
    weak = [(np.float32(0.01) * weight, bias) for weight, bias in hidden]
    assert error_of(replace(network, layers=(first, *weak, last))) < 2 * SLOPE
