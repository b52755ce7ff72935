# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Found circles of one sensor are all centred by their outlines, or all by their shading."""

from hypothesis import given
from hypothesis import strategies as st

from recon.labels.circles import Circle
from recon.labels.find_circles import FEWEST, WIDEST_SPREAD, agreed

OUTLINE, SHADING = (10.0, 20.0), (11.0, 22.0)


def circles(spreads: list[float | None]) -> dict[str, Circle]:
    """One for each spread of its outline; none where the shading centres it."""
    return {
        f"{i}.png": Circle(
            center_px=SHADING if spread is None else OUTLINE,
            radius_px=5.0,
            quality=0.9,
            shading_px=SHADING,
            spread=spread,
        )
        for i, spread in enumerate(spreads)
    }


SPREADS = st.lists(st.none() | st.floats(0, 0.2), max_size=12)


@given(SPREADS)
def test_centers_are_all_as_found_or_all_the_shading_s(spreads: list[float | None]) -> None:
    before = circles(spreads)
    after = agreed(before)
    shaded = {one.center_px for one in after.values()} <= {SHADING}
    assert list(after) == list(before)
    assert after == before or shaded
    assert [one.radius_px for one in after.values()] == [5.0] * len(after)
    assert agreed(after) == after


def test_most_of_the_outlines_decide() -> None:
    wide, narrow = 2 * WIDEST_SPREAD, WIDEST_SPREAD / 2
    assert agreed(circles([wide] * 4 + [narrow] * 3))["6.png"].center_px == SHADING
    assert agreed(circles([wide] * 3 + [narrow] * 4))["0.png"].center_px == OUTLINE


def test_too_few_outlines_decide_nothing() -> None:
    few = circles([0.2] * (FEWEST - 1) + [None] * 3)
    assert agreed(few) == few
