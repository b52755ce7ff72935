# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Lights are found on shading of known truth, and only where there are some."""

from dataclasses import replace

import numpy as np
import pytest

from recon.pixels import BallPress
from tests.shading import AZIMUTHS_DEG, pressed
from validation.importers.lights import measure_lights_deg

SIZE_PX = (160, 120)
BALL_PX = 30.0


def ball_presses() -> list[BallPress]:
    places = [(40.0, 40.0), (110.0, 50.0), (80.0, 80.0)]
    return [
        BallPress(
            file=f"{seed}.png",
            difference=pressed(SIZE_PX, place, 18.0, BALL_PX, seed=seed),
            center_px=place,
            contact_radius_px=18.0,
            ball_radius_mm=3.0,
            mm_per_px=(0.1, 0.1),
        )
        for seed, place in enumerate(places)
    ]


def test_lights_are_found_where_they_are() -> None:
    found = measure_lights_deg(ball_presses())
    assert set(found) == set("RGB")
    for color, azimuth in found.items():
        assert abs((azimuth - AZIMUTHS_DEG[color] + 180) % 360 - 180) <= 1


@pytest.mark.parametrize("dark", ["G", "B", "GB"])
@pytest.mark.parametrize("noise", [0.0, 0.004, 0.05])
def test_a_colour_that_does_not_answer_to_slopes_has_no_light(dark: str, noise: float) -> None:
    """Neither where it is all even, nor of noise."""
    rng, of_dark = np.random.default_rng(1), ["RGB".index(color) for color in dark]
    presses = []
    for press in ball_presses():
        seen = press.difference.copy()
        seen[..., of_dark] = noise * rng.standard_normal(seen[..., of_dark].shape)
        presses.append(replace(press, difference=seen))
    lit = measure_lights_deg(presses)
    assert set(lit) == set("RGB") - set(dark)
    everywhere = measure_lights_deg(ball_presses())
    assert lit == {color: everywhere[color] for color in lit}


@pytest.mark.parametrize("share", [0.1, 0.3])
def test_a_weak_light_is_one(share: float) -> None:
    presses = ball_presses()
    for press in presses:
        press.difference[..., 1] *= share
    assert set(measure_lights_deg(presses)) == set("RGB")


def test_of_presses_that_show_nothing_no_colour_is_said_to_be_dark() -> None:
    rng = np.random.default_rng(2)
    noise = [
        replace(press, difference=rng.standard_normal(press.difference.shape).astype(np.float32))
        for press in ball_presses()
    ]
    assert set(measure_lights_deg(noise)) == set("RGB")
