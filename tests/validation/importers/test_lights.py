# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Lights are found on shading of known truth, and only where there are some."""

from dataclasses import replace

import numpy as np
import pytest

from recon.pixels import BallPress
from tests.shading import AZIMUTHS_DEG, pressed
from validation.importers.lights import SURE_PRESSES, measure_lights_deg, sure_lights_deg

SIZE_PX = (160, 120)
BALL_PX = 30.0


PLACES_PX = [(40.0, 40.0), (110.0, 50.0), (80.0, 80.0)]


def ball_presses(places: list[tuple[float, float]] = PLACES_PX) -> list[BallPress]:
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


def test_what_many_presses_show_alike_is_sure_and_what_few_show_is_not() -> None:
    presses = ball_presses(PLACES_PX * 2)
    assert len(presses) == SURE_PRESSES
    assert sure_lights_deg(presses) == measure_lights_deg(presses)
    assert not sure_lights_deg(presses[1:])


@pytest.mark.parametrize("spoil", ["weak", "noisy", "at odds"])
def test_of_a_colour_that_is_in_doubt_nothing_is_sure(spoil: str) -> None:
    """One that may be another's light, that hardly answers, or that presses show differently."""
    rng, presses = np.random.default_rng(3), ball_presses(PLACES_PX * 2)
    for index, press in enumerate(presses):
        green = press.difference[..., 1]
        if spoil == "weak":
            green *= 0.2
        elif spoil == "noisy":
            green += 8 * green.std() * rng.standard_normal(green.shape)
        elif index % 2:
            green[:] = press.difference[..., 0]
    assert set(measure_lights_deg(presses)) == set("RGB")
    assert set(sure_lights_deg(presses)) == set("RB")


def test_of_noise_nothing_is_sure() -> None:
    rng = np.random.default_rng(4)
    noise = [
        replace(press, difference=rng.standard_normal(press.difference.shape).astype(np.float32))
        for press in ball_presses(PLACES_PX * 4)
    ]
    assert not sure_lights_deg(noise)
