# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
import hashlib
import json

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from safetensors.numpy import save_file

from recon.ball import ball_cap
from recon.missing_axis.inference import infer_missing_axis
from recon.unet.weights import MISSING_AXIS, load_weights, save_weights, shipped_weights
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


def inferred(known, axis, mm_per_px=SQUARE, **options):
    """The slope along the missing axis."""
    return infer_missing_axis(known, axis, mm_per_px, **options).gradient[..., "xy".index(axis)]


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
        result = inferred(noisy(rng, gradient[..., known]), axis, mm_per_px, weights=weights)
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
    assert np.abs(inferred(noise, "x")).mean() <= 0.01
    nothing = inferred(np.zeros(size), "x")
    assert np.abs(nothing).mean() <= 0.002 and np.abs(nothing).max() <= 0.1


def test_the_missing_y_of_a_frame_is_the_missing_x_of_its_transpose():
    rng = np.random.default_rng(4)
    known = noisy(rng, random_ball(rng, 120, 90, (0.1, 0.12))[0][..., 0])
    of_y = infer_missing_axis(known, "y", (0.1, 0.12))
    of_x = infer_missing_axis(known.T, "x", (0.12, 0.1))
    swapped = of_x.gradient.transpose(1, 0, 2)[..., ::-1]
    np.testing.assert_array_equal(of_y.gradient, swapped)
    np.testing.assert_array_equal(of_y.doubt, of_x.doubt.T)
    assert np.abs(of_y.gradient[..., 1]).max() > 0.1


def test_only_the_ratio_of_the_pitches_counts():
    rng = np.random.default_rng(5)
    known = noisy(rng, random_ball(rng, 96, 64)[0][..., 1])
    here, elsewhere = (inferred(known, "x", pitch) for pitch in [(1.0, 1.0), (0.25, 0.25)])
    np.testing.assert_array_equal(here, elsewhere)


def test_a_frame_twice_as_fine_is_seen_as_the_frame_itself():
    rng = np.random.default_rng(7)
    known = noisy(rng, random_ball(rng, 320, 240)[0][..., 1])
    finer = inferred(known.repeat(2, 0).repeat(2, 1), "x", (0.05, 0.05))
    coarse = inferred(known, "x")
    np.testing.assert_allclose(finer, cv2.resize(coarse, (640, 480)), atol=1e-4)
    assert np.abs(coarse).max() > 0.3


@given(st.integers(1, 70), st.integers(1, 70), st.floats(0.2, 5), st.sampled_from("xy"))
@settings(max_examples=25, deadline=None)
def test_every_size_comes_back_as_it_went(height, width, ratio, axis):
    known = np.random.default_rng(height).normal(0, SLOPE_NOISE, (height, width))
    found = infer_missing_axis(known, axis, (0.1 * ratio, 0.1))
    assert found.gradient.shape == (*known.shape, 2) and found.gradient.dtype == np.float32
    assert np.isfinite(found.gradient).all() and np.abs(found.gradient).mean() < 0.1
    assert found.doubt.shape == known.shape and found.doubt.min() >= 0


def test_a_contact_on_the_border_stays_bounded():
    gradient = ball_cap((160, 120), (0.0, 60.0), 4.0, 5.0, SQUARE).gradient
    result = inferred(gradient[..., 1], "x")
    assert np.abs(result - gradient[..., 0]).sum() < np.abs(gradient[..., 0]).sum()


def test_where_the_gel_cannot_have_moved_nothing_is_inferred_and_nothing_looked_at():
    rng = np.random.default_rng(8)
    gradient, contact = random_ball(rng, 120, 90)
    around = cv2.dilate(contact.astype(np.uint8), np.ones((7, 7))).astype(bool)
    clean, stained = gradient[..., 1].copy(), gradient[..., 1].copy()
    stained[~around] = 0.3
    first, again = (infer_missing_axis(k, "x", SQUARE, support=around) for k in (clean, stained))
    np.testing.assert_array_equal(first.gradient, again.gradient)
    assert not first.gradient[~around].any() and not first.doubt[~around].any()


def test_doubt_is_large_where_the_error_is():
    rng = np.random.default_rng(9)
    errors, doubts = [], []
    for _ in range(6):
        gradient, _ = random_ball(rng, 160, 120)
        found = infer_missing_axis(noisy(rng, gradient[..., 1]), "x", SQUARE)
        errors.append(np.abs(found.gradient[..., 0] - gradient[..., 0]).ravel())
        doubts.append(found.doubt.ravel())
    error, doubt = np.concatenate(errors), np.concatenate(doubts)
    order = np.argsort(doubt)
    sure, unsure = error[order[: len(order) // 2]], error[order[-len(order) // 10 :]]
    assert unsure.mean() > 5 * sure.mean()
    assert 0.3 < doubt.mean() / error.mean() < 3


def test_weights_come_back_as_written_and_always_as_the_same_bytes(tmp_path):
    one, two = tmp_path / "one.safetensors", tmp_path / "two.safetensors"
    for path in (one, two):
        save_weights(path, shipped_weights(), "python -m recon.training.missing_axis", 0)
    assert one.read_bytes() == two.read_bytes()
    for name, values in load_weights(one).items():
        np.testing.assert_array_equal(values, shipped_weights()[name])


def test_shipped_weights_are_small_and_their_readme_names_them():
    content = MISSING_AXIS.file.read_bytes()
    readme = MISSING_AXIS.file.with_name("README.md").read_text()
    length = int.from_bytes(content[:8], "little")
    made = json.loads(json.loads(content[8 : 8 + length])["__metadata__"]["missing_axis"])
    assert len(content) <= 1_000_000
    assert hashlib.sha256(content).hexdigest() in readme
    assert made["command"] in readme


def altered(path, change):
    content = bytearray(MISSING_AXIS.file.read_bytes())
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
            lambda content: content.replace(b'\\"version\\": \\"3', b'\\"version\\": \\"9'),
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
        inferred(known, "x")


@pytest.mark.parametrize("mm_per_px", [(0.0, 0.1), (0.1, -0.1), (0.1, float("nan"))])
def test_a_pitch_that_is_not_positive_is_refused(mm_per_px):
    with pytest.raises(WedgeError, match="mm_per_px"):
        inferred(np.zeros((32, 32)), "x", mm_per_px)
