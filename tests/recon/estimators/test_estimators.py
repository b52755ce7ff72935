# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""One contract, held by every estimator that has a name."""

from contextlib import contextmanager
from dataclasses import replace

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from recon.estimators import (
    ESTIMATORS,
    GradientEstimator,
    as_labelled,
    fit_estimator,
    gradient_field,
    restore_estimator,
    slopes_at,
)
from recon.estimators.default import Default, prepared_colors
from recon.estimators.effort import Effort
from recon.estimators.lookup_table import BINS, fit_lookup_table
from recon.estimators.mlp import Mlp
from recon.estimators.surroundings import ASPECTS
from recon.pixels import Pixels, join, label_pixels, positions
from recon.presses import read_presses
from sensor.errors import WedgeError
from tests.synthetic import make_dataset

EVERY = pytest.mark.parametrize("name", list(ESTIMATORS))
PREPARED = 3 * (1 + ASPECTS)
"""Columns that `default` prepares of a pixel."""
CHANNELS = ("RGB", "RB", "RG", "GB", "R", "G", "B")
JUDGED = ("RGB", "RB")
"""Channels with which errors are measured; what holds however long one trains trains briefly."""
STEPS, FEW_STEPS = 400, 40


@pytest.fixture(scope="module")
def presses(tmp_path_factory):
    return read_presses(make_dataset(tmp_path_factory.mktemp("set"), presses=12)).presses


@pytest.fixture(scope="module")
def pixels(presses):
    """Labelled pixels, with all that each estimator looks at."""
    labelled = [label_pixels(press, i, 0) for i, press in enumerate(presses)]
    prepared = [prepared_colors(press.difference).reshape(-1, PREPARED) for press in presses]
    with_around = [
        replace(some, color=seen[some.place]) for some, seen in zip(labelled, prepared, strict=True)
    ]
    made = {width(name): join(labelled) for name in ESTIMATORS} | {PREPARED: join(with_around)}
    return lambda name: made[width(name)]


@pytest.fixture(scope="module")
def fitted(pixels):
    """Each estimator on ten presses, for any channels, fitted when it is first asked for."""
    pytest.importorskip("torch")
    made = {}

    def fit(name, channels="RGB"):
        if (name, channels) not in made:
            train = pixels(name)[pixels(name).press < 10]
            with training_of(STEPS if channels in JUDGED else FEW_STEPS):
                made[name, channels] = fit_estimator(name, train, channels, seed=0)
        return made[name, channels]

    return fit


@pytest.fixture(autouse=True, scope="module")
def short_training():
    pytest.importorskip("torch")
    with training_of(FEW_STEPS):
        yield


@contextmanager
def training_of(steps):
    """Shorter than users wait for; `mlp`, which has no choice, still learns well."""
    from recon.estimators import default_training, mlp_training

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(mlp_training, "EPOCHS", 12)
        patch.setattr(default_training, "STEPS", steps)
        patch.setattr(default_training, "BATCH", 128)
        yield


def width(name):
    """Columns that an estimator prepares of a pixel."""
    return PREPARED if name == "default" else 3


def random_pixels(seed, count, name="mlp"):
    rng = np.random.default_rng(seed)
    color = rng.uniform(-0.4, 0.4, (count, width(name))).astype(np.float32)
    return color, rng.uniform(-1, 1, (count, 2)).astype(np.float32)


@EVERY
def test_presses_held_out_are_seen_with_a_small_error(fitted, pixels, name):
    held_out = pixels(name)[pixels(name).press >= 10]
    found, contact = fitted(name).slopes(held_out.color, held_out.position), held_out.contact
    error, truth = np.abs(found - held_out.gradient), held_out.gradient
    assert np.abs(truth[contact]).mean() > 0.1
    assert error[contact].mean() <= 0.02 and error[~contact].mean() <= 0.01
    gain = (found * truth).sum(0) / (truth**2).sum(0)
    np.testing.assert_allclose(gain, 1, atol=0.05)


def test_who_looks_around_tells_a_slope_that_its_lights_do_not_show(fitted, pixels):
    share = {}
    for name, kind in (("default", Default), ("mlp", Mlp)):
        held_out = pixels(name)[(pixels(name).press >= 10) & pixels(name).contact]
        found = fitted(name, "RB").slopes(held_out.color, held_out.position)[:, 0]
        across = held_out.gradient[:, 0]
        share[kind.looks_around] = np.abs(found - across).mean() / np.abs(across).mean()
    assert share[True] < 0.5 < share[False]


