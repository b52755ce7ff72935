# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Noise and drift of untouched gel are read as they are put in."""

import numpy as np
import pytest

from recon.pixels import BallPress
from validation.acceptance.gel import stillness


def pressed(sigma: float, drift: np.ndarray, seed: int) -> BallPress:
    """White noise and an even drift, in grey levels; the contact itself is another colour."""
    noise = np.random.default_rng(seed).normal(0, sigma, (120, 160, 3))
    difference = (noise + drift) / 255
    difference[55:65, 75:85] += 0.3
    return BallPress(
        file=f"{seed}.png",
        difference=difference.astype(np.float32),
        center_px=(80.0, 60.0),
        contact_radius_px=8.0,
        ball_radius_mm=3.0,
        mm_per_px=(0.1, 0.1),
    )


@pytest.mark.parametrize("blanks", [1, 8])
def test_noise_is_a_frame_s_own_however_many_blank_ones_it_is_held_against(blanks: int) -> None:
    rest = np.sqrt(1 + 1 / blanks)
    found = stillness([pressed(3.0 * rest, np.zeros(3), seed) for seed in range(3)], "RGB", blanks)
    assert found["noise_gray_levels"] == pytest.approx(dict.fromkeys("RGB", 3.0), rel=0.1)
    assert max(found["drift_gray_levels"].values()) < 0.2


def test_drift_is_that_of_the_worst_presses_in_each_colour() -> None:
    drifts = [level * np.array([1.0, -1.0, 0.0]) for level in range(11)]
    found = stillness([pressed(0.1, drift, seed) for seed, drift in enumerate(drifts)], "RGB", 1)
    assert found["drift_gray_levels"] == pytest.approx({"R": 9.0, "G": 9.0, "B": 0.0}, abs=0.1)
