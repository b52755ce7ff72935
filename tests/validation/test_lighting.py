# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""What lights change with the slope is told by the colours that were seen."""

from dataclasses import replace

import numpy as np
import pytest

from tests.validation.importers.test_lights import SIZE_PX, ball_presses
from validation.acceptance.lights import light_response
from validation.drift import _of_light
from validation.importers.lights import measure_lights_deg
from validation.lighting import response_to_slope, seen_contact

HIDDEN = np.zeros(SIZE_PX[::-1], bool)
HIDDEN[::3, ::2] = True


def answers(presses):
    """The response of each colour as drift compares it, press by press."""
    return np.stack([_of_light(presses, "RGB", 1)[f"answer_{c}"].sums for c in "RGB"])


@pytest.mark.parametrize(
    "measure",
    [
        lambda presses: light_response(presses).slopes,
        lambda presses: light_response(presses).contrast,
        lambda presses: list(measure_lights_deg(presses).values()),
        answers,
    ],
    ids=["response", "contrast", "azimuths", "drift"],
)
def test_what_is_filled_in_under_dots_says_nothing_of_the_lights(measure):
    seen = [replace(press, hidden=HIDDEN) for press in ball_presses()]
    filled = [
        replace(press, difference=np.where(HIDDEN[..., None], np.float32(0.4), press.difference))
        for press in seen
    ]
    np.testing.assert_array_equal(measure(filled), measure(seen))


def test_one_press_has_one_response_wherever_it_is_told():
    (press, *_) = (replace(press, hidden=HIDDEN) for press in ball_presses())
    response = response_to_slope(seen_contact(press))
    np.testing.assert_array_equal(light_response([press]).slopes, response)
    np.testing.assert_allclose(
        answers([press])[:, 0], 255 * np.linalg.norm(response, axis=1), rtol=1e-12
    )


def test_a_press_all_under_dots_does_not_count():
    presses = ball_presses()
    whole = light_response(presses[1:])
    none = replace(presses[0], hidden=np.ones_like(HIDDEN))
    beside = light_response([none, *presses[1:]])
    np.testing.assert_array_equal(beside.slopes, whole.slopes)
    np.testing.assert_array_equal(beside.contrast, whole.contrast)
