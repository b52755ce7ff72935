# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""A frame in another light says what it says in the blank frame's; touches are no light."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from recon.fast import FastReconstructor
from recon.images import read_image, write_image
from recon.pipeline import Reconstructor
from recon.presses import press_reader, read_presses
from recon.same_light import LARGEST_CHANGE, brightness, in_same_light
from tests.recon.fast.units import CORNERS_PX, make_unit, pressed, random_default
from tests.synthetic import make_dataset
from validation.acceptance.gel import as_seen
from validation.evaluation import in_light_of

few = settings(max_examples=30)
seeds = st.integers(0, 2**32 - 1)
changes = st.floats(0.06, LARGEST_CHANGE - 0.05).flatmap(
    lambda change: st.sampled_from([1 - change, 1 + change])
)
shapes = st.sampled_from([(60, 80), (231, 320), (240, 320), (320, 240), (7, 9)])


def blank_gel(shape, seed):
    """Uneven light, each colour's own."""
    y, x = np.indices(shape) / np.array(shape)[:, None, None]
    rng = np.random.default_rng(seed)
    slopes, level = rng.uniform(-0.25, 0.25, (2, 3)), rng.uniform(0.35, 0.6, 3)
    light = level + (x[..., None] - 0.5) * slopes[0] + (y[..., None] - 0.5) * slopes[1]
    return light.astype(np.float32)


def ball(blank, seed):
    """A contact of up to a sixth of the frame, its colours changed both ways."""
    height, width = blank.shape[:2]
    rng = np.random.default_rng(seed)
    center, radius = rng.uniform(0, 1, 2) * (height, width), 0.2 * min(height, width)
    dy, dx = (np.indices((height, width)) - center[:, None, None]) / radius
    inside = np.hypot(dx, dy) < 1
    return (inside[..., None] * np.stack([0.3 * dx, -0.2 * dy, -0.3 * dx], -1)).astype(np.float32)


@few
@given(seed=seeds, factor=changes, shape=shapes)
def test_brighter_and_darker_light_is_taken_off(seed, factor, shape):
    blank = blank_gel(shape, seed)
    touched = ball(blank, seed)
    frame = factor * (blank + touched)
    np.testing.assert_allclose(in_same_light(frame - blank, blank), touched, atol=5e-3)


@few
@given(seed=seeds, factor=changes)
def test_one_lamp_that_fades_is_told_and_leaves_the_others(seed, factor):
    blank = blank_gel((240, 320), seed)
    frame = blank * np.array([factor, 1, 1], np.float32)
    factors = brightness(*(np.moveaxis(image, -1, 0) for image in (frame - blank, blank)))
    np.testing.assert_allclose(factors, [factor, 1, 1], atol=2e-3)


@few
@given(seed=seeds, level=st.floats(-0.019, 0.019))
def test_a_slight_change_and_a_touch_stay_as_they_are(seed, level):
    blank = blank_gel((240, 320), seed)
    difference = (1 + level) * (blank + ball(blank, seed)) - blank
    assert in_same_light(difference, blank) is difference


@few
@given(seed=seeds, level=st.sampled_from([-0.06, 0.06, 0.1]))
def test_light_that_is_added_is_no_factor(seed, level):
    """Of the room, or a black level: differences between colours stay as large as they were."""
    blank = blank_gel((240, 320), seed)
    blank += 0.4 * (np.arange(320, dtype=np.float32)[:, None] / 320 - 0.5)  # one side is brighter
    difference = ball(blank, seed) + np.float32(level)
    assert in_same_light(difference, blank) is difference


@few
@given(seed=seeds, change=st.floats(0.05, 0.3))
def test_a_face_that_flattens_the_dome_is_no_light(seed, change):
    """It tilts skin one way on one side and the other way on the other."""
    blank = blank_gel((240, 320), seed)
    y, x = np.indices((240, 320)) / np.array([240, 320])[:, None, None] - 0.5
    difference = change * np.stack([x, y, -x], -1).astype(np.float32)
    assert in_same_light(difference, blank) is difference


@few
@given(seed=seeds, factor=st.floats(1.1, 1.4))
def test_light_on_two_thirds_of_the_frame_is_not_that_of_all(seed, factor):
    """As of a window, or of what is gripped: a third of the gel shows that no lamp is brighter."""
    blank = blank_gel((240, 320), seed)
    difference = (factor - 1) * blank
    difference[160:] = 0
    assert in_same_light(difference, blank) is difference


