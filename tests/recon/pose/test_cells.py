# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""A touch in cells: where they lie, what they hold, and that no axis or part counts for more."""

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.touches import SyntheticTouch
from recon.pose.cells import (
    BESIDE_MM,
    CELL_MM,
    SIDES,
    _scatter,
    coarse,
    noise_between,
)
from recon.pose.noise import sums_in_waves, wave_variances
from recon.pose.registration import pixel_grid_mm
from tests.recon.pose.touched import bead_pair

PITCH_MM = (0.05, 0.12)  # cells of 5 x 2 pixels
SIZE_PX = (153, 61)  # no whole number of them


def test_a_cell_s_slopes_and_depth_are_those_of_a_plane_in_its_middle() -> None:
    x_mm, y_mm = np.meshgrid(*pixel_grid_mm(SIZE_PX, PITCH_MM))
    seen = SyntheticTouch(
        gradient=np.stack([x_mm, y_mm], -1).astype(np.float32),
        depth_mm=x_mm.astype(np.float32),
        contact=np.hypot(x_mm, y_mm) < 1,
        mm_per_px=PITCH_MM,
    )
    cells = coarse(seen)
    across, down = np.meshgrid(cells.x_mm, cells.y_mm)
    np.testing.assert_allclose(cells.gradient, np.stack([across, down], -1), atol=1e-5)
    np.testing.assert_allclose(cells.depth_mm, across, atol=PITCH_MM[0] / 2 + 1e-6)
    away = np.hypot(across, down)
    assert cells.inside[away < 0.6].all() and not cells.inside[away > 1].any()
    assert not cells.apart[away < 1.2].any()
    square = np.maximum(np.abs(across), np.abs(down))
    assert cells.apart[square > 1 + BESIDE_MM + 2 * CELL_MM].all()


def test_transposing_a_frame_leaves_what_its_sums_vary_by() -> None:
    rng = np.random.default_rng(0)
    points = rng.uniform(-1, 1, (200, 3))
    shares = rng.normal(size=(3, 200, 4))

    def covariances(at: np.ndarray, of: np.ndarray, shape, pitch_mm) -> np.ndarray:
        waves = sums_in_waves(at, of, shape, pitch_mm)
        return (waves * wave_variances(shape, pitch_mm)[:, None]) @ waves.T

    found = covariances(points, shares, SIZE_PX[::-1], PITCH_MM)
    turned = covariances(points[:, [1, 0, 2]], shares[[1, 0, 2]], SIZE_PX, PITCH_MM[::-1])
    np.testing.assert_allclose(turned, found, rtol=1e-6, atol=1e-9 * np.abs(found).max())


@pytest.mark.parametrize("axis", [0, 1])
def test_every_part_of_a_frame_tells_of_its_noise(axis: int) -> None:
    noise = np.random.default_rng(0).normal(size=(96, 96, 2)).astype(np.float32)
    noise *= np.where(np.arange(96) < 40, 4, 1)[:, None, None]
    noise = noise if axis == 0 else noise.swapaxes(0, 1)
    everywhere = np.ones((96, 96), bool)
    one, other = (_scatter(item, everywhere) for item in (noise, np.flip(noise, axis).copy()))
    np.testing.assert_allclose(one, other, rtol=0.2)


def test_means_of_white_noise_vary_by_one_over_their_number() -> None:
    noise = np.random.default_rng(1).normal(0, 0.3, (512, 256, 2)).astype(np.float32)
    found = _scatter(noise, np.ones((512, 256), bool))
    np.testing.assert_allclose(found, 0.3**2 / np.square(SIDES), rtol=0.2)


def test_beyond_the_current_contact_nothing_tells_of_noise_within() -> None:
    first, second, moved = bead_pair(0)
    noisy = second.gradient + 0.0
    noisy[~second.contact] += 5  # a cliff, where gel only follows
    found = [
        noise_between(coarse(first), replace(coarse(item), apart=coarse(item).apart & False), moved)
        for item in (second, replace(second, gradient=noisy))
    ]
    np.testing.assert_allclose(found[1], found[0], rtol=1e-6)
