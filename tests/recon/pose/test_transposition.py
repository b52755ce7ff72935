# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""No axis counts for more than the other: x and y changed for each other, all is so changed."""

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.touches import SyntheticTouch, pressed
from recon.pose.joint import Joint
from recon.pose.pyramid import Pyramid
from recon.pose.rigid import motion
from tests.recon.pose.touched import coarse_bead

PITCH_MM, SIZE_PX = (0.11, 0.15), (180, 100)
SWAP = np.eye(4)[[1, 0, 2, 3]]
OF_TWISTS = np.zeros((6, 6))
OF_TWISTS[:3, :3], OF_TWISTS[3:, 3:] = -SWAP[:3, :3], SWAP[:3, :3]
"""A mirror image turns the other way."""


def seen(pose: np.ndarray, seed: int) -> SyntheticTouch:
    rng = np.random.default_rng(seed)
    return pressed(coarse_bead(), pose, rng, size_px=SIZE_PX, mm_per_px=PITCH_MM)


def transposed(touch: SyntheticTouch) -> SyntheticTouch:
    return replace(
        touch,
        gradient=touch.gradient.swapaxes(0, 1)[..., ::-1].copy(),
        depth_mm=touch.depth_mm.T.copy(),
        contact=touch.contact.T.copy(),
        mm_per_px=touch.mm_per_px[::-1],
    )


@pytest.mark.parametrize("shift_mm", [(0.0, 0.0), (8.0, 6.0)])
def test_a_motion_and_its_doubt(shift_mm: tuple[float, float]) -> None:
    start = motion(np.array([0, 0, 0, *shift_mm, 0]))
    moved = motion(np.array([0.03, -0.02, 0.05, 0.1, -0.15, 0.02])) @ start
    pair = seen(start, 1), seen(moved, 2)
    found, again = (
        Joint().align(*map(Pyramid, both), np.eye(4)) for both in (pair, map(transposed, pair))
    )
    wanted = SWAP @ found.T_current_reference @ SWAP
    np.testing.assert_allclose(again.T_current_reference, wanted, atol=5e-4)
    scale = np.sqrt(np.diag(found.covariance))
    back = OF_TWISTS @ again.covariance @ OF_TWISTS.T / np.outer(scale, scale)
    np.testing.assert_allclose(back, found.covariance / np.outer(scale, scale), atol=0.05)


@pytest.mark.parametrize("shift_mm", [(0.0, 0.0), (0.0, 7.0), (-9.5, 0.0), (9.0, -6.0)])
def test_pulls_of_errors(shift_mm: tuple[float, float]) -> None:
    touch = seen(motion(np.array([0, 0, 0, *shift_mm, 0])), 1)
    found, again = (Pyramid(item).pulls(0.7) for item in (touch, transposed(touch)))
    wanted = OF_TWISTS @ found @ OF_TWISTS.T
    np.testing.assert_allclose(again, wanted, rtol=1e-3, atol=1e-3 * np.abs(wanted).max())
