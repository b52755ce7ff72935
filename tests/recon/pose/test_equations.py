# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Equations for a twist: what is known before the touch counts once, and bounds all doubt."""

from dataclasses import replace

import numpy as np
import pytest

from recon.pose.equations import Equations, linearized
from recon.pose.joint import _small_twist
from recon.pose.pyramid import Pyramid
from recon.pose.rigid import motion
from recon.pose.template import residuals
from tests.recon.pose.touched import bead_pair

AWAY = np.array([0.02, -0.03, 0.05, 0.2, -0.1, 0.3])


def equations() -> Equations:
    first, second, moved = bead_pair(0)
    reference, current = Pyramid(first), Pyramid(second)
    level = min(reference.templates)
    found = linearized(reference.templates[level], current.level(level), moved)
    assert found is not None
    return found


def test_the_equations_are_sums_over_all_pixels() -> None:
    found = equations()
    change, weight = found.template.change.astype(float), found.weight[[0, 0, 1]].astype(float)
    normal = np.einsum("ikn,kn,jkn->ij", change, weight, change)
    np.testing.assert_allclose(found.normal, normal, atol=1e-4 * np.abs(normal).max())
    pull = np.einsum("ikn,kn,kn->i", change, weight, found.residual)
    scale = np.einsum("ikn,kn,kn->i", np.abs(change), weight, np.abs(found.residual))
    np.testing.assert_allclose(found.pull, pull, atol=1e-5 * scale.max())


def test_a_residual_of_three_deviations_weighs_half() -> None:
    first, second, moved = bead_pair(0)
    half = second.contact & (np.arange(second.contact.shape[1]) < second.contact.shape[1] / 2)
    reference, current = Pyramid(first), Pyramid(replace(second, contact=half))
    index = min(reference.templates)
    template, level = reference.templates[index], current.level(index)
    found = linearized(template, level, moved)
    assert found is not None
    _, seen = residuals(template, level, moved)
    assert 0.3 < seen.mean() < 0.7
    slope = np.hypot(*found.residual[:2])
    assert found.noise == pytest.approx(np.median(slope[seen]) / np.sqrt(2 * np.log(2)), rel=0.1)
    wanted = seen / (1 + (slope / (3 * found.noise)) ** 2)
    np.testing.assert_allclose(found.weight[0], wanted, rtol=1e-4)
    depth = found.weight[1] / found.weight[1].max()
    assert (depth[~seen] == 0).all()
    order = np.argsort(np.abs(found.residual[2][seen]))
    assert (np.diff(depth[seen][order]) <= 1e-6).all()


def test_where_nothing_is_seen_a_step_leads_back_to_where_the_search_began() -> None:
    seen = equations()
    nothing = replace(seen, normal=0 * seen.normal, pull=0 * seen.pull)
    np.testing.assert_allclose(nothing.step(AWAY), -AWAY, atol=1e-9)


def test_where_much_is_seen_it_hardly_matters_where_the_search_began() -> None:
    seen = equations()
    sure = replace(seen, normal=1e6 * seen.normal, pull=1e6 * seen.pull)
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
