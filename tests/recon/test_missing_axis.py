# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
import hashlib
import json
import subprocess
import sys

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from safetensors.numpy import save_file

from recon import missing_axis, unet
from recon.ball import ball_cap
from recon.missing_axis import infer_missing_axis, load_weights, save_weights, shipped_weights
from sensor.errors import WedgeError

SQUARE = (0.1, 0.1)
SLOPE_NOISE = 0.04


def random_ball(rng, width, height, mm_per_px=SQUARE):
    """Gradient of a ball pressed somewhere, its contact 0.1 to 0.4 of the shorter side."""
    width_mm, height_mm = width * mm_per_px[0], height * mm_per_px[1]
    contact_mm = rng.uniform(0.1, 0.4) * min(width_mm, height_mm)
    ball_mm = contact_mm / rng.uniform(0.3, 0.9)
    x_mm = rng.uniform(1.05 * contact_mm, width_mm - 1.05 * contact_mm)
    y_mm = rng.uniform(1.05 * contact_mm, height_mm - 1.05 * contact_mm)
    center = (x_mm / mm_per_px[0], y_mm / mm_per_px[1])
    cap = ball_cap((width, height), center, contact_mm, ball_mm, mm_per_px)
    return cap.gradient.astype(np.float32), cap.contact


def noisy(rng, slopes):
    return slopes + SLOPE_NOISE * rng.standard_normal(slopes.shape, np.float32)


def share_of_zeros_error(weights, axis, width, height, presses=8, mm_per_px=SQUARE):
    """Error of the inferred axis over the error of zero, on contact and 5 % of the other pixels."""
    rng = np.random.default_rng(2026)
    missing, known = (0, 1) if axis == "x" else (1, 0)
    inferred_error = zero_error = 0.0
    for _ in range(presses):
        gradient, contact = random_ball(rng, width, height, mm_per_px)
        chosen = contact | (rng.random(contact.shape) < 0.05)
        result = infer_missing_axis(noisy(rng, gradient[..., known]), axis, mm_per_px, weights)
        inferred_error += np.abs(result - gradient[..., missing])[chosen].sum()
        zero_error += np.abs(gradient[..., missing])[chosen].sum()
    return inferred_error / zero_error


@pytest.mark.parametrize("axis", ["x", "y"])
@pytest.mark.parametrize("size", [(320, 240), (200, 150)])
def test_on_unseen_balls_the_error_is_a_fifth_of_zeros(axis, size):
    assert share_of_zeros_error(shipped_weights(), axis, *size) <= 0.2


@pytest.mark.parametrize(
    ("size", "mm_per_px"),
    [((640, 480), (0.05, 0.05)), ((320, 160), (0.05, 0.1)), ((213, 171), (0.08, 0.1))],
)
def test_other_sizes_and_oblong_pixels_are_no_worse(size, mm_per_px):
    share = share_of_zeros_error(shipped_weights(), "x", *size, presses=5, mm_per_px=mm_per_px)
    assert share <= 0.2


@pytest.mark.parametrize("size", [(240, 320), (150, 200)])
def test_noise_on_untouched_gel_is_answered_with_almost_nothing(size):
    noise = noisy(np.random.default_rng(0), np.zeros(size, np.float32))
    assert np.abs(infer_missing_axis(noise, "x", SQUARE)).mean() <= 0.01
    nothing = infer_missing_axis(np.zeros(size), "x", SQUARE)
    assert np.abs(nothing).mean() <= 0.002 and np.abs(nothing).max() <= 0.1


def test_the_missing_y_of_a_frame_is_the_missing_x_of_its_transpose():
    rng = np.random.default_rng(4)
    known = noisy(rng, random_ball(rng, 120, 90, (0.1, 0.12))[0][..., 0])
    of_y = infer_missing_axis(known, "y", (0.1, 0.12))
    np.testing.assert_array_equal(of_y.T, infer_missing_axis(known.T, "x", (0.12, 0.1)))
    assert np.abs(of_y).max() > 0.1


def test_only_the_ratio_of_the_pitches_counts():
    rng = np.random.default_rng(5)
    known = noisy(rng, random_ball(rng, 96, 64)[0][..., 1])
    here, elsewhere = (
        infer_missing_axis(known, "x", pitch) for pitch in [(1.0, 1.0), (0.25, 0.25)]
    )
    np.testing.assert_array_equal(here, elsewhere)


def test_a_frame_twice_as_fine_is_seen_as_the_frame_itself():
    rng = np.random.default_rng(7)
    known = noisy(rng, random_ball(rng, 320, 240)[0][..., 1])
    finer = infer_missing_axis(known.repeat(2, 0).repeat(2, 1), "x", (0.05, 0.05))
    coarse = infer_missing_axis(known, "x", SQUARE)
    np.testing.assert_allclose(finer, cv2.resize(coarse, (640, 480)), atol=1e-4)
    assert np.abs(coarse).max() > 0.3


