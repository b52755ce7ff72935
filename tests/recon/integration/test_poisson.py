# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
import inspect

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import fft

from recon.ball import ball_cap, offsets_mm
from recon.integration.poisson import (
    integrate,
    margins_px,
    midpoint_slopes,
    solve_dirichlet,
    solve_neumann,
)
from sensor.errors import WedgeError

SQUARE = (0.1, 0.1)
# Odd, even, prime, and those whose transform is quick; the smallest have no inner pixel.
sides = st.sampled_from([1, 2, 3, 4, 5, 7, 11, 16, 23, 37, 60, 97])
pitches = st.tuples(st.floats(0.01, 2), st.floats(0.01, 2))
seeds = st.integers(0, 2**32 - 1)


def slopes_inside(depth, mm_per_px):
    """What both axes' neighbouring pixels say: the slopes that a free border sees."""
    return np.diff(depth, axis=1) / mm_per_px[0], np.diff(depth, axis=0) / mm_per_px[1]


def slopes_with_ring(depth, mm_per_px):
    """The same with a ring of zeros around: the slopes that a zero border sees."""
    along_x, along_y = slopes_inside(np.pad(depth, 1), mm_per_px)
    return along_x[1:-1], along_y[:, 1:-1]


def five_point_laplacian(padded, mm_per_px):
    inner = padded[1:-1, 1:-1]
    along_x = padded[1:-1, 2:] - 2 * inner + padded[1:-1, :-2]
    along_y = padded[2:, 1:-1] - 2 * inner + padded[:-2, 1:-1]
    return along_x / mm_per_px[0] ** 2 + along_y / mm_per_px[1] ** 2


def height(depth):
    return max(np.ptp(depth), 1e-9)


@given(sides, sides, pitches, seeds)
def test_a_zero_border_returns_the_very_surface_of_exact_differences(h, w, mm_per_px, seed):
    surface = np.random.default_rng(seed).normal(size=(h, w))
    found = solve_dirichlet(*slopes_with_ring(surface, mm_per_px), mm_per_px)
    assert np.abs(found - surface).max() <= 1e-10 * max(height(surface), 1)


@given(sides, sides, pitches, seeds)
def test_a_free_border_returns_the_very_surface_of_exact_differences(h, w, mm_per_px, seed):
    surface = np.random.default_rng(seed).normal(size=(h, w))
    found = solve_neumann(*slopes_inside(surface, mm_per_px), mm_per_px)
    assert abs(found.mean()) <= 1e-12
    assert np.abs(found - (surface - surface.mean())).max() <= 1e-10 * max(height(surface), 1)


@given(sides, sides, pitches, seeds)
def test_of_slopes_that_fit_no_surface_the_laplacian_is_the_divergence(h, w, mm_per_px, seed):
    rng = np.random.default_rng(seed)
    ringed = rng.normal(size=(h, w + 1)), rng.normal(size=(h + 1, w))
    divergence = (
        np.diff(ringed[0], axis=1) / mm_per_px[0] + np.diff(ringed[1], axis=0) / mm_per_px[1]
    )
    found = five_point_laplacian(np.pad(solve_dirichlet(*ringed, mm_per_px), 1), mm_per_px)
    np.testing.assert_allclose(found, divergence, atol=1e-9 * np.abs(divergence).max())

    free = rng.normal(size=(h, w - 1)), rng.normal(size=(h - 1, w))
    closed = np.pad(free[0], ((0, 0), (1, 1))), np.pad(free[1], ((1, 1), (0, 0)))
    divergence = (
        np.diff(closed[0], axis=1) / mm_per_px[0] + np.diff(closed[1], axis=0) / mm_per_px[1]
    )
    mirrored = np.pad(solve_neumann(*free, mm_per_px), 1, mode="edge")
    found = five_point_laplacian(mirrored, mm_per_px)
    np.testing.assert_allclose(found, divergence, atol=1e-9 * max(np.abs(divergence).max(), 1))


@given(sides, sides, seeds)
def test_a_free_border_is_the_least_squares_fit(h, w, seed):
    """No small change of the surface fits the slopes better: the residual is orthogonal to all."""
    rng = np.random.default_rng(seed)
    slopes = rng.normal(size=(h, w - 1)), rng.normal(size=(h - 1, w))
    fitted = slopes_inside(solve_neumann(*slopes, SQUARE), SQUARE)
    change = slopes_inside(rng.normal(size=(h, w)), SQUARE)
    product = sum(np.sum((f - s) * c) for f, s, c in zip(fitted, slopes, change, strict=True))
    assert abs(product) <= 1e-8 * max(sum(np.sum(c**2) for c in change), 1)


