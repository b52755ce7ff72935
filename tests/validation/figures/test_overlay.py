# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Clips hold what came, evenly, and frames show where dots went."""

import io

import numpy as np
import pytest
from PIL import Image

from recon.markers.tracking import marker_tracker
from tests.dotted import HEIGHT, WIDTH, dotted, grid_px
from validation.figures import overlay
from validation.figures.markers import EXAGGERATED, marker_overlay
from validation.figures.overlay import WIDTH_PX, Clip

PLACES = grid_px(40.0)


def moved(by_px):
    image = np.full((HEIGHT, WIDTH, 3), 0.5)
    tracker = marker_tracker(dotted(PLACES, image=image, noise=0.0))
    return tracker.track(dotted(PLACES + np.array(by_px), image=image, noise=0.0))


@pytest.mark.parametrize("count", [1, 5, 6, 41])
def test_a_clip_of_any_length_is_short_and_even(monkeypatch, count):
    monkeypatch.setattr(overlay, "MOST_PICTURES", 5)
    clip = Clip()
    for level in range(count):
        clip.add(np.full((8, 8, 3), 5 * level, np.uint8))
    with Image.open(io.BytesIO(clip.webp())) as read:
        levels = []
        for index in range(read.n_frames):
            read.seek(index)
            levels.append(round(np.asarray(read.convert("RGB")).mean() / 5))
    steps = np.diff([0, *levels]) if count > 1 else [0]
    assert levels[0] == 0 and len(levels) <= 5
    assert len(set(steps[1:])) <= 1 and (count < 6 or len(levels) >= 3)


def test_an_arrow_leads_from_rest_to_three_times_the_way():
    black = np.zeros((HEIGHT, WIDTH, 3), np.float32)
    tracked, scale = moved((4.0, 0.0)), WIDTH_PX / WIDTH
    drawn = marker_overlay(black, tracked, (0.1, 0.1))[: round(HEIGHT * scale)]
    rest_px = tracked.markers.position_px[len(PLACES) // 2]
    row = drawn[round((rest_px[1] + 0.5) * scale)].sum(-1) / (3 * 255)
    start, end = (round((rest_px[0] + 0.5 + way) * scale) for way in (0, EXAGGERATED * 4))
    assert row[start + 2 : end - 2].min() > 0.5
    between = row[end + 4 : start + round(40 * scale) - 4]  # the next dot rests there
    assert between.max() == 0


def test_nothing_is_drawn_of_dots_that_are_lost():
    black = np.zeros((HEIGHT, WIDTH, 3), np.float32)
    tracker = marker_tracker(dotted(PLACES))
    lost = tracker.track(dotted(PLACES[:2]))
    shown = marker_overlay(black, lost, (0.1, 0.1))
    assert lost.word == "lost" and not shown[: round(HEIGHT * WIDTH_PX / WIDTH)].any()
    assert shown.any()  # the word
