# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Sixteen bits hold unlike neurons: one that looks at few inputs, one whose bias is the most."""

from dataclasses import replace

import numpy as np
import pytest

from recon.estimators import gradient_field
from recon.estimators.mlp import Mlp
from recon.fast import fixed_point
from recon.fast.network import FrameMlp
from tests.recon.fast.units import SLOPE, planes, random_mlp

pytestmark = pytest.mark.skipif(
    not fixed_point.AVAILABLE, reason="this processor lacks the instructions"
)


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