@EVERY
def test_a_whole_frame_gives_a_gradient_field_of_its_shape(fitted, presses, name):
    press = presses[11]
    field = gradient_field(fitted(name), press.difference)
    assert field.shape == (*press.difference.shape[:2], 2) and field.dtype == np.float32
    one = label_pixels(press, 0, 0)
    rows, columns = np.unravel_index(one.place, press.difference.shape[:2])
    direct = slopes_at(fitted(name), press.difference, one)
    as_meant = as_labelled(fitted(name), field[rows, columns], one)
    np.testing.assert_allclose(as_meant, direct, atol=1e-5)


def test_at_half_a_large_frame_s_resolution_slopes_are_those_of_every_pixel(fitted, presses):
    estimator = fitted("default")
    large = cv2.resize(presses[11].difference, (640, 480), interpolation=cv2.INTER_CUBIC)
    place = positions((640, 480)).reshape(-1, 2)
    every = estimator.slopes(estimator.prepared(large).reshape(len(place), -1), place)
    field = gradient_field(estimator, large)
    assert estimator.asked(large).shape[:2] == (240, 320)
    assert field.shape == (480, 640, 2)
    error = field.reshape(-1, 2) - every
    assert np.sqrt(np.mean(error**2)) < 0.025 * np.sqrt(np.mean(every**2))


@EVERY
@pytest.mark.parametrize("channels", ["RGB", "RB", "G"])
def test_what_it_learnt_comes_back_bit_by_bit(fitted, name, channels):
    estimator = fitted(name, channels)
    assert isinstance(estimator, GradientEstimator)
    assert estimator.name == name and estimator.channels == channels
    tensors = estimator.tensors()
    assert all(t.dtype == np.float32 and t.flags.c_contiguous for t in tensors.values())
    copies = {key: values.copy() for key, values in tensors.items()}
    again = restore_estimator(name, copies, channels)
    color, position = random_pixels(1, 9000, name)
    np.testing.assert_array_equal(again.slopes(color, position), estimator.slopes(color, position))


@EVERY
def test_the_same_seed_learns_the_same(pixels, name):
    one, two = (fit_estimator(name, pixels(name), "RGB", seed=5).tensors() for _ in range(2))
    assert one.keys() == two.keys()
    for key, values in one.items():
        np.testing.assert_array_equal(values, two[key])


@EVERY
def test_slopes_are_the_same_where_nobody_asks_how_unsure_they_are(fitted, pixels, name):
    train = pixels(name)[pixels(name).press < 10]
    bare = fit_estimator(name, train, "R", seed=0, effort=Effort.SLOPES)
    color, position = random_pixels(2, 500, name)
    slopes = bare.slopes(color, position)
    np.testing.assert_allclose(slopes, fitted(name, "R").slopes(color, position), atol=1e-3)
    assert bare.half_width(slopes) is None


