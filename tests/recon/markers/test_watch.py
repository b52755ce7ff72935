# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest

from recon.markers.watch import DotWatch
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
