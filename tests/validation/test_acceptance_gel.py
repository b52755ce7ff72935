# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Where a blank gel is too dark, too bright or too quiet to be judged as it looks."""

import numpy as np
import pytest

from recon.labels.capture import SATURATED_LEVEL
from tests.validation.test_acceptance_values import SHAPE, press_of, response
from validation.acceptance.gel import (
    KNOWN_SLOPE,
    LEAST_NOISE,
    saturation,
    usable_area,
)


@pytest.mark.parametrize(("level", "share"), [(SATURATED_LEVEL, 1.0), (SATURATED_LEVEL - 1, 0.0)])
def test_a_press_is_saturated_from_the_level_that_captures_are_refused_at(level, share):
    blank = np.full(SHAPE, level / 255, np.float32)
    assert saturation([press_of()], blank, "R") == {"R": share}


@pytest.mark.parametrize(("share", "known"), [(0.9, False), (1.1, True)])
def test_where_no_noise_was_measured_rounding_to_gray_levels_is_the_noise(share, known):
    gel, none = np.full(SHAPE, 0.4, np.float32), dict.fromkeys("RG", 0.0)
    least = share * LEAST_NOISE / KNOWN_SLOPE
    answers = response([0.0, 90.0, 0.0], strengths=(least, least, 0.0))
    assert usable_area(gel, answers, none, "xy", "RG").all() == known