@pytest.mark.parametrize("boundary", ["dirichlet", "neumann"])
@given(sides, sides, pitches, seeds, st.floats(-5, 5))
def test_depth_is_linear_in_the_gradient(boundary, h, w, mm_per_px, seed, factor):
    one, two = np.random.default_rng(seed).normal(size=(2, h, w, 2))
    depths = [integrate(g, mm_per_px, boundary) for g in (one, two, one + factor * two)]
    np.testing.assert_allclose(depths[2], depths[0] + factor * depths[1], atol=1e-9 * (h + w))


@pytest.mark.parametrize("boundary", ["dirichlet", "neumann"])
@given(st.integers(1, 40), st.integers(1, 40), seeds)
def test_transposing_the_scene_transposes_the_depth(boundary, h, w, seed):
    gradient = np.random.default_rng(seed).normal(size=(h, w, 2))
    turned = gradient.transpose(1, 0, 2)[..., ::-1]
    depth = integrate(gradient, (0.2, 0.3), boundary)
    np.testing.assert_allclose(integrate(turned, (0.3, 0.2), boundary), depth.T, atol=1e-10)


# Where fast transforms make the flat margin uneven, the zero ring is not symmetric; 59 and 39
# need no margin.
@pytest.mark.parametrize("boundary", ["dirichlet", "neumann"])
@pytest.mark.parametrize("axis", [0, 1])
def test_mirroring_the_scene_mirrors_the_depth(boundary, axis):
    gradient = np.random.default_rng(3).normal(size=(39, 59, 2))
    mirrored = np.flip(gradient, axis).copy()
    mirrored[..., 1 - axis] *= -1
    depth = integrate(gradient, (0.2, 0.3), boundary)
    found = integrate(mirrored, (0.2, 0.3), boundary)
    np.testing.assert_allclose(found, np.flip(depth, axis), atol=1e-10)


@pytest.mark.parametrize("boundary", ["dirichlet", "neumann"])
@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_shape_and_dtype_are_kept(boundary, dtype):
    gradient = np.random.default_rng(0).normal(size=(21, 33, 2)).astype(dtype)
    depth = integrate(gradient, SQUARE, boundary)
    assert depth.shape == (21, 33) and depth.dtype == dtype
    reference = integrate(gradient.astype(np.float64), SQUARE, boundary)
    np.testing.assert_allclose(depth, reference, atol=1e-5 if dtype == np.float32 else 0)


def smooth_bump(pixels):
    """A bump that is six times differentiable and zero near the border; depth and gradient."""
    pitch = 10.0 / pixels
    size = (pixels, pixels)
    x, y = offsets_mm(size, ((pixels - 1) * 0.46, (pixels - 1) * 0.53), (pitch, pitch))
    inside = np.maximum(1 - (x**2 + y**2) / 4.0**2, 0)
    gradient = -7 * inside[..., None] ** 6 * 2 / 4.0**2 * np.stack([x, y], -1)
    return inside**7, gradient, (pitch, pitch)


def rolling_ground(pixels):
    """A surface that is smooth everywhere and has slopes on the border."""
    pitch = 4.0 / pixels
    x, y = offsets_mm((pixels, pixels), ((pixels - 1) / 2,) * 2, (pitch, pitch))
    depth = np.sin(1.3 * x + 0.4) * np.cos(0.9 * y) + 0.2 * x * y
    along_x = 1.3 * np.cos(1.3 * x + 0.4) * np.cos(0.9 * y) + 0.2 * y
    along_y = -0.9 * np.sin(1.3 * x + 0.4) * np.sin(0.9 * y) + 0.2 * x
    return depth, np.stack([along_x, along_y], -1), (pitch, pitch)


@pytest.mark.parametrize(
    ("scene", "boundary"),
    [(smooth_bump, "dirichlet"), (smooth_bump, "neumann"), (rolling_ground, "neumann")],
)
def test_the_error_falls_with_the_square_of_the_pitch(scene, boundary):
    errors = []
    for pixels in (40, 80, 160):
        depth, gradient, mm_per_px = scene(pixels)
        error = integrate(gradient, mm_per_px, boundary) - depth
        if boundary == "neumann":
            error -= error.mean()
        errors.append(np.abs(error).max())
    orders = np.log2(np.divide(errors[:-1], errors[1:]))
    assert orders.min() >= 1.9, f"errors {errors}, orders {orders}"


