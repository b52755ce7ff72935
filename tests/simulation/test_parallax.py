# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""A dent brings the skin nearer: the camera's rays meet it as they would meet thinner gel."""

from dataclasses import replace

import numpy as np
import pytest

from sensor.design import FINGER, STANDARD, Wedge
from simulation.raw_view import follow, pixels_of
from simulation.skin import gel_view

DENT_MM = 0.8


@pytest.mark.parametrize("design", [STANDARD, FINGER])
def test_gel_that_is_dented_all_over_is_seen_as_thinner_gel(design: Wedge) -> None:
    thinner = replace(design.gel, thickness_mm=design.gel.thickness_mm - DENT_MM)
    view = gel_view(design, 80)
    dent_mm = np.full(view.size_px[::-1], DENT_MM)
    half = 0.7 * np.array([design.gel.pad_length_mm, design.gel.pad_width_mm]) / 2
    pixels = pixels_of(design, half * np.array([(-1, -1), (1, -1), (1, 1), (-1, 1), (0.5, 0)]))
    dented = follow(design, pixels, view, dent_mm).point_mm
    wanted = follow(replace(design, gel=thinner), pixels, None, None).point_mm
    np.testing.assert_allclose(dented, wanted, atol=1e-3)
    rest = follow(design, pixels, None, None).point_mm
    assert (np.linalg.norm(dented - rest, axis=1) > 0.05).all()
