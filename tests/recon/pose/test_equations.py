# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Equations for a twist: what is known before the touch counts once, and bounds all doubt."""

from dataclasses import replace

import numpy as np
import pytest

from recon.pose.joint import _Equations, _linearized, _small_twist
from recon.pose.pyramid import Pyramid
from recon.pose.rigid import motion
from tests.recon.pose.touched import bead_pair

AWAY = np.array([0.02, -0.03, 0.05, 0.2, -0.1, 0.3])


def equations() -> _Equations:
    first, second, moved = bead_pair(0)
    reference, current = Pyramid(first), Pyramid(second)
    level = min(reference.templates)
    found = _linearized(reference.templates[level], current.level(level), moved)
    assert found is not None
    return found


def test_where_nothing_is_seen_a_step_leads_back_to_where_the_search_began() -> None:
    seen = equations()
    nothing = replace(seen, weight=0 * seen.weight, normal=0 * seen.normal)
    np.testing.assert_allclose(nothing.step(AWAY), -AWAY, atol=1e-9)


def test_where_much_is_seen_it_hardly_matters_where_the_search_began() -> None:
    seen = equations()
    sure = replace(seen, weight=1e6 * seen.weight, normal=1e6 * seen.normal)
    np.testing.assert_allclose(sure.step(AWAY), sure.step(0 * AWAY), atol=1e-4)


@pytest.mark.parametrize("share", [0.0, 1e-3, 1.0, 1e3, 1e9])
def test_no_direction_is_less_certain_than_before_the_touch(share: float) -> None:
    seen = equations()
    found = seen.covariance(pull=share * seen.variance * seen.normal)
    units = np.linalg.inv(seen.template.prior)
    doubts = np.linalg.eigvalsh(units @ found @ units.T)
    assert 0 < doubts[0] and doubts[-1] < 1 + 1e-9
    least = np.linalg.eigvalsh(units @ (found - seen.covariance()) @ units.T)[0]
    assert least > -1e-9  # errors that are alike make nothing surer


def test_a_small_twist_is_that_of_the_motion_from_wherever_it_begins() -> None:
    twist = 1e-4 * AWAY
    for start in (np.eye(4), motion(20 * AWAY), motion(50 * AWAY[::-1])):
        np.testing.assert_allclose(_small_twist(start, start @ motion(twist)), twist, atol=1e-8)
