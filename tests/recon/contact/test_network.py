# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""What contacts are learnt from, and the network that learnt it."""

from concurrent.futures import ThreadPoolExecutor

import cv2
import numpy as np
import pytest

from recon import unet
from recon.contact.network import CONTACT, LARGEST_PX, held, network_input
from recon.training.contact_surfaces import surface_gradient
from recon.training.random_presses import COLLAR_PX, pressed_skin, random_press
from recon.unet.weights import load_weights, save_weights, shipped_weights
from sensor.design import STANDARD
from simulation.skin import View, collar_mm, pressed

PITCH_MM = 0.1
CHANNELS = (4, 6)


@pytest.fixture
def training():
    """The training script, with torch."""
    pytest.importorskip("torch")
    from recon.training import contact as training

    training.torch.set_num_threads(1)
    return training


def overlap(one, two):
    return (one & two).sum() / max((one | two).sum(), 1)


@pytest.mark.parametrize("seed", range(12))
def test_a_random_press_obeys_the_gel(seed):
    skin, touched, collar = random_press(np.random.default_rng(seed), 60, 80)
    again, _, _ = random_press(np.random.default_rng(seed), 60, 80)
    np.testing.assert_array_equal(skin, again)
    assert COLLAR_PX[0] <= collar <= COLLAR_PX[1] and touched.any() and (skin >= 0).all()
    ringed = np.pad(skin, 1, mode="edge").astype(float)
    around = ringed[:-2, 1:-1] + ringed[2:, 1:-1] + ringed[1:-1, :-2] + ringed[1:-1, 2:]
    pressure = skin - collar**2 * (around - 4 * skin)
    scale = skin.max() * collar**2
    assert pressure.min() > -0.02 * scale  # nothing pulls the gel
    assert np.abs(pressure[~touched]).max() < 0.02 * scale  # free gel is pressed by nothing


def test_the_skin_learnt_from_is_the_twins():
    view = View(size_px=(80, 60), mm_per_px=(PITCH_MM, PITCH_MM))
    x, y = view.grid_mm
    for reach_mm in (0.8 - (x**2 + y**2) / 6, np.where(np.abs(x) + np.abs(y) < 2, 0.4, -1.0)):
        twin = pressed(view, STANDARD.gel, reach_mm)
        reach_px = (reach_mm / PITCH_MM).astype(np.float32)
        skin, touched = pressed_skin(reach_px, collar_mm(STANDARD.gel) / PITCH_MM)
        assert np.abs(skin * PITCH_MM - twin.depth_mm).max() < 0.002
        assert overlap(touched, twin.contact) > 0.97


def test_the_numpy_network_is_the_torch_network(training):
    torch = training.torch
    torch.manual_seed(0)
    network = training.ContactNet(CHANNELS)
    torch.nn.init.normal_(network.layers["last"].weight)
    maps = np.random.default_rng(1).normal(size=(CONTACT.inputs, 32, 48)).astype(np.float32)
    with torch.no_grad():
        expected = network(torch.from_numpy(maps)[None])[0].numpy()
    found = unet.through_layers(network.weights(), maps)
    np.testing.assert_allclose(found[0], expected, atol=1e-4)


def test_a_short_training_learns_and_its_weights_come_back(training, tmp_path, monkeypatch):
    with ThreadPoolExecutor(1) as executor:
        weights, losses = training.train(0, (15, 5), CHANNELS, executor, count=16)
        monkeypatch.setattr(training, "learning_rate", lambda *_: 0.0)
        unlearnt, unchanged = training.train(0, (15, 5), CHANNELS, executor, count=16)
    assert np.mean(losses[-5:]) < 0.97 * np.mean(unchanged[-5:])  # of the same batches
    assert weights.keys() == unlearnt.keys()
    save_weights(tmp_path / "net.safetensors", weights, "a command", 0, CONTACT)
    for name, values in load_weights(tmp_path / "net.safetensors", CONTACT).items():
        np.testing.assert_array_equal(values, weights[name])


def test_a_loss_is_least_for_the_truth(training):
    torch = training.torch
    truth = torch.zeros(2, 12, 16)
    truth[0, 3:8, 4:9] = 1
    right = training.loss_of(20 * (truth - 0.5), truth)
    assert right < 0.1
    for wrong in (truth.roll(2, 2), torch.zeros_like(truth), torch.ones_like(truth)):
        assert training.loss_of(20 * (wrong - 0.5), truth) > 5 * right


def test_held_gel_is_found_near_and_nowhere_else():
    skin, touched, _ = random_press(np.random.default_rng(4), 96, 128)
    slopes = surface_gradient(skin)
    near = skin > 0.1 * skin.max()
    found = held(skin * PITCH_MM, slopes, (PITCH_MM, PITCH_MM), near)
    assert overlap(found, touched) > 0.8
    left = near & (np.arange(128) < 60)
    assert not held(skin * PITCH_MM, slopes, (PITCH_MM, PITCH_MM), left)[~left].any()
    assert not held(skin * PITCH_MM, slopes, (PITCH_MM, PITCH_MM), np.zeros_like(near)).any()


def test_a_ridge_is_held_as_far_as_the_skin_lies_on_its_flanks():
    """Four pixels on either side of its edge; where the skin leaves them it is about as steep."""
    view = View(size_px=(120, 80), mm_per_px=(PITCH_MM, PITCH_MM))
    x, y = view.grid_mm
    twin = pressed(view, STANDARD.gel, np.where(np.abs(x) < 2.5, 0.5 - 0.58 * np.abs(y), -1.0))
    slopes = surface_gradient((twin.depth_mm / PITCH_MM).astype(np.float32))
    near = twin.depth_mm > 0.1 * twin.depth_mm.max()
    found = held(twin.depth_mm, slopes, (PITCH_MM, PITCH_MM), near)
    assert overlap(found, twin.contact) > 0.9


def test_a_large_frame_is_answered_as_the_small_one():
    rows, columns = np.indices((180, 240))
    reach = 9 - np.hypot(rows - 90, columns - 120) ** 2 / 90
    skin, _ = pressed_skin(reach.astype(np.float32), 4.0)
    near = skin > 0.1 * skin.max()
    small = held(skin * 0.1, surface_gradient(skin), (0.1, 0.1), near)
    size = (480, 360)
    assert max(size) > LARGEST_PX
    depth = cv2.resize(skin * np.float32(0.1), size, interpolation=cv2.INTER_LINEAR)
    slopes = cv2.resize(surface_gradient(skin), size, interpolation=cv2.INTER_LINEAR)
    large = held(depth, slopes, (0.05, 0.05), depth > 0.1 * depth.max())
    assert overlap(large[::2, ::2], small) > 0.9


def test_what_goes_in_is_the_bend_of_the_skin():
    rows, columns = np.indices((20, 24)).astype(np.float32)
    bowl = 0.05 * (rows**2 + columns**2)
    maps = network_input(bowl, np.stack([0.1 * columns, 0.1 * rows], -1))
    np.testing.assert_allclose(maps[3, 1:-1, 1:-1], 0.2 / 0.25, rtol=1e-4)


def test_the_shipped_weights_are_small_and_whole():
    assert unet.channels_of(shipped_weights(CONTACT))
    assert CONTACT.file.stat().st_size < 500_000
