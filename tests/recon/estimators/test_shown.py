# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Which slopes colours show, found from labelled pixels alone."""

import numpy as np
import pytest

from recon.estimators.shown import shown_axes
from recon.lights import unseen_axis
from recon.pixels import Pixels


def lit_from(azimuths_deg, count=2000, seed=0):
    """Pixels of slopes in all directions, each colour of one light and of a little from above."""
    rng = np.random.default_rng(seed)
    gradient = rng.uniform(-0.7, 0.7, (count, 2))
    angles = np.radians(azimuths_deg)
    color = np.zeros((count, 3))
    color[:, : len(angles)] = -0.2 * gradient @ np.stack([np.cos(angles), np.sin(angles)])
    color -= 0.05 * np.square(gradient).sum(1, keepdims=True)
    color += 0.005 * rng.standard_normal(color.shape)
    return Pixels(
        color=color.astype(np.float32),
        position=np.zeros((count, 2), np.float32),
        gradient=gradient.astype(np.float32),
        contact=np.ones(count, bool),
        press=np.zeros(count, np.int32),
        place=np.arange(count, dtype=np.int32),
        hidden=np.zeros(count, bool),
        blank=np.full((count, 3), 0.5, np.float32),
        collar=np.full(count, np.nan, np.float32),
        cap=np.zeros(count, np.float32),
    )


@pytest.mark.parametrize(
    "azimuths_deg",
    [(90,), (-80,), (180,), (90, -90), (96, -85), (0, 175), (90, 180), (90, -90, 180), (-2, -117)],
)
def test_colours_show_the_slopes_that_their_lights_sit_along(azimuths_deg):
    names = "RGB"[: len(azimuths_deg)]
    unseen = unseen_axis(dict(zip(names, map(float, azimuths_deg), strict=True)), names)
    expected = [axis for axis in (0, 1) if "xy"[axis] != unseen]
    assert shown_axes(lit_from(azimuths_deg), list(range(len(azimuths_deg)))) == expected


def test_one_light_across_the_frame_shows_something_of_both():
    assert shown_axes(lit_from((45,)), [0]) == [0, 1]
