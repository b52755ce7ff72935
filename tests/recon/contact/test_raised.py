# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""A bump is told from a dent by where the lights are."""

import numpy as np
import pytest

from recon.contact.disturbed import disturbed_mask
from recon.contact.raised import is_raised
from tests.shading import AZIMUTHS_DEG, pressed

SIZE_PX, RADIUS_PX = (160, 120), 18.0


def disc(center_px: tuple[float, float]) -> np.ndarray:
    y, x = np.indices(SIZE_PX[::-1])
    return np.hypot(x - center_px[0], y - center_px[1]) < RADIUS_PX


@pytest.mark.parametrize("center_px", [(80.0, 60.0), (6.0, 60.0), (150.0, 112.0)])
@pytest.mark.parametrize("colors", ["RGB", "RB", "GR", "R", "G", "B"])
def test_a_bump_is_told_from_a_dent_by_any_light(
    colors: str, center_px: tuple[float, float]
) -> None:
    lights_deg = {color: AZIMUTHS_DEG[color] for color in colors}
    dent = pressed(SIZE_PX, center_px, RADIUS_PX, 30.0)
    for where in (disc(center_px), disturbed_mask(dent)):
        for darker in (0.0, 0.3):  # all over, as of light that changed
            assert not is_raised(dent - np.float32(darker), where, lights_deg)
            assert is_raised(-dent - np.float32(darker), where, lights_deg)


def test_noise_and_nothing_are_no_bump() -> None:
    noise = np.random.default_rng(0).normal(0, 0.01, (*SIZE_PX[::-1], 3)).astype(np.float32)
    assert not is_raised(noise, disc((80.0, 60.0)), AZIMUTHS_DEG)
    assert not is_raised(0 * noise, disc((80.0, 60.0)), AZIMUTHS_DEG)
