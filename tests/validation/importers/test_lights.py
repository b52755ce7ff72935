# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Lights are found on shading of known truth."""

from recon.pixels import BallPress
from tests.shading import AZIMUTHS_DEG, pressed
from validation.importers.lights import measure_lights_deg

SIZE_PX = (160, 120)
BALL_PX = 30.0


def test_lights_are_found_where_they_are() -> None:
    places = [(40.0, 40.0), (110.0, 50.0), (80.0, 80.0)]
    presses = [
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
    for color, azimuth in measure_lights_deg(presses).items():
        assert abs((azimuth - AZIMUTHS_DEG[color] + 180) % 360 - 180) <= 1
