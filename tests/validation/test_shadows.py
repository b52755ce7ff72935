# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest

from recon.contact.shadows import cast_shadows
from sensor.design import STANDARD
from simulation.skin import gel_view
from validation.shadows import score_shadows, true_shadows

VIEW = gel_view(STANDARD, 96)
X_MM, Y_MM = VIEW.grid_mm


def plateau():
    """A flat dent with steep sides."""
    return np.clip(0.9 - 1.2 * (np.hypot(X_MM, Y_MM) - 3), 0, 0.9)


def test_no_light_is_blocked_on_the_untouched_skin():
    for shadow in true_shadows(STANDARD, VIEW, np.zeros_like(X_MM)).values():
        assert not shadow.blocked.any() and not shadow.cast.any()


def test_shadows_lie_away_from_their_lights_and_mirror_as_those_do():
    truth = true_shadows(STANDARD, VIEW, plateau())
    assert X_MM[truth["G"].blocked].mean() > 2  # green comes from the base
    assert Y_MM[truth["R"].blocked].mean() < -2
    np.testing.assert_array_equal(truth["R"].blocked, truth["B"].blocked[::-1])
    for shadow in truth.values():
        assert shadow.cast.any() and not shadow.cast[plateau() == 0.9].all()


def test_the_detector_finds_shadows_of_a_known_skin():
    truth = true_shadows(STANDARD, VIEW, plateau())
    lights = {"R": 90.0, "G": 180.0, "B": -90.0}
    dark = np.full((*X_MM.shape, 3), -0.1, np.float32)
    found = cast_shadows(dark, plateau(), lights, VIEW.mm_per_px)
    score = score_shadows("plateau", found, truth)
    assert score.recall > 0.8
    wrong = cast_shadows(dark, plateau(), {"R": -90.0, "G": 0.0, "B": 90.0}, VIEW.mm_per_px)
    assert score_shadows("plateau", wrong, truth).precision < 0.2 < score.precision
    nothing = score_shadows("plateau", np.zeros_like(found), truth)
    assert (nothing.recall, nothing.precision) == (0, pytest.approx(1))
