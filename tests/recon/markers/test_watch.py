# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest

from recon.markers.watch import MOST_HIDDEN, DotWatch
from tests.dotted import dotted, grid_px, pad

PLACES = grid_px(20.0)
MARKED, PLAIN = dotted(PLACES), pad().astype(np.float32)


@pytest.mark.parametrize(
    ("recorded", "same", "few"),
    [
        ({"count": float(len(PLACES))}, "tracked", "lost"),
        (None, "dots, but the unit was calibrated without", "lost"),
    ],
)
def test_that_dots_are_lost_comes_before_that_the_gel_is_not_the_unit_s(recorded, same, few):
    watch = DotWatch(MARKED, recorded)
    assert watch.tracker is not None
    for frame, word in ((MARKED, same), (dotted(PLACES[:9]), few)):
        assert word in watch.word(watch.tracker.track(frame))


def test_without_dots_on_the_blank_frame_the_unit_is_asked_then_the_frame():
    missed, clear = DotWatch(PLAIN, {"count": 60.0}), DotWatch(PLAIN, None)
    assert missed.tracker is None and "the unit has 60" in missed.word(None)
    assert clear.word(None) == ""
    assert clear.unexpected(PLAIN) == "none"
    assert "the blank frame has none" in clear.unexpected(MARKED)


@pytest.mark.parametrize(
    ("spacing_px", "radius_px", "said"), [(9.0, 2.0, True), (20.0, 3.0, False)]
)
def test_dots_that_hide_nearly_all_of_the_gel_once_they_move_are_said(spacing_px, radius_px, said):
    places = grid_px(spacing_px, margin_px=3.0)
    watch = DotWatch(dotted(places, radius_px), {"count": float(len(places))})
    assert watch.tracker is not None
    still = watch.tracker.track(watch.blank)
    assert watch.word(still) == "tracked"
    moved = watch.tracker.track(dotted(places + np.array([3.0, 2.0]), radius_px), still)
    assert ("they hide" in watch.word(moved)) == said
    assert (watch.tracker.hidden(moved).mean() > MOST_HIDDEN) == said
