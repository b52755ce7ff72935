# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""What lies around a pixel is an input where it resembles the presses, and nowhere else."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from recon.ball import offsets_mm
from recon.estimators import fit_estimator, gradient_field, training_pixels
from recon.estimators.context import (
    BINS,
    NOVEL,
    fit_context,
    no_context,
    quartered,
    sampled,
    surroundings,
)
from recon.estimators.default import normal_of
from recon.estimators.lesson import elastic_fade
from recon.pixels import BallPress, join, positions

SIZE_PX = (240, 180)
MM_PER_PX = (0.1, 0.1)
BALL_MM = 4.0
AZIMUTHS = np.radians([90.0, 180.0, -90.0])
LIGHTS = np.stack([np.cos(AZIMUTHS), np.sin(AZIMUTHS)])


def lit(gradient, rng):
    """Matt gel under three far lights, with noise."""
    normal = normal_of(gradient.reshape(-1, 2)).reshape(gradient.shape)
    shaded = -0.4 * normal @ LIGHTS + rng.normal(0, 2 / 255, (*gradient.shape[:2], 3))
    return shaded.astype(np.float32)


def press(rng):
    """A ball somewhere in an elastic gel."""
    radius_mm = rng.uniform(1.4, 2.2)
    center_px = rng.uniform(50, 190), rng.uniform(50, 130)
    x_mm, y_mm = offsets_mm(SIZE_PX, center_px, MM_PER_PX)
    away = np.hypot(x_mm, y_mm)
    inside = np.minimum(away, radius_mm)
    slope = inside / np.sqrt(BALL_MM**2 - inside**2) * elastic_fade(away / radius_mm)
    outward = np.stack([x_mm, y_mm], -1) / np.maximum(away, 1e-9)[..., None]
    return BallPress(
        file="press.png",
        difference=lit((-outward * slope[..., None]).astype(np.float32), rng),
        center_px=center_px,
        contact_radius_px=radius_mm / MM_PER_PX[0],
        ball_radius_mm=BALL_MM,
        mm_per_px=MM_PER_PX,
    )


def grooved(rng):
    """A file's ridges, as steep as the balls, over the middle of the pad."""
    columns, rows = np.meshgrid(np.arange(SIZE_PX[0]), np.arange(SIZE_PX[1]))
    touched = (abs(columns - 120) < 60) & (abs(rows - 90) < 45)
    slope = np.where((columns + rows) // 5 % 2 == 0, 0.3, -0.3) * touched
    return lit(np.stack([slope, slope], -1).astype(np.float32), rng)


@pytest.fixture(scope="module")
def estimator():
    pytest.importorskip("torch")
    from recon.estimators import default_training

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(default_training, "STEPS", 800)
        patch.setattr(default_training, "BATCH", 128)
        rng = np.random.default_rng(0)
        taught = [training_pixels("default", press(rng), i, 0) for i in range(6)]
        return fit_estimator("default", join(taught), "RGB", 0)


def test_a_ball_is_familiar_and_a_file_is_not(estimator):
    rng, familiar = np.random.default_rng(1), []
    for _ in range(8):
        ball = press(rng)
        x_mm, y_mm = offsets_mm(SIZE_PX, ball.center_px, MM_PER_PX)
        touched = np.hypot(x_mm, y_mm) < ball.contact_radius_mm
        familiar.append(estimator.prepared(ball.difference)[touched, 6].mean())
    assert np.mean(familiar) > 0.5
    assert estimator.prepared(grooved(rng))[50:130, 65:175, 6].max() < 0.1


def test_a_novel_surrounding_is_withheld_and_the_slopes_are_those_of_each_pixel_alone(estimator):
    difference = grooved(np.random.default_rng(2))
    prepared = estimator.prepared(difference)
    novel = prepared[..., 6] == 0
    assert novel[50:130, 65:175].mean() > 0.5 and (prepared[novel][:, 3:] == 0).all()
    alone = estimator.slopes(prepared[novel][:, :3], positions(SIZE_PX)[novel])
    np.testing.assert_allclose(gradient_field(estimator, difference)[novel], alone, atol=1e-5)


def test_a_familiar_surrounding_is_looked_at(estimator):
    ball = press(np.random.default_rng(3))
    with_it = gradient_field(estimator, ball.difference)
    blind = replace(estimator, context=replace(estimator.context, limit=np.zeros(1, np.float32)))
    assert np.abs(with_it - gradient_field(blind, ball.difference)).max() > 1e-3


def test_nobody_who_learnt_no_surroundings_finds_any_familiar(estimator):
    ball = press(np.random.default_rng(4))
    none = replace(estimator, context=no_context(3, 8))
    assert (none.prepared(ball.difference)[..., 3:] == 0).all()


def test_the_interval_of_a_slope_is_between_those_of_given_and_withheld_surroundings(estimator):
    slopes = np.random.default_rng(5).uniform(-0.4, 0.4, (50, 2)).astype(np.float32)
    withheld, half, given = (
        estimator.half_width(slopes, np.full(50, familiar, np.float32))
        for familiar in (0.0, 0.5, 1.0)
    )
    np.testing.assert_allclose(half, (withheld + given) / 2, rtol=1e-5)
    np.testing.assert_array_equal(given, estimator.half_width(slopes))


def learnt(rng, presses=10, each=400):
    """Surroundings that scatter by 1 % of full scale around what is expected, which is none."""
    count = presses * each
    around = rng.normal(0, 0.01, (count, 3)).astype(np.float32)
    layers = no_context(3, 8).layers
    strength = rng.uniform(0.5, 2, count).astype(np.float32)
    press = np.repeat(np.arange(presses), each)
    return fit_context(layers, around, strength, press, np.zeros_like(around))


def test_as_many_held_out_pixels_are_novel_as_was_said():
    rng = np.random.default_rng(6)
    context = learnt(rng)
    strength = np.ones(20_000, np.float32)
    own = np.zeros((len(strength), 8), np.float32)
    around = rng.normal(0, 0.01, (len(strength), 3)).astype(np.float32)
    assert context.novel(own, around, strength).mean() == pytest.approx(NOVEL, abs=0.01)
    assert context.novel(own, around + np.float32(0.1), strength).all()
    assert context.precision.shape == (BINS, 3, 3)


@given(st.floats(0, 1))
def test_a_region_is_familiar_up_to_the_limit_and_not_from_twice_as_much(share):
    context = replace(learnt(np.random.default_rng(7)), limit=np.array([0.1], np.float32))
    shape = 64, 64
    novel = np.random.default_rng(8).permutation(64 * 64) < share * 64 * 64
    familiar = context.familiar(novel, np.ones(len(novel), np.float32), shape)
    assert familiar.min() >= 0 and familiar.max() <= 1
    if share < 0.08:
        assert familiar.mean() > 0.95
    if share > 0.25:
        assert familiar.mean() < 0.05


def test_gel_of_one_colour_or_of_a_steady_change_has_no_surroundings():
    columns = np.arange(320, dtype=np.float32)
    steady = np.repeat(columns[None, :, None] / 1000, 240, 0).repeat(3, 2)
    around = surroundings(quartered(steady))
    assert np.abs(around[:, 8:-8]).max() < 1e-5
    assert around.shape == (60, 80, 3)


@given(st.integers(1, 700))
def test_what_is_sampled_lies_in_the_frame_once_for_every_second_average(length_px):
    rows = sampled(length_px)
    assert rows.min() >= 0 and rows.max() < length_px
    assert len(rows) == len(np.arange(-(-length_px // 4))[::2])
