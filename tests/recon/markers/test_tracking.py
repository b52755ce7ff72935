# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from recon.markers.tracking import marker_tracker
from tests.dotted import HEIGHT, WIDTH, dotted, grid_px, pad

PLACES = grid_px(20.0)
TRACKER = marker_tracker(dotted(PLACES))


def order():
    """The dot drawn at each of the tracker's places."""
    away = np.linalg.norm(TRACKER.markers.position_px[:, None] - PLACES, axis=-1)
    assert (away.min(1) < 0.5).all() and len(TRACKER.markers) == len(PLACES)
    return away.argmin(1)


ORDER = order()


def press(places, deepest_px, middle=(120.0, 90.0), radius_px=40.0):
    """Dots pushed outward around a contact, most on its rim, as a ball pushes them."""
    offset = places - middle
    away = np.linalg.norm(offset, axis=1, keepdims=True)
    return places + deepest_px * offset / radius_px * np.exp(0.5 - 0.5 * (away / radius_px) ** 2)


def errors(tracked, places):
    return np.linalg.norm(tracked.position_px - places[ORDER], axis=1)


@given(
    st.floats(0, 6), st.floats(40, 200), st.floats(40, 140), st.floats(20, 50), st.integers(0, 99)
)
@settings(max_examples=8, deadline=None)
def test_a_single_press_is_followed_from_rest_finer_than_a_pixel(deepest_px, x, y, radius_px, seed):
    places = press(PLACES, deepest_px, (x, y), radius_px)
    tracked = TRACKER.track(dotted(places, seed=seed))
    assert tracked.seen.mean() > 0.97 and tracked.word == "tracked"
    error = errors(tracked, places)
    assert np.sqrt((error**2).mean()) < 0.25 and error[tracked.seen].max() < 1.5
    moved_mm = tracked.displacement_mm((0.1, 0.2))
    np.testing.assert_allclose(moved_mm, tracked.displacement_px * [0.1, 0.2])


def test_at_rest_nothing_moves_and_every_dot_is_seen():
    tracked = TRACKER.track(dotted(PLACES, seed=5))
    assert tracked.seen.all()
    assert np.abs(tracked.displacement_px).max() < 0.3


def test_identities_survive_a_shear_of_more_than_a_spacing():
    """Each frame is followed from the last; dots that leave the frame come back as themselves."""
    tracked, gone = None, 0
    for shift in [*np.arange(0, 31, 5.0), *np.arange(30, -1, -5.0)]:
        places = PLACES + np.array([shift, 0.4 * shift])
        tracked = TRACKER.track(dotted(places), tracked)
        inside = (places[ORDER] < [WIDTH - 6, HEIGHT - 6]).all(1)
        assert errors(tracked, places)[inside].max() < 1.0
        assert not tracked.seen[(places[ORDER] > [WIDTH + 2, HEIGHT + 2]).any(1)].any()
        gone = max(gone, (~inside).sum())
        assert tracked.word == "tracked"
    assert gone >= 7
    assert tracked.seen.all() and errors(tracked, PLACES).max() < 0.5


def test_a_covered_dot_is_carried_by_its_neighbours_and_said_to_be_unseen():
    places = PLACES + np.array([3.0, 1.0])
    image = dotted(places)
    covered = np.linalg.norm(places - [120, 90], axis=1) < 15
    assert covered.any()
    for x, y in places[covered]:
        part = np.s_[round(y) - 6 : round(y) + 7, round(x) - 6 : round(x) + 7]
        image[part] = pad()[part]
    tracked = TRACKER.track(image)
    np.testing.assert_array_equal(tracked.seen, ~covered[ORDER])
    assert errors(tracked, places).max() < 0.5


@pytest.mark.parametrize(
    "image", [pad(), np.zeros((HEIGHT, WIDTH, 3)), np.ones((HEIGHT, WIDTH, 3))]
)
def test_a_frame_without_dots_is_lost_not_guessed(image):
    tracked = TRACKER.track(image.astype(np.float32))
    assert tracked.word == "lost"
    assert np.isfinite(tracked.position_px).all()


