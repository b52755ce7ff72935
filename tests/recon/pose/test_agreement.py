# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""How well a motion accounts for two touches, where it can be told beforehand."""

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.touches import SyntheticTouch
from recon.pose.agreement import agreement
from recon.pose.pyramid import Pyramid
from recon.pose.rigid import motion
from tests.recon.pose.touched import bead_pair


def scaled(touch: SyntheticTouch, by: float) -> SyntheticTouch:
    factor = np.float32(by)
    return replace(touch, gradient=factor * touch.gradient, depth_mm=factor * touch.depth_mm)


def of_flat(steepness: float) -> SyntheticTouch:
    return scaled(bead_pair(0)[0], steepness)


@pytest.mark.parametrize("factor", [0.5, 0.9, 1.0, 1.3, 2.0])
def test_gentle_slopes_that_are_off_by_a_factor_leave_its_square(factor: float) -> None:
    flat = of_flat(0.01)
    found = agreement(Pyramid(flat), Pyramid(scaled(flat, factor)), np.eye(4))
    assert found.explained == pytest.approx(1 - (factor - 1) ** 2, abs=1e-3)
    assert found.alike == pytest.approx(1, abs=1e-4) and found.overlap == 1


def test_a_steep_side_does_not_outweigh_all_others() -> None:
    """Beyond all slopes normals lie in the gel's plane, whatever the slopes are."""
    steep = Pyramid(of_flat(100.0))
    found = agreement(steep, Pyramid(of_flat(200.0)), np.eye(4))
    assert found.explained > 0.99


@pytest.mark.parametrize("cut", [0, 1])
def test_a_part_of_a_contact_has_all_in_common_with_the_whole(cut: int) -> None:
    touch = bead_pair(0)[0]
    column = np.indices(touch.contact.shape)[1]
    part = touch.contact & (column < np.median(column[touch.contact]))
    pair = [Pyramid(touch), Pyramid(touch)]
    pair[cut] = Pyramid(replace(touch, contact=part))
    assert agreement(pair[0], pair[1], np.eye(4)).overlap > 0.95
    aside = motion(np.array([0, 0, 0, 0, 1.5, 0]))
    assert 0.5 < agreement(pair[0], pair[1], aside).overlap < 0.95
