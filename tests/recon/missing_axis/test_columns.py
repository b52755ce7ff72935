# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Integrals along the lights: exact where slopes are, and left out where they do not close."""

import numpy as np
import pytest

from recon.missing_axis.columns import depth_by_columns, weigh_columns

MM_PER_PX = (0.05, 0.04)
GUESS = np.zeros((90, 120, 2), np.float32)
EVERYWHERE = np.ones((90, 120), bool)


def grooves(height=90, width=120):
    """Depth (mm) of grooves that run along y, and its slopes along x and y."""
    y, x = np.mgrid[:height, :width].astype(float)
    ends = 1 / (1 + np.exp(np.abs(y - 45) - 25))
    depth = 0.2 * ends * (1 + np.cos(2 * np.pi * x / 20)) * (np.abs(x - 60) < 50)
    along_y, along_x = np.gradient(depth, MM_PER_PX[1], MM_PER_PX[0])
    return depth, along_x, along_y


def test_columns_of_true_slopes_give_the_true_depth():
    depth, _, along_y = grooves()
    found, misclosure = depth_by_columns(along_y, EVERYWHERE, MM_PER_PX[1])
    np.testing.assert_allclose(found, depth, atol=0.03 * depth.max())  # of central differences
    np.testing.assert_allclose(misclosure, 0, atol=1e-3 * depth.max())


def test_misclosure_is_shared_out_over_the_disturbed_gel_alone():
    _, _, along_y = grooves()
    support = np.zeros_like(EVERYWHERE)
    support[10:80] = True
    found, misclosure = depth_by_columns(along_y + 0.05, support, MM_PER_PX[1])
    np.testing.assert_allclose(misclosure, 70 * 0.05 * MM_PER_PX[1], rtol=0.02)
    assert (found[~support] == 0).all()
    np.testing.assert_allclose(found, depth_by_columns(along_y, support, 0.04)[0], atol=1e-3)


def test_grooves_along_the_lights_are_found_where_the_network_guesses_none():
    _, along_x, along_y = grooves()
    found = weigh_columns(GUESS, along_y, "x", EVERYWHERE, MM_PER_PX)
    assert np.abs(found[..., 0] - along_x).mean() < 0.2 * np.abs(along_x).mean()
    assert np.abs(found[..., 1] - along_y).mean() < 0.2 * np.abs(along_y).mean()


def test_noise_that_columns_add_up_is_told_by_their_misclosure():
    _, along_x, along_y = grooves()
    network = np.stack([along_x, along_y], -1).astype(np.float32)
    noisy = along_y + 0.3 * np.random.default_rng(0).standard_normal(along_y.shape)
    depth, _ = depth_by_columns(noisy, EVERYWHERE, MM_PER_PX[1])
    alone = np.abs(np.gradient(depth, MM_PER_PX[0], axis=1) - along_x).mean()
    found = weigh_columns(network, noisy, "x", EVERYWHERE, MM_PER_PX)
    assert np.abs(found[..., 0] - along_x).mean() < 0.2 * alone
    assert np.abs(found[..., 1] - along_y).mean() < 0.2 * np.abs(noisy - along_y).mean()


def test_depth_below_zero_tells_of_false_slopes_that_close():
    """Slopes that are wrong alike at both ends of each line leave no misclosure."""
    _, along_x, along_y = grooves()
    network = np.stack([along_x, along_y], -1).astype(np.float32)
    found = weigh_columns(network, -along_y, "x", EVERYWHERE, MM_PER_PX)  # ridges of grooves
    assert np.abs(found[..., 0] - along_x).mean() < 0.6 * np.abs(along_x).mean()


def test_both_axes_are_treated_alike():
    _, _, along_y = grooves()
    across = weigh_columns(GUESS, along_y, "x", EVERYWHERE, MM_PER_PX)
    turned = weigh_columns(GUESS.transpose(1, 0, 2), along_y.T, "y", EVERYWHERE.T, MM_PER_PX[::-1])
    np.testing.assert_allclose(turned.transpose(1, 0, 2)[..., ::-1], across, atol=1e-6)


@pytest.mark.parametrize("size", [(0, 5), (5, 0), (5, 1), (1, 5), (3, 3)])
def test_flat_gel_and_tiny_frames_stay_as_they_are(size):
    flat = np.zeros((*size, 2), np.float32)
    found = weigh_columns(flat, flat[..., 0], "x", np.ones(size, bool), MM_PER_PX)
    assert found.shape == flat.shape and (found == 0).all()
