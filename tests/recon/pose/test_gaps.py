# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""How large noise is, is known from what a fit leaves."""

from dataclasses import replace

import numpy as np
import pytest

from recon.integration.poisson import integrate
from recon.pose.gaps import gaps_between
from recon.pose.icp import Icp
from recon.pose.noise import pixels
from tests.recon.pose.touched import MM_PER_PX, coarse_bead, touch

DRAWS, NOISE = 150, 0.03


@pytest.mark.parametrize("kind", ["PLANE_ICP", "GICP"])
def test_a_fit_that_takes_a_part_of_the_noise_states_all_of_it(kind):
    cloud = Icp(kind=kind).prepare(touch(coarse_bead(), np.eye(4), None))
    still = gaps_between(cloud, cloud, np.eye(4), gaussian=kind == "GICP", every=3)
    of_one = still.covariance(cloud, cloud, np.array([1.0, 0, 0, 0]))
    place = pixels(still.points, cloud.shape, MM_PER_PX)
    rng, stated = np.random.default_rng(0), []
    for _ in range(DRAWS):
        errors = rng.normal(0, NOISE, (*cloud.shape, 2)).astype(np.float32)
        depth = integrate(errors, MM_PER_PX, "dirichlet")[place]
        gaps = replace(still, gap_mm=still.upright * depth)
        left = replace(gaps, gap_mm=gaps.gap_mm - gaps.change @ gaps.closing())
        stated.append(np.trace(left.covariance(cloud, cloud, None)) / np.trace(of_one))
    assert np.mean(stated) == pytest.approx(NOISE**2, rel=0.2)