def test_a_jump_of_nearly_half_a_spacing_is_said():
    assert TRACKER.track(dotted(PLACES + np.array([8.0, 0.0]))).word == "jumped"


def test_doubt_after_a_jump_stays_until_the_gel_rests():
    """At 12 px each dot lies nearer to its neighbour's place than to its own."""
    told, tracked = [], None
    for shift in (0, 12, 12, 10, 7, 4, 0, 0, 4):
        places = PLACES + np.array([shift, 0.0])
        tracked = TRACKER.track(dotted(places, seed=len(told)), tracked)
        told.append(tracked.word)
        assert tracked.word == "jumped" or errors(tracked, places)[tracked.seen].max() < 1.0
    assert told == ["tracked"] + 5 * ["jumped"] + 3 * ["tracked"]


def test_doubt_outlasts_frames_that_show_nothing():
    doubtful = TRACKER.track(dotted(PLACES + np.array([12.0, 0.0])))
    lost = TRACKER.track(pad().astype(np.float32), doubtful)
    again = TRACKER.track(dotted(PLACES + np.array([10.0, 0.0])), lost)
    assert (doubtful.word, lost.word, again.word) == ("jumped", "lost", "jumped")


def dragged(share, reach):
    """Places after dots in the middle were pulled aside, both in spacings, and what is found."""
    rest = grid_px(15.0)
    away_px = np.linalg.norm(rest - [120, 90], axis=1)
    places = rest + 15.0 * share * np.exp(-0.5 * (away_px / (15.0 * reach)) ** 2)[:, None] * [1, 0]
    tracker = marker_tracker(dotted(rest, 2.0))
    tracked = tracker.track(dotted(places, 2.0))
    dot = np.linalg.norm(tracker.markers.position_px[:, None] - rest, axis=-1).argmin(1)
    return tracked, np.linalg.norm(tracked.position_px - places[dot], axis=1)[tracked.seen]


@pytest.mark.parametrize("share", [0.4, 0.6, 0.8])
@pytest.mark.parametrize("reach", [2, 3])
def test_dots_of_which_a_part_jumped_are_known_by_those_around_it(share, reach):
    tracked, error = dragged(share, reach)
    assert tracked.word == "tracked" and tracked.seen.mean() > 0.95
    assert error.max() < 1.0


def test_where_too_large_a_part_jumped_that_is_said():
    tracked, error = dragged(0.9, 4)
    assert (error > 5).any() and tracked.word == "jumped"


def test_hidden_pixels_cover_the_dots_at_rest_and_now_and_do_not_flicker():
    places = press(PLACES, 5.0)
    covers = TRACKER.hidden(TRACKER.track(dotted(places)))
    for dots in (PLACES, places):
        image = dotted(dots, image=np.ones((HEIGHT, WIDTH, 3)), noise=0.0)
        assert covers[image[..., 0] < 0.9].all()
    assert covers.mean() < 0.5
    again = TRACKER.hidden(TRACKER.track(dotted(places, seed=7)))
    assert (again != covers).mean() < 0.005
    at_rest = [TRACKER.hidden(TRACKER.track(dotted(PLACES, seed=seed))) for seed in (1, 2)]
    np.testing.assert_array_equal(*at_rest)


def test_a_clear_gel_has_no_tracker():
    assert marker_tracker(pad().astype(np.float32)) is None


def test_an_even_stretch_is_no_jump_of_those_whose_neighbours_are_farther_off():
    """At the edge some are two spacings away, and move apart by twice as much."""
    middle, tracked = np.array([WIDTH, HEIGHT]) / 2, None
    for share in (0.0, 0.05, 0.1, 0.15, 0.2):
        places = middle + (1 - share) * (PLACES - middle)
        tracked = TRACKER.track(dotted(places), tracked)
        assert tracked.word == "tracked" and tracked.seen.all()
        assert errors(tracked, places).max() < 0.5
