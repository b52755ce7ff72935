# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""What the network that knows a light learns from, and that it learns."""

from dataclasses import fields

import numpy as np
import pytest

from recon.estimators import fit_estimator, lesson_of
from recon.presses import read_presses
from recon.rendered_presses import depth_files, rendered_presses
from sensor.errors import WedgeError
from tests.synthetic import MM_PER_PX, make_dataset, make_rendered_set

pytest.importorskip("torch")

from recon.training import contact_in_light as training
from recon.training.contact_in_light import LitPress, Pad

SHAPE = (128, 160)
LIGHTS = np.array([[0, 1], [1, 0], [0, -1]], np.float32)
"""Toward red, green and blue."""


def dent(x_px, y_px, wide_px=12.0):
    """A smooth dent, lit from three sides and read exactly, held where it is deeper than half."""
    y, x = np.mgrid[: SHAPE[0], : SHAPE[1]].astype(np.float32)
    x, y = x - x_px, y - y_px
    depth = 5 * np.exp(-(x**2 + (1.5 * y) ** 2) / wide_px**2)
    gradient = np.stack([-2 * x, -4.5 * y], -1) / wide_px**2 * depth[..., None]
    return LitPress(
        difference=(0.1 * gradient @ LIGHTS.T).astype(np.float16),
        gradient=gradient[None].astype(np.float16),
        depth_px=depth[None].astype(np.float16),
        held=depth > 2.5,
    )


@pytest.fixture
def pad():
    where = np.stack(np.meshgrid(np.linspace(-1, 1, SHAPE[1]), np.linspace(-1, 1, SHAPE[0])), -1)
    return Pad(blank=np.full((*SHAPE, 3), 0.4, np.float32), position=where.astype(np.float32))


def same(one, two):
    for item in fields(LitPress):
        np.testing.assert_array_equal(getattr(one, item.name), getattr(two, item.name))


def test_the_mirror_image_of_a_press_is_the_press_mirrored():
    same(training.mirrored(dent(60, 40)), dent(60, SHAPE[0] - 1 - 40))
    same(training.mirrored(training.mirrored(dent(60, 40))), dent(60, 40))


def test_batches_repeat_and_show_the_truth_where_it_is_deep(pad):
    presses = [dent(60, 40), dent(90, 70, 20.0)]
    often = training.how_often(presses)
    assert often.sum() == pytest.approx(1) and often[0] > often[1]
    maps, truth = training.lit_batch(presses, often, pad, 0, 5)
    again, _ = training.lit_batch(presses, often, pad, 0, 5)
    np.testing.assert_array_equal(maps, again)
    other, _ = training.lit_batch(presses, often, pad, 0, 6)
    assert (maps != other).any()
    assert maps.shape == (training.FRAMES, 9, training.SIDE_PX, training.SIDE_PX)
    for seen, held in zip(maps, truth, strict=True):
        assert held.any() and seen[2][held].min() > 0.9 * seen[2][~held].max()
        assert (np.diff(seen[7], axis=1) > 0).all() and (np.diff(seen[8], axis=0) > 0).all()


def test_a_short_training_learns_what_is_held(pad, monkeypatch):
    monkeypatch.setattr(training, "FRAMES", 3)
    presses = [dent(60, 40), dent(90, 70, 20.0), dent(70, 60, 8.0)]
    _, losses = training.train(presses, pad, 12, 0)
    assert np.mean(losses[-3:]) < 0.9 * losses[0]
    weights, same_losses = training.train(presses, pad, 12, 0)
    assert losses == same_losses
    weights = {**weights, "last.weight": 0 * weights["last.weight"]}
    for score, expected in ((1, np.mean([press.held.mean() for press in presses])), (-1, 0)):
        weights["last.bias"] = np.float32([score])  # all of the gel is held, or none
        assert training.overlap(weights, presses, pad) == pytest.approx(expected)


def test_presses_are_read_by_every_calibration(tmp_path, monkeypatch):
    monkeypatch.setattr(training, "PITCH_MM", MM_PER_PX[0])
    presses = read_presses(make_dataset(tmp_path / "balls", seed=1)).presses
    lesson = lesson_of("table", presses, range(len(presses)), 0)
    sensor = fit_estimator("table", lesson, "RGB", 0)
    made = make_rendered_set(tmp_path / "set", presses=2)
    found = list(training.lit_presses([sensor, sensor], [made.folder]))
    for press, truth in zip(found, rendered_presses(made.folder), strict=True):
        assert len(press.gradient) == len(press.depth_px) == 2
        np.testing.assert_array_equal(press.held, truth.held)
        np.testing.assert_array_equal(press.difference, truth.difference.astype(np.float16))
    monkeypatch.setattr(training, "PITCH_MM", 2 * MM_PER_PX[0])
    with pytest.raises(WedgeError, match="not of the standard design"):
        list(training.lit_presses([sensor], [made.folder]))
    (made.folder / "held" / depth_files(made.folder)[0].name).unlink()
    with pytest.raises(WedgeError, match="render the set anew"):
        list(training.lit_presses([sensor], [made.folder]))


def test_what_no_colour_tells_of_is_not_learnt_from(tmp_path, monkeypatch):
    monkeypatch.setattr(training, "PITCH_MM", MM_PER_PX[0])
    made = make_rendered_set(tmp_path / "set", presses=1)
    for path in (made.folder / "held").iterdir():
        np.save(path, np.zeros_like(np.load(path)))
    assert not list(training.lit_presses([], [made.folder]))
