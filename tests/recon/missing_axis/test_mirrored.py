# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""What the frame cuts along the lights is mirrored, what ends inside is not."""

import numpy as np
import pytest

from recon.ball import BallCap, ball_cap
from recon.lights import Axis
from recon.missing_axis.mirrored import is_cut_twice, mirrored, rows_beyond, within

SIZE_PX = (160, 120)
RADIUS_PX = 24.0


def cap_at(
    across: float, along: float, unseen: Axis, size_px: tuple[int, int] = SIZE_PX
) -> BallCap:
    """A ball, its place given in pixels across the lights and along them."""
    center = (across, along) if unseen == "x" else (along, across)
    return ball_cap(size_px, center, 2.4, 3.0, (0.1, 0.1))


def lines_px(unseen: Axis, size_px: tuple[int, int] = SIZE_PX) -> int:
    """How long the lines of lights are."""
    return size_px[1] if unseen == "x" else size_px[0]


@pytest.mark.parametrize("unseen", ["x", "y"])
@pytest.mark.parametrize("inside", [-0.4, 0.0, 0.4, 0.8])
def test_a_ball_is_mirrored_beyond_the_edge_that_cuts_it(inside, unseen) -> None:
    rows = lines_px(unseen)
    first = cap_at(50.0, inside * RADIUS_PX, unseen)
    last = cap_at(50.0, rows - 1 - inside * RADIUS_PX, unseen)
    assert rows_beyond(first.contact, first.gradient, unseen, hinted=True) == (rows, 0)
    assert rows_beyond(last.contact, last.gradient, unseen, hinted=True) == (0, rows)


@pytest.mark.parametrize("unseen", ["x", "y"])
def test_what_the_lights_see_whole_is_not_mirrored(unseen) -> None:
    """Inside, just at the edge, or cut across the lights; nor is a frame that nothing touches."""
    rows = lines_px(unseen)
    for across, along in ((50.0, rows / 2), (50.0, RADIUS_PX), (10.0, rows / 2), (0.0, rows / 2)):
        cap = cap_at(across, along, unseen)
        assert rows_beyond(cap.contact, cap.gradient, unseen, hinted=True) == (0, 0)
        assert not is_cut_twice(cap.contact, cap.gradient, unseen)
    still = np.zeros_like(cap.contact)
    assert rows_beyond(still, cap.gradient, unseen, hinted=True) == (0, 0)
    assert not is_cut_twice(still, cap.gradient, unseen)


@pytest.mark.parametrize("unseen", ["x", "y"])
def test_a_few_steep_lines_at_the_edge_do_not_mirror_a_whole_contact(unseen) -> None:
    """As where light falls otherwise at the pad's rim: they are as deep there as they ever are."""
    cap = cap_at(50.0, lines_px(unseen) / 2, unseen)
    disturbed, gradient = cap.contact.copy(), cap.gradient.copy()
    lines = slice(100, 106)
    rim = (slice(8), lines) if unseen == "x" else (lines, slice(8))
    disturbed[rim], gradient[rim] = True, -0.3
    assert rows_beyond(disturbed, gradient, unseen, hinted=True) == (0, 0)


@pytest.mark.parametrize("hinted", [True, False])
@pytest.mark.parametrize("unseen", ["x", "y"])
def test_a_crest_that_shows_no_colour_at_the_edge_is_cut_all_the_same(unseen, hinted) -> None:
    cap = cap_at(50.0, -0.5, unseen)
    slope = np.abs(cap.gradient[..., 1 if unseen == "x" else 0])
    seen = cap.contact & (slope > 0.2)
    assert not (seen[0].any() if unseen == "x" else seen[:, 0].any())
    assert rows_beyond(seen, cap.gradient, unseen, hinted=hinted) == (lines_px(unseen), 0)


@pytest.mark.parametrize("unseen", ["x", "y"])
@pytest.mark.parametrize("across", [(40.0, 40.0), (30.0, 90.0)])
def test_two_that_are_cut_by_opposite_edges_are_mirrored_up_to_the_gel_between(
    across, unseen
) -> None:
    rows, inside = lines_px(unseen), 0.3 * RADIUS_PX
    caps = cap_at(across[0], inside, unseen), cap_at(across[1], rows - 1 - inside, unseen)
    disturbed = caps[0].contact | caps[1].contact
    before, after = rows_beyond(disturbed, caps[0].gradient + caps[1].gradient, unseen, hinted=True)
    assert before + after == rows
    assert inside + RADIUS_PX < before and inside + RADIUS_PX < after
    assert not is_cut_twice(disturbed, caps[0].gradient + caps[1].gradient, unseen)


@pytest.mark.parametrize("unseen", ["x", "y"])
@pytest.mark.parametrize("beyond", [(30, 0), (0, 50), (120, 60), (0, 0)])
def test_the_mirror_image_s_slopes_are_those_of_the_mirrored_surface(beyond, unseen) -> None:
    cap = cap_at(20.0, 30.0, unseen)
    around = [beyond, (0, 0)] if unseen == "x" else [(0, 0), beyond]
    depth = np.pad(cap.depth_mm, around, "symmetric")
    disturbed, gradient = mirrored(cap.contact, cap.gradient, unseen, beyond)
    np.testing.assert_array_equal(disturbed, depth > 0)
    along_y, along_x = np.gradient(depth, 0.1)
    off = np.abs(np.stack([along_x, along_y], -1) - gradient)[depth > 0.2]
    assert off.max() < 0.1 * np.abs(gradient).max()
    np.testing.assert_array_equal(within(gradient, unseen, beyond), cap.gradient)
    np.testing.assert_array_equal(within(disturbed, unseen, beyond), cap.contact)


@pytest.mark.parametrize("unseen", ["x", "y"])
def test_a_ball_that_both_edges_cut_shows_nowhere_how_deep_it_is(unseen) -> None:
    size_px = (160, 36) if unseen == "x" else (36, 120)
    cap = cap_at(60.0, 17.5, unseen, size_px)
    assert is_cut_twice(cap.contact, cap.gradient, unseen)


@pytest.mark.parametrize("unseen", ["x", "y"])
def test_an_edge_that_is_not_deep_counts_as_one_only_of_an_estimator_that_looks_around(unseen):
    cap = cap_at(50.0, 0.85 * RADIUS_PX, unseen)
    assert any(rows_beyond(cap.contact, cap.gradient, unseen, hinted=True))
    assert not any(rows_beyond(cap.contact, cap.gradient, unseen, hinted=False))


@pytest.mark.parametrize("unseen", ["x", "y"])
def test_a_flank_that_single_pixels_miss_does_not_cut_what_is_far_from_the_edge(unseen) -> None:
    """Their lines stay deep up to the edge, though nothing changed its colour near it."""
    cap = cap_at(50.0, lines_px(unseen) / 2, unseen)
    down = np.maximum(cap.gradient, 0)
    assert any(rows_beyond(cap.contact, down, unseen, hinted=True))
    assert not any(rows_beyond(cap.contact, down, unseen, hinted=False))
