# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from recon.windows import window_about

PLACES = st.lists(st.tuples(st.integers(0, 19), st.integers(0, 29)), min_size=1, max_size=5)
MARGINS = st.integers(0, 40)


@given(PLACES, MARGINS | st.tuples(MARGINS, MARGINS))
def test_a_window_holds_all_and_no_more_than_its_margin(places, margin_px):
    some = np.zeros((20, 30), bool)
    some[tuple(zip(*places, strict=True))] = True
    window = window_about(some, margin_px)
    assert some[window].sum() == some.sum()
    margins = (margin_px, margin_px) if isinstance(margin_px, int) else margin_px
    for axis, (part, margin) in enumerate(zip(window, reversed(margins), strict=True)):
        along = [place[axis] for place in places]
        assert part.start == max(0, min(along) - margin)
        assert part.stop == min(some.shape[axis], max(along) + margin + 1)


def test_about_nothing_there_is_no_window():
    with pytest.raises(IndexError):
        window_about(np.zeros((4, 5), bool), 1)
