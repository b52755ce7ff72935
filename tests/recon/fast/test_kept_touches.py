# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Touches that are kept while the next frames come never mix two of them."""

import copy
from dataclasses import replace

import numpy as np
import pytest

from recon.fast import FastReconstructor, Touch
from recon.plausible import cut_word, doubt_word
from sensor.errors import WedgeError
from tests.dotted import HEIGHT, WIDTH, dotted, grid_px
from tests.recon.fast.units import make_unit, pressed, random_default

LATE = ("contact", "deepest_mm", "contact_mm2", "patches", "slope_error", "shadow", "markers")
ARRAYS = ("difference", "gradient", "depth_mm", "disturbed")
UNIT = make_unit(estimator=random_default(), lights_deg={"R": 0.0, "G": 120.0, "B": 240.0})
FRAMES = [pressed(UNIT.background, (x, 60.0), int(x)) for x in (40.0, 80.0, 120.0)]


def told(touch: Touch) -> dict:
    """All that it says."""
    return {name: copy.deepcopy(getattr(touch, name)) for name in (*ARRAYS, *LATE)}


def same(touch: Touch, truth: dict) -> None:
    for name, wanted in truth.items():
        np.testing.assert_equal(getattr(touch, name), wanted, err_msg=name)


@pytest.mark.parametrize("late", LATE)
def test_what_the_next_frame_has_overwritten_is_not_told(late: str) -> None:
    reconstruct = FastReconstructor(UNIT)
    first, second = (reconstruct(frame) for frame in FRAMES[:2])
    for stale in (first, copy.copy(first), copy.deepcopy(first)):
        with pytest.raises(WedgeError, match=r"has overwritten this touch: ask it before, or keep"):
            getattr(stale, late)
    getattr(second, late)


@pytest.mark.parametrize("word", [doubt_word, cut_word])
def test_no_word_is_said_on_a_touch_of_which_the_next_frame_has_overwritten_the_arrays(
    word,
) -> None:
    reconstruct = FastReconstructor(UNIT)
    stale = reconstruct(FRAMES[0])
    kept = copy.deepcopy(stale)
    reconstruct(FRAMES[1])
    with pytest.raises(WedgeError, match="has overwritten this touch"):
        word(stale, UNIT)
    assert word(kept, UNIT) == word(FastReconstructor(UNIT)(FRAMES[0]), UNIT)


def test_what_was_asked_before_stays() -> None:
    reconstruct = FastReconstructor(UNIT)
    first = reconstruct(FRAMES[0])
    before = {name: copy.deepcopy(getattr(first, name)) for name in LATE}
    assert before["deepest_mm"] > 0 and before["shadow"].any() and before["slope_error"].any()
    for frame in FRAMES[1:]:
        reconstruct(frame)
    same(first, before)


def test_a_deep_copy_stays_good() -> None:
    reconstruct, truths = FastReconstructor(UNIT), []
    for frame in FRAMES:
        truths.append(told(FastReconstructor(UNIT)(frame)))
    kept = [copy.deepcopy(reconstruct(frame)) for frame in FRAMES]
    for touch, truth in zip(kept, truths, strict=True):
        same(touch, truth)
    assert len({truth["deepest_mm"] for truth in truths}) == len(FRAMES)


def test_a_deep_copy_of_a_marker_gel_s_touch_stays_good() -> None:
    places = grid_px()
    blank, *frames = (
        np.round(255 * dotted(places + shift)).clip(0, 255).astype(np.uint8)
        for shift in (0.0, 0.7, 1.4)
    )
    unit = make_unit((WIDTH, HEIGHT), markers={"count": float(len(places))})
    reconstruct = FastReconstructor(replace(unit, background=blank))
    kept = copy.deepcopy(reconstruct(frames[0]))
    reconstruct(frames[1])
    assert kept.markers == "tracked" and kept.contact.shape == (HEIGHT, WIDTH)


def test_only_a_frame_that_is_taken_in_overwrites_the_last_touch() -> None:
    reconstruct = FastReconstructor(UNIT)
    touch = reconstruct(FRAMES[0])
    truth = told(FastReconstructor(UNIT)(FRAMES[0]))
    for refused in (np.zeros((60, 80, 3), np.uint8), b"no JPEG"):
        with pytest.raises(WedgeError):
            reconstruct(refused)
    FastReconstructor(UNIT)(FRAMES[1])
    same(touch, truth)
