# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""The part of a slope field that is a depth's gradient: a projection that leaves surfaces alone."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from recon.integration.integrable import integrable

sides = st.integers(2, 40)
pitches = st.tuples(st.floats(0.02, 0.2), st.floats(0.02, 0.2))
seeds = st.integers(0, 2**16)


def centers(count, pitch):
    return (np.arange(count) + 0.5) * pitch


@given(h=sides, w=sides, mm_per_px=pitches, seed=seeds)
def test_slopes_of_a_surface_stay_whatever_it_does_at_the_border(h, w, mm_per_px, seed):
    x, y = centers(w, mm_per_px[0])[None], centers(h, mm_per_px[1])[:, None]
    rng = np.random.default_rng(seed)
    along_x = np.pi * rng.integers(0, w) / (w * mm_per_px[0])
    along_y = np.pi * rng.integers(0, h) / (h * mm_per_px[1])
    slopes = np.stack(
        [
            -along_x * np.sin(along_x * x) * np.cos(along_y * y),
            -along_y * np.cos(along_x * x) * np.sin(along_y * y),
        ],
        -1,
    )
    np.testing.assert_allclose(
        integrable(slopes, mm_per_px), slopes, atol=1e-9 * (1 + np.abs(slopes).max())
    )


@given(h=sides, w=sides, mm_per_px=pitches, seed=seeds)
def test_a_swirl_within_the_frame_goes(h, w, mm_per_px, seed):
    x, y = centers(w, mm_per_px[0])[None], centers(h, mm_per_px[1])[:, None]
    rng = np.random.default_rng(seed)
    along_x = np.pi * rng.integers(1, w) / (w * mm_per_px[0])
    along_y = np.pi * rng.integers(1, h) / (h * mm_per_px[1])
    swirl = np.stack(
        [
            -along_y * np.sin(along_x * x) * np.cos(along_y * y),
            along_x * np.cos(along_x * x) * np.sin(along_y * y),
        ],
        -1,
    )
    assert np.abs(integrable(swirl, mm_per_px)).max() < 1e-9 * (1 + np.abs(swirl).max())


@given(h=sides, w=sides, mm_per_px=pitches, seed=seeds)
def test_it_is_an_orthogonal_projection(h, w, mm_per_px, seed):
    one, other = np.random.default_rng(seed).standard_normal((2, h, w, 2))
    kept = integrable(one, mm_per_px)
    np.testing.assert_allclose(integrable(kept, mm_per_px), kept, atol=1e-9)
    assert np.vdot(one - kept, integrable(other, mm_per_px)) == pytest.approx(0, abs=1e-9 * h * w)


def test_half_of_white_noise_goes():
    noise = np.random.default_rng(0).standard_normal((120, 160, 2)).astype(np.float32)
    kept = integrable(noise, (0.1, 0.1))
    assert kept.dtype == np.float32
    assert float((kept**2).mean()) == pytest.approx(0.5, abs=0.03)
