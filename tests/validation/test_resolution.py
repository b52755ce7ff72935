# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Threads are told apart until a glove hides them."""

import numpy as np
import pytest

from sensor.design import FINGER
from simulation.dataset import Recipe
from simulation.engine import SCALAR
from validation.resolution import amplitude, repetition


@pytest.mark.parametrize("per_mm", [0.8, 1.7, 3.0])
def test_the_amplitude_of_a_wave_is_found(per_mm: float) -> None:
    x = np.arange(200) * 0.05
    wave = 7 * np.cos(2 * np.pi * per_mm * x + 1)
    signal = np.stack([wave, wave * 0 + 30 - 4 * x + x**2, wave + 5 * x], 1)
    found = amplitude(signal, 0.05, per_mm)
    assert found[0] == pytest.approx(7, rel=0.02)
    assert found[1] < 0.05
    assert found[2] == pytest.approx(7, rel=0.05)


def test_coarse_threads_are_resolved_and_a_thick_glove_hides_them() -> None:
    pytest.importorskip("mitsuba")
    bare, gloved = (
        repetition(
            Recipe(engine=SCALAR, design=FINGER, width_px=80, samples=16, cover_mm=glove), 1.2
        )
        for glove in (0.0, 0.6)
    )
    assert bare.resolved and not gloved.resolved
    assert bare.relief_mm > 5 * gloved.relief_mm
