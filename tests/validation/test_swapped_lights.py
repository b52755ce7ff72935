# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Colours in each other's place: by a unit, by its design, or by nothing but its own presses."""

from dataclasses import replace

import numpy as np
import pytest

from sensor.design import FINGER
from tests.validation.sensors import accepted_on, failed_of, good_set, unit_of
from validation.acceptance.lights import Response, light_values

MIRRORED = {"R": -90.0, "G": 180.0, "B": 90.0}
WEDGE = {"R": 90.0, "G": 180.0, "B": -90.0}


@pytest.mark.parametrize(
    ("lights_deg", "designed_deg", "swapped"),
    [
        ({"R": -92.0, "G": 173.0, "B": 93.0}, None, 0.0),
        ({"R": -92.0, "G": 173.0, "B": 93.0}, WEDGE, 2.0),
        (None, WEDGE, 2.0),
        (WEDGE, {"R": 90.0}, 2.0),
        (None, {"G": 180.0, "B": 90.0}, 0.0),
    ],
)
def test_the_unit_s_lights_and_the_design_s_are_both_asked(lights_deg, designed_deg, swapped):
    radians = np.radians(list(MIRRORED.values()))
    slopes = -np.stack([np.cos(radians), np.sin(radians)], 1)
    seen = Response(slopes=slopes, contrast=np.full(3, 0.1))
    found = light_values(seen, "RGB", lights_deg, True, designed_deg)
    assert found["swapped_lights"] == {"": swapped}


def test_a_mirrored_sensor_fails_by_its_design_and_by_its_own_presses_is_not_judged(tmp_path):
    """Its lights are where those presses show them, whatever they show."""
    learnt = good_set(tmp_path / "taught", 0, lights_deg=MIRRORED)
    today = good_set(tmp_path / "today", 1, lights_deg=MIRRORED)
    unit = unit_of(learnt)
    own = accepted_on(unit, learnt)
    assert "swapped_lights" not in own.values
    assert own.absent["swapped_lights"].startswith("no design says")
    assert accepted_on(unit, today).values["swapped_lights"] == {"": 0.0}
    designed = replace(unit, design=FINGER)
    assert failed_of(accepted_on(designed, today)) == {"swapped_lights"}
    assert "swapped_lights" in failed_of(accepted_on(designed, learnt))