def test_a_hasty_fit_takes_a_third_of_the_steps_and_tells_no_doubt(pixels, monkeypatch):
    from recon.estimators import default_training

    taken, descend = [], default_training.descend
    monkeypatch.setattr(
        default_training, "descend", lambda *of: taken.append(of[3]) or descend(*of)
    )
    efforts = Effort.SLOPES, Effort.HASTY
    made = [fit_estimator("default", pixels("default"), "RGB", 0, effort=one) for one in efforts]
    assert taken == [FEW_STEPS, FEW_STEPS // 3]
    assert made[1].half_width(np.zeros((1, 2), np.float32)) is None


def test_another_seed_trains_another_network(pixels):
    one, two = (fit_estimator("mlp", pixels("mlp"), "RGB", seed=seed).tensors() for seed in (5, 6))
    assert not np.array_equal(one["weight0"], two["weight0"])


def test_training_does_not_depend_on_the_callers_random_state(pixels):
    import torch

    made = []
    for state in (1, 2):
        torch.manual_seed(state)
        made.append(fit_estimator("mlp", pixels("mlp"), "RGB", seed=0).tensors()["weight0"])
    np.testing.assert_array_equal(*made)


@EVERY
@pytest.mark.parametrize("channels", CHANNELS)
def test_dropped_channels_are_not_looked_at(fitted, name, channels):
    if name == "mlp" and len(channels) == 2:
        channels = "RB"  # one pair is enough for what trains slowly
    estimator = fitted(name, channels)
    color, position = random_pixels(2, 200, name)
    changed = color.copy()
    for column, channel in enumerate("RGB"):
        if channel not in channels:
            changed[:, column::3] = np.linspace(-1, 1, 200)[:, None]
    expected = estimator.slopes(color, position)
    np.testing.assert_array_equal(estimator.slopes(changed, position), expected)
    for channel in channels:
        seen = color.copy()
        seen[:, "RGB".index(channel)] *= -1
        assert not np.array_equal(estimator.slopes(seen, position), expected)


@EVERY
def test_no_pixel_gives_no_slope(fitted, name):
    slopes = fitted(name).slopes(
        np.zeros((0, width(name)), np.float32), np.zeros((0, 2), np.float32)
    )
    assert slopes.shape == (0, 2) and slopes.dtype == np.float32


@EVERY
@given(seed=st.integers(0, 1000), count=st.integers(1, 40))
@settings(max_examples=20)
def test_each_pixel_is_judged_alone_whatever_its_place_in_the_list(fitted, name, seed, count):
    estimator = fitted(name)
    color, position = random_pixels(seed, count, name)
    order = np.random.default_rng(seed).permutation(count)
    slopes = estimator.slopes(color, position)
    # Rounding may depend on the row in a matrix product.
    np.testing.assert_allclose(
        estimator.slopes(color[order], position[order]), slopes[order], rtol=1e-5, atol=1e-5
    )
    alone = [estimator.slopes(color[[i]], position[[i]])[0] for i in range(count)]
    np.testing.assert_allclose(alone, slopes, rtol=1e-5, atol=1e-5)


@EVERY
def test_rows_beyond_one_chunk_are_judged_too(fitted, name):
    from recon.estimators.mlp import CHUNK_ROWS

    color, position = random_pixels(3, CHUNK_ROWS + 17, name)
    slopes = fitted(name).slopes(color, position)
    tail = slice(CHUNK_ROWS - 5, None)
    np.testing.assert_allclose(
        fitted(name).slopes(color[tail], position[tail]), slopes[tail], atol=1e-5
    )


@EVERY
def test_colours_beyond_all_that_was_learnt_stay_finite(fitted, name):
    color = np.tile(np.float32([[1, 1, 1], [-1, -1, -1], [1, -1, 1]]), width(name) // 3)
    assert np.isfinite(fitted(name).slopes(color, np.zeros((3, 2), np.float32))).all()


def test_the_table_is_blind_to_position_and_the_network_is_not(fitted):
    color, position = random_pixels(4, 50)
    table, network = fitted("table"), fitted("mlp")
    assert np.array_equal(table.slopes(color, position), table.slopes(color, -position))
    assert not np.array_equal(network.slopes(color, position), network.slopes(color, -position))


@EVERY
def test_one_pixel_is_enough_to_fit(pixels, name):
    some = pixels(name)
    estimator = fit_estimator(name, some[np.array([0])], "RGB", seed=0)
    assert np.isfinite(estimator.slopes(some.color[:5], some.position[:5])).all()


@EVERY
def test_progress_ends_at_one_and_never_goes_back(pixels, name):
    shares = []
    fit_estimator(name, pixels(name), "RGB", 0, shares.append)
    assert shares[-1] == 1.0 and shares == sorted(shares)


@EVERY
def test_arrays_that_are_not_its_own_are_refused(fitted, name):
    tensors = fitted(name).tensors()
    for key, values in tensors.items():
        if key not in ("reach", "unlike"):  # which units made before do without
            lacking = {k: v for k, v in tensors.items() if k != key}
            with pytest.raises(WedgeError, match=f"the {name} estimator lacks the array '{key}'"):
                restore_estimator(name, lacking, "RGB")
        with pytest.raises(WedgeError, match="do not fit"):
            restore_estimator(name, {**tensors, key: values[:-1]}, "RGB")
        with pytest.raises(WedgeError, match=f"{key} .* is not of finite float32"):
            restore_estimator(name, {**tensors, key: values.astype(np.float64)}, "RGB")
        holed = values.copy()
        holed.flat[0] = np.nan
        with pytest.raises(WedgeError, match=f"{key} .* is not of finite float32"):
            restore_estimator(name, {**tensors, key: holed}, "RGB")
    with pytest.raises(WedgeError, match="do not fit"):
        restore_estimator(name, tensors, "RB")


def test_an_unknown_name_is_refused_with_the_known_ones(pixels):
    with pytest.raises(
        WedgeError, match="no estimator is called 'cnn': known are default, mlp, table"
    ):
        fit_estimator("cnn", pixels("mlp"), "RGB", 0)
    with pytest.raises(WedgeError, match="no estimator is called 'cnn'"):
        restore_estimator("cnn", {}, "RGB")


def pixels_of(color, gradient):
    """Pixels of contact of which nothing else matters."""
    count = len(color)
    return Pixels(
        color=color,
        position=np.zeros((count, 2), np.float32),
        gradient=gradient,
        contact=np.ones(count, bool),
        press=np.zeros(count, np.int32),
        place=np.arange(count, dtype=np.int32),
        hidden=np.zeros(count, bool),
        blank=np.zeros((count, 3), np.float32),
        collar=np.full(count, np.nan, np.float32),
        cap=np.zeros(count, np.float32),
    )


def test_a_bin_holds_the_mean_of_its_pixels_and_an_empty_one_its_neighbours():
    red = np.array([-1, -1, -1, 1], np.float32)
    gradient = np.array([[1, 0], [2, 0], [6, 3], [-5, 5]], np.float32)
    made = pixels_of(np.stack([red, 0 * red, 0 * red], 1), gradient)
    table = fit_lookup_table(made, "R", 0, lambda _: None, Effort.WHOLE)
    probe = np.zeros((2, 3), np.float32)
    probe[:, 0] = [-1 + 0.4, 1 - 0.4]
    np.testing.assert_allclose(table.slopes(probe, np.zeros((2, 2), np.float32)), [[3, 1], [-5, 5]])
    assert table.bins.shape == (BINS, 2)


def test_the_table_tells_apart_all_colours_but_the_outermost_thousandth():
    red = np.linspace(-0.3, 0.3, 20_001, dtype=np.float32)
    made = pixels_of(np.stack([red, 0 * red, 0 * red], 1), np.stack([2 * red, -red], 1))
    table = fit_lookup_table(made, "R", 0, lambda _: None, Effort.WHOLE)
    probe = np.zeros((3, 3), np.float32)
    probe[:, 0] = [-0.29, 0.0, 0.29]
    found = table.slopes(probe, np.zeros((3, 2), np.float32))
    half_bin = 0.3 / BINS
    np.testing.assert_allclose(found, probe[:, :1] * [2, -1], atol=2 * half_bin + 1e-3)


def test_the_network_is_the_papers(fitted):
    shapes = {key: values.shape for key, values in fitted("mlp").tensors().items()}
    assert [shapes[f"weight{i}"] for i in range(4)] == [(5, 32), (32, 32), (32, 32), (32, 2)]
    values = np.concatenate(random_pixels(7, 10), 1) / [*fitted("mlp").color_scale, 1, 1]
    tensors = fitted("mlp").tensors()
    for index in range(3):
        values = np.tanh(values @ tensors[f"weight{index}"] + tensors[f"bias{index}"])
    values = values @ tensors["weight3"] + tensors["bias3"]
    np.testing.assert_allclose(fitted("mlp").slopes(*random_pixels(7, 10)), values, atol=1e-5)


@EVERY
def test_labels_and_slopes_differ_in_contact_alone_and_by_the_lean(fitted, pixels, name):
    estimator, some = fitted(name), pixels(name)[np.arange(0, len(pixels(name)), 7)]
    lean = estimator.lean(some.position)
    assert lean.shape == some.position.shape and np.isfinite(lean).all()
    shifted = as_labelled(estimator, some.gradient, some) - some.gradient
    np.testing.assert_allclose(shifted[some.contact], -lean[some.contact], atol=1e-6)
    assert (shifted[~some.contact] == 0).all()
    assert np.abs(lean).max() < 0.02  # the synthetic gel is flat