def three_balls():
    """Ball caps far apart in a 320x240 frame, the gradient sampled at pixel centres."""
    size, mm_per_px = (320, 240), (0.06, 0.06)
    caps = [
        ball_cap(size, center, contact_mm, ball_mm, mm_per_px)
        for center, contact_mm, ball_mm in [
            ((80.3, 70.6), 2.4, 4.0),
            ((230.0, 90.5), 3.0, 4.0),
            ((150.7, 180.2), 1.5, 3.0),
        ]
    ]
    return sum(c.depth_mm for c in caps), sum(c.gradient for c in caps), mm_per_px


@pytest.mark.parametrize("boundary", ["dirichlet", "neumann"])
def test_three_balls_come_back_in_height_scale_and_place(boundary):
    truth, gradient, mm_per_px = three_balls()
    depth = integrate(gradient, mm_per_px, boundary)
    depth -= np.median(depth[truth == 0])
    assert np.sqrt(np.mean((depth - truth) ** 2)) <= 0.003 * truth.max()
    assert abs(np.sum(depth * truth) / np.sum(truth**2) - 1) <= 0.005
    # Least-squares shift of the whole picture: the error projected on the truth's differences.
    moved = np.stack([d.ravel() for d in np.gradient(truth)], 1)
    shift = np.linalg.lstsq(moved, (depth - truth).ravel(), rcond=None)[0]
    assert np.abs(shift).max() < 0.05


@pytest.mark.parametrize("slope", [(0.3, 0.0), (0.0, -0.2), (0.15, 0.4)])
def test_a_tilted_plane_is_recovered_with_a_free_border(slope):
    gradient = np.broadcast_to(slope, (31, 43, 2)).copy()
    x, y = offsets_mm((43, 31), (21.0, 15.0), (0.1, 0.2))
    depth = integrate(gradient, (0.1, 0.2), "neumann")
    np.testing.assert_allclose(depth, slope[0] * x + slope[1] * y, atol=1e-12)


def test_a_ball_cut_by_the_border_needs_the_free_border():
    size, mm_per_px = (160, 120), (0.1, 0.1)
    cap = ball_cap(size, (0.0, 60.0), 3.0, 4.0, mm_per_px)
    peak = cap.depth_mm.max()
    errors = {}
    for boundary in ("neumann", "dirichlet"):
        depth = integrate(cap.gradient, mm_per_px, boundary)
        depth -= np.median(depth[~cap.contact])
        errors[boundary] = np.sqrt(np.mean((depth - cap.depth_mm)[cap.contact] ** 2)) / peak
    assert errors["neumann"] <= 0.02
    assert errors["dirichlet"] > 5 * errors["neumann"]


def test_untouched_gel_has_no_depth():
    for boundary in ("dirichlet", "neumann"):
        assert not integrate(np.zeros((24, 32, 2)), SQUARE, boundary).any()


def test_midpoint_slopes_are_the_means_of_neighbours():
    gradient = np.arange(24.0).reshape(3, 4, 2)
    along_x, along_y = midpoint_slopes(gradient)
    assert along_x.shape == (3, 3) and along_y.shape == (2, 4)
    assert along_x[1, 2] == (gradient[1, 2, 0] + gradient[1, 3, 0]) / 2
    assert along_y[1, 2] == (gradient[1, 2, 1] + gradient[2, 2, 1]) / 2


@given(st.integers(1, 5000))
def test_flat_margins_make_the_nearest_quick_transform(count):
    before, after = margins_px(count)
    solved = count + (before - 1) + (after - 1)  # the ring itself is not solved for
    assert min(before, after) >= 1 and abs(before - after) <= 1
    assert solved + 1 == fft.next_fast_len(count + 1, real=True)


def test_an_unknown_boundary_and_a_pitch_that_is_none_are_refused():
    with pytest.raises(WedgeError, match="no boundary 'Neumann'"):
        inspect.unwrap(integrate)(np.zeros((4, 5, 2)), (0.1, 0.1), "Neumann")
    for pitch in ((0.1, 0.0), (-0.1, 0.1), (np.nan, 0.1), (0.1, np.nan), (0.1, np.inf)):
        with pytest.raises(WedgeError, match="positive"):
            integrate(np.zeros((4, 5, 2)), pitch, "dirichlet")