@few
@given(seed=seeds, lost=st.sampled_from([0.0, 0.3, 2.0]), color=st.integers(0, 2))
def test_nothing_is_divided_where_a_lamp_is_out_or_far_too_bright(seed, lost, color):
    """Else what little is left of it would be read as slopes, or as none at all."""
    blank = 0.4 * blank_gel((240, 320), seed)
    factors = np.full(3, 0.9, np.float32)
    factors[color] = lost
    difference = factors * blank - blank
    assert in_same_light(difference, blank) is difference


@few
@given(seed=seeds, color=st.integers(0, 2))
def test_a_colour_that_a_wide_touch_changes_is_not_divided_for_another_s_sake(seed, color):
    blank = blank_gel((240, 320), seed)
    factors = np.ones(3, np.float32)
    factors[color] = 1.15
    touched = np.zeros_like(blank)
    touched[:, :200] = np.where(np.arange(240) < 120, 0.08, -0.05)[:, None, None]
    touched[..., color] = 0
    difference = factors * (blank + touched) - blank
    expected = factors.copy()
    found = brightness(*(np.moveaxis(image, -1, 0) for image in (difference, blank)))
    np.testing.assert_allclose(found, expected, atol=0.01)


@pytest.mark.parametrize("level", [0.0, 0.03, 1.0])
def test_a_dark_or_saturated_blank_frame_tells_nothing(level):
    blank = np.full((240, 320, 3), level, np.float32)
    difference = 0.9 * blank - blank
    assert in_same_light(difference, blank) is difference


@pytest.mark.parametrize("kind", [Reconstructor, FastReconstructor])
@pytest.mark.parametrize("corners_px", [None, CORNERS_PX])
@pytest.mark.parametrize(
    ("background", "light"), [(None, 0.75), (None, 1.2), (0.7, 0.7), (1.2, 1.2), (0.7, 0.8)]
)
def test_depth_stays_when_the_light_does_not(kind, corners_px, background, light):
    unit = make_unit((160, 120), corners_px=corners_px, estimator=random_default())
    own = unit.background.clip(0, 200)  # 1.2 times as bright saturates nothing
    frame = pressed(own, (70, 60)).clip(0, 200)
    unit = replace(unit, background=own)
    blank = None if background is None else np.rint(background * own).astype(np.uint8)
    before = kind(unit)(frame).depth_mm.copy()
    after = kind(unit, blank)(np.rint(light * frame).astype(np.uint8)).depth_mm
    assert np.abs(after - before).max() < 0.08 * np.abs(before).max()


def test_presses_are_judged_in_the_light_of_the_unit_s_calibration(tmp_path):
    dataset = make_dataset(tmp_path / "set", presses=3)
    dim = make_dataset(tmp_path / "dim", presses=3)
    for path in dim.folder.glob("*.png"):
        write_image(path, np.rint(0.7 * read_image(path)).astype(np.uint8))
    usual, dimmed = read_presses(dataset), read_presses(dim)
    height, width = usual.background.shape[:2]
    unit = replace(make_unit((width, height)), background=usual.background)
    assert in_light_of(unit, usual) is usual
    for one, other in zip(usual.presses, in_light_of(unit, dimmed).presses, strict=True):
        np.testing.assert_allclose(other.difference, one.difference, atol=0.01)
        np.testing.assert_allclose(other.blank, one.blank, atol=0.01)


def test_a_press_tells_in_which_light_it_was_taken_and_how_the_camera_saw_it(tmp_path):
    dataset = make_dataset(tmp_path / "set", presses=2)
    file = dataset.labels[0].file
    dim = np.rint(0.7 * read_image(dataset.folder / file)).astype(np.uint8)
    reader = press_reader(dataset)
    usual = read_presses(dataset).presses[0].difference
    write_image(dataset.folder / file, dim)
    one, other = (reader.read(label) for label in dataset.labels)
    np.testing.assert_allclose(one.difference, usual, atol=0.01)
    assert one.light == pytest.approx((0.7, 0.7, 0.7), abs=0.01)
    assert other.light == (1, 1, 1) and as_seen(other) is other.difference
    np.testing.assert_allclose(as_seen(one) + reader.blank, reader.unwarp(dim), atol=1e-5)