@given(st.integers(1, 70), st.integers(1, 70), st.floats(0.2, 5), st.sampled_from("xy"))
@settings(max_examples=25, deadline=None)
def test_every_size_comes_back_as_it_went(height, width, ratio, axis):
    known = np.random.default_rng(height).normal(0, SLOPE_NOISE, (height, width))
    result = infer_missing_axis(known, axis, (0.1 * ratio, 0.1))
    assert result.shape == known.shape and result.dtype == np.float32
    assert np.isfinite(result).all() and np.abs(result).mean() < 0.1


def test_a_contact_on_the_border_stays_bounded():
    gradient = ball_cap((160, 120), (0.0, 60.0), 4.0, 5.0, SQUARE).gradient
    result = infer_missing_axis(gradient[..., 1], "x", SQUARE)
    assert np.abs(result - gradient[..., 0]).sum() < np.abs(gradient[..., 0]).sum()


def test_the_numpy_network_is_the_torch_network():
    torch = pytest.importorskip("torch")
    from recon.unet_training import UNet

    torch.manual_seed(0)
    network = UNet()
    torch.nn.init.normal_(network.layers["out"].weight)  # it starts at zero, which proves nothing
    maps = np.random.default_rng(6).normal(size=(unet.INPUTS, 96, 160)).astype(np.float32)
    with torch.no_grad():
        expected = network(torch.from_numpy(maps)[None])[0, 0].numpy()
    np.testing.assert_allclose(unet.forward(network.weights(), maps), expected, atol=1e-4)
    assert np.abs(expected - expected.mean()).max() > 1e-3


def test_inference_needs_no_torch():
    code = (
        "import sys; sys.modules['torch'] = None\n"
        "import numpy as np; from recon.missing_axis import infer_missing_axis\n"
        "infer_missing_axis(np.zeros((32, 32)), 'x', (1.0, 1.0))"
    )
    subprocess.run([sys.executable, "-c", code], check=True)


def test_a_short_training_is_reproducible_and_beats_zero(monkeypatch):
    pytest.importorskip("torch")
    from recon import unet_training

    monkeypatch.setattr(unet_training, "LARGE_SHARE", 0.0)  # large frames are slow
    first, again = (unet_training.train(seed=1, steps=2).weights() for _ in range(2))
    for name, values in first.items():
        np.testing.assert_array_equal(values, again[name])
    trained = unet_training.train(seed=1, steps=50).weights()
    assert share_of_zeros_error(trained, "x", 128, 96) < 0.8


def test_weights_come_back_as_written_and_always_as_the_same_bytes(tmp_path):
    one, two = tmp_path / "one.safetensors", tmp_path / "two.safetensors"
    for path in (one, two):
        save_weights(path, shipped_weights(), "python -m recon.unet_training", 0)
    assert one.read_bytes() == two.read_bytes()
    for name, values in load_weights(one).items():
        np.testing.assert_array_equal(values, shipped_weights()[name])


def test_shipped_weights_are_small_and_their_readme_names_them():
    content = missing_axis.WEIGHTS_FILE.read_bytes()
    readme = missing_axis.WEIGHTS_FILE.with_name("README.md").read_text()
    length = int.from_bytes(content[:8], "little")
    made = json.loads(json.loads(content[8 : 8 + length])["__metadata__"]["missing_axis"])
    assert len(content) <= 1_000_000
    assert hashlib.sha256(content).hexdigest() in readme
    assert made["command"] in readme


def altered(path, change):
    content = bytearray(missing_axis.WEIGHTS_FILE.read_bytes())
    path.write_bytes(change(content))
    return path


def flip_last_byte(content):
    content[-1] ^= 1
    return content


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        (flip_last_byte, "is damaged"),
        (lambda content: content[:-1], "cannot be read as network weights"),
        (lambda content: b"", "cannot be read as network weights"),
        (
            lambda content: content.replace(b'\\"version\\": \\"1', b'\\"version\\": \\"9'),
            "version 9",
        ),
    ],
)
def test_weights_that_are_not_those_trained_are_refused(tmp_path, change, sentence):
    with pytest.raises(WedgeError, match=sentence):
        load_weights(altered(tmp_path / "weights.safetensors", change))


def test_a_file_without_our_metadata_and_a_missing_one_are_refused(tmp_path):
    save_file(dict(shipped_weights()), tmp_path / "plain.safetensors")
    with pytest.raises(WedgeError, match="version unknown"):
        load_weights(tmp_path / "plain.safetensors")
    with pytest.raises(WedgeError, match="cannot be read"):
        load_weights(tmp_path / "absent.safetensors")


@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_a_slope_that_is_no_number_is_refused(value):
    known = np.zeros((32, 32))
    known[3, 4] = value
    with pytest.raises(WedgeError, match="NaN or infinity"):
        infer_missing_axis(known, "x", SQUARE)


@pytest.mark.parametrize("mm_per_px", [(0.0, 0.1), (0.1, -0.1), (0.1, float("nan"))])
def test_a_pitch_that_is_not_positive_is_refused(mm_per_px):
    with pytest.raises(WedgeError, match="mm_per_px"):
        infer_missing_axis(np.zeros((32, 32)), "x", mm_per_px)
