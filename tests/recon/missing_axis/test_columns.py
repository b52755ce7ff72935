# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Integrals along the lights: exact where slopes are, and left out where they do not close."""

import numpy as np
import pytest

from recon.missing_axis.columns import depth_by_columns, weigh_columns
from recon.missing_axis.inference import Completed

MM_PER_PX = (0.05, 0.04)
DOUBT = 0.05
GUESS = np.zeros((90, 120, 2), np.float32)
EVERYWHERE = np.ones((90, 120), bool)


def doubted(gradient):
    """A field of a network that doubts all of it alike."""
    return Completed(gradient=gradient, doubt=np.full(gradient.shape[:2], DOUBT, np.float32))


def weighed(gradient, *others):
    return weigh_columns(doubted(gradient), *others).gradient


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
    found = weighed(GUESS, along_y, "x", EVERYWHERE, MM_PER_PX)
    assert np.abs(found[..., 0] - along_x).mean() < 0.2 * np.abs(along_x).mean()
    assert np.abs(found[..., 1] - along_y).mean() < 0.2 * np.abs(along_y).mean()


def test_noise_that_columns_add_up_is_told_by_their_misclosure():
    _, along_x, along_y = grooves()
    network = np.stack([along_x, along_y], -1).astype(np.float32)
    noisy = along_y + 0.3 * np.random.default_rng(0).standard_normal(along_y.shape)
    depth, _ = depth_by_columns(noisy, EVERYWHERE, MM_PER_PX[1])
    alone = np.abs(np.gradient(depth, MM_PER_PX[0], axis=1) - along_x).mean()
    found = weighed(network, noisy, "x", EVERYWHERE, MM_PER_PX)
    assert np.abs(found[..., 0] - along_x).mean() < 0.2 * alone
    assert np.abs(found[..., 1] - along_y).mean() < 0.2 * np.abs(noisy - along_y).mean()


def test_depth_below_zero_tells_of_false_slopes_that_close():
    """Slopes that are wrong alike at both ends of each line leave no misclosure."""
    _, along_x, along_y = grooves()
    network = np.stack([along_x, along_y], -1).astype(np.float32)
    found = weighed(network, -along_y, "x", EVERYWHERE, MM_PER_PX)  # ridges of grooves
    assert np.abs(found[..., 0] - along_x).mean() < 0.6 * np.abs(along_x).mean()


def test_a_network_that_is_sure_of_no_grooves_is_doubted_where_the_integrals_find_some():
    _, along_x, along_y = grooves()
    doubt = weigh_columns(doubted(GUESS), along_y, "x", EVERYWHERE, MM_PER_PX).doubt
    inside = np.abs(np.mgrid[:90, :120] - np.reshape([45, 60], (2, 1, 1)))
    inside = (inside[0] < 15) & (inside[1] < 40)
    difference = np.sqrt(np.mean(along_x[inside] ** 2))
    np.testing.assert_allclose(doubt[inside], np.sqrt(DOUBT * difference), rtol=0.2)
    assert doubt[inside].min() > 3 * DOUBT > 30 * doubt[:10].max()


def test_a_network_that_the_integrals_agree_with_is_doubted_less():
    _, along_x, along_y = grooves()
    true = doubted(np.stack([along_x, along_y], -1).astype(np.float32))
    assert weigh_columns(true, along_y, "x", EVERYWHERE, MM_PER_PX).doubt.max() < DOUBT * 1.1


def test_both_axes_are_treated_alike():
    _, _, along_y = grooves()
    doubt = np.random.default_rng(0).uniform(0, 1, (90, 120)).astype(np.float32)
    network = Completed(gradient=GUESS, doubt=doubt)
    across = weigh_columns(network, along_y, "x", EVERYWHERE, MM_PER_PX)
    turned = Completed(gradient=GUESS.transpose(1, 0, 2), doubt=doubt.T)
    found = weigh_columns(turned, along_y.T, "y", EVERYWHERE.T, MM_PER_PX[::-1])
    back = found.gradient.transpose(1, 0, 2)[..., ::-1]
    np.testing.assert_allclose(back, across.gradient, atol=1e-6)
    np.testing.assert_allclose(found.doubt.T, across.doubt, atol=1e-6)


@pytest.mark.parametrize("size", [(0, 5), (5, 0), (5, 1), (1, 5), (3, 3)])
def test_flat_gel_and_tiny_frames_stay_as_they_are(size):
    flat = np.zeros((*size, 2), np.float32)
    found = weighed(flat, flat[..., 0], "x", np.ones(size, bool), MM_PER_PX)
    assert found.shape == flat.shape and (found == 0).all()
