# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Disturbed gel at a quarter of the resolution: by the same thresholds as in pixels."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from recon.contact.disturbed import (
    NOISE_FACTOR,
    SMOOTHING_PX,
    WIDEST_STAINS,
    disturbed_mask,
)
from recon.fast.disturbance import FrameDisturbance
from recon.quarters import in_pixels, in_quarters
from tests.recon.fast.units import planes


@pytest.mark.parametrize("noise", [0.15, 0.25])
def test_in_a_grainy_frame_as_much_change_is_asked_for_as_by_the_reference(noise: float) -> None:
    difference = np.random.default_rng(0).normal(0, noise, (240, 320, 3)).astype(np.float32)
    asked = NOISE_FACTOR * noise / (2 * np.sqrt(np.pi) * SMOOTHING_PX)
    assert asked > WIDEST_STAINS  # so the grain alone decides
    difference[100:140, 60:100] += 0.6 * asked
    difference[100:140, 200:240] += 1.4 * asked
    truth = disturbed_mask(difference)
    mask = in_pixels(FrameDisturbance((320, 240), "RGB")(planes(difference)), (320, 240))
    for found in (truth, mask):
        assert found[105:135, 205:235].mean() > 0.95
        assert not found[:, :190].any()


@given(height=st.integers(1, 30), width=st.integers(1, 30))
def test_each_pixel_is_set_where_its_own_quarter_is(height: int, width: int) -> None:
    rows, columns = np.indices((height, width)) // 4
    quarter = np.random.default_rng(width).random((rows.max() + 1, columns.max() + 1)) < 0.5
    mask = in_pixels(quarter, (width, height))
    np.testing.assert_array_equal(mask, quarter[rows, columns])
    np.testing.assert_array_equal(in_quarters(mask), quarter)
