# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Object after object and dots beside it, from the frames of one sensor."""

from dataclasses import replace

import numpy as np
import pytest

from recon.contact.disturbed import STRANGE
from recon.follower import FORGET_S, LOOK_AGAIN_S, Follower, doubted
from recon.pipeline import Reconstructor
from recon.plausible import IMPLAUSIBLE
from recon.pose.estimate import PoseEstimate
from recon.pose.registration import own
from recon.pose.rigid import angle_deg
from sensor.design import STANDARD
from tests.dotted import dotted, grid_px
from tests.recon.fast.units import make_unit
from tests.recon.pose.test_rest import journey
from tests.recon.pose.touched import MM_PER_PX, SIZE_PX, bead_pair, blank
from tests.synthetic import digitized

SURE = PoseEstimate(state="tracking", T_sensor_object=np.eye(4))
LOST = PoseEstimate(state="lost", reason="nothing touches")
PLACES = grid_px(16.0, size=SIZE_PX)


def dotted_frame(by_px=(0.0, 0.0), places=PLACES):
    gel = np.full((*SIZE_PX[::-1], 3), 0.5)
    return digitized(dotted(places + np.array(by_px), 2.0, gel))


def test_after_a_second_without_touch_the_next_object_is_new():
    first, second, _ = bead_pair(0)
    unit = make_unit(SIZE_PX)
    follow = Follower(unit)
    for now_s, touch, state, number in (
        (0.0, blank(), "lost", 0),
        (0.1, first, "tracking", 0),
        (0.2, second, "tracking", 0),
        (0.3, blank(), "lost", 0),
        (0.4 + FORGET_S, blank(), "lost", 1),
        (0.5 + FORGET_S, blank(), "lost", 1),  # no object has come yet
        (0.6 + 2 * FORGET_S, blank(), "lost", 1),
        (0.7 + 2 * FORGET_S, second, "tracking", 1),
    ):
        felt = follow(unit.background, touch, now_s)
        assert (felt.pose.state, felt.object_number, felt.dots) == (state, number, None)
    np.testing.assert_array_equal(felt.pose.T_sensor_object, np.eye(4))


@pytest.mark.parametrize("built_from", [None, STANDARD])
def test_what_travels_over_the_gel_of_the_unit_s_design_does_not_turn(built_from):
    unit = make_unit(SIZE_PX)
    follow = Follower(replace(unit, design=built_from))
    for second, (touch, _) in enumerate(journey()):
        felt = follow(unit.background, touch, 0.1 * second)
    assert (angle_deg(felt.pose.T_sensor_object) < 1) == (built_from is not None)


def test_the_first_object_is_the_first_whenever_it_comes():
    unit = make_unit(SIZE_PX)
    follow = Follower(unit)
    for now_s, touch in ((1e5, blank()), (2e5, blank()), (3e5, bead_pair(0)[0])):
        assert follow(unit.background, touch, now_s).object_number == 0
    follow.begin_anew()
    assert follow(unit.background, blank(), 4e5).object_number == 1


def test_what_is_felt_outlives_the_next_frame():
    first, second, _ = bead_pair(0)
    gradient = first.gradient.copy()
    felt = Follower(make_unit(SIZE_PX))(
        make_unit(SIZE_PX).background, replace(first, gradient=gradient), 0.0
    )
    gradient[:] = second.gradient  # as FastReconstructor does
    np.testing.assert_array_equal(felt.touch.gradient, first.gradient)
    assert own(felt.touch) is felt.touch  # one copy is enough
    for name in ("gradient", "depth_mm", "contact"):
        for copied in (felt.touch, own(first)):
            assert not np.shares_memory(getattr(copied, name), getattr(first, name))


def test_dots_are_followed_from_frame_to_frame_beyond_their_spacing():
    unit = replace(make_unit(SIZE_PX), background=dotted_frame())
    follow = Follower(unit)
    for step in range(9):
        felt = follow(dotted_frame((2.5 * step, 0.0)), blank(), 0.1 * step)
    shift_mm = felt.dots.displacement_mm(MM_PER_PX)[felt.dots.seen]
    np.testing.assert_allclose(np.median(shift_mm, axis=0), (20 * MM_PER_PX[0], 0), atol=0.03)
    assert felt.dots.word == "tracked"


def test_a_pose_on_a_marker_gel_without_its_dots_is_doubted():
    unit = replace(make_unit(SIZE_PX), background=dotted_frame())
    felt = Follower(unit)(dotted_frame(places=PLACES[:3]), bead_pair(0)[0], 0.0)
    assert felt.pose.words == "weak: the dots on the gel: lost"
    assert felt.pose.T_sensor_object is not None


def test_dots_on_a_gel_that_should_have_none_are_told_by_stream_and_by_reconstruction():
    unit, dots = make_unit(SIZE_PX), f"{len(PLACES)} dots, but the blank frame has none"
    felt = Follower(unit)(dotted_frame(), bead_pair(0)[0], 0.0)
    assert felt.markers.startswith(dots) and felt.pose.words.startswith("weak: the dots on the gel")
    assert Reconstructor(unit)(dotted_frame()).markers.startswith(dots)
    assert Reconstructor(unit)(unit.background).markers == "none"
    corner = dotted_frame(places=PLACES[(PLACES < 75).all(1)])  # as a dotted object's
    assert Reconstructor(unit)(corner).markers == "none"


def test_dots_that_come_after_clear_frames_are_told_from_there_on():
    unit, dots = make_unit(SIZE_PX), f"{len(PLACES)} dots, but the blank frame has none"
    follow, reconstruct = Follower(unit), Reconstructor(unit)
    frames = [unit.background, unit.background, dotted_frame(), dotted_frame((1.0, 0.0))]
    told = [follow(frame, bead_pair(0)[0], 0.1).markers for frame in frames]
    assert told == [reconstruct(frame).markers for frame in frames]
    assert told[:2] == ["none", "none"] and all(word.startswith(dots) for word in told[2:])


def test_dots_that_are_gone_are_told_no_longer():
    unit = make_unit(SIZE_PX)
    follow, reconstruct = Follower(unit), Reconstructor(unit)
    assert reconstruct(dotted_frame()).markers != "none"
    assert reconstruct(unit.background).markers == "none"
    frames = [dotted_frame(), unit.background, dotted_frame(), unit.background]
    for now_s, frame in enumerate(frames):
        told = follow(frame, bead_pair(0)[0], 1.1 * LOOK_AGAIN_S * now_s).markers
        assert (told == "none") == (frame is unit.background)


def test_unit_and_blank_frame_that_disagree_about_dots_are_told_in_a_stream_too():
    clear, first = make_unit(SIZE_PX), bead_pair(0)[0]
    card = replace(clear.card, markers={"count": 45, "spacing_mm": 2.0, "diameter_mm": 0.5})
    for unit, blank_frame, word in (
        (replace(clear, card=card), clear.background, "none, but the unit has 45"),
        (clear, dotted_frame(), f"{len(PLACES)} dots, but the unit was calibrated without"),
    ):
        felt = Follower(unit, blank_frame)(blank_frame, first, 0.0)
        assert felt.markers.startswith(word)
        assert felt.pose.state == "weak" and word in felt.pose.reason


@pytest.mark.parametrize("word", ["lost", "240 dots, but the unit was calibrated without"])
def test_only_a_pose_that_was_sure_changes_by_a_word_on_dots(word):
    assert doubted(SURE, word, still=False).state == "weak"
    assert word in doubted(SURE, word, still=False).reason
    assert doubted(LOST, word, still=False) is LOST
    for trusted in ("tracked", "none"):
        assert doubted(SURE, trusted, still=False) is SURE


def test_a_frame_that_is_no_touch_s_is_doubted_and_is_not_the_object():
    unit, (first, second, _) = make_unit(SIZE_PX), bead_pair(0)
    whole = Reconstructor(unit)(255 - unit.background)  # another camera's, say
    strange = replace(whole, depth_mm=first.depth_mm, gradient=first.gradient)
    vars(strange)["contact"] = np.ones_like(first.contact)
    depth_mm = first.depth_mm.copy()
    depth_mm[0, 0] = 99.0  # no gel is as thick
    deep = replace(first, depth_mm=depth_mm, gradient=1.01 * first.gradient)
    follow, alone = Follower(unit), Follower(unit)
    felt = [
        follow(np.roll(unit.background, index, 0), touch, 0.1 * index)
        for index, touch in enumerate((strange, deep, first, strange, deep, second))
    ]
    assert [item.pose.words for item in felt[:5]] == [
        f"lost: {STRANGE}",
        f"lost: {IMPLAUSIBLE}",
        "tracking",
        f"lost: {STRANGE}",
        f"weak: {IMPLAUSIBLE}",  # it may be the object all the same
    ]
    assert [item.doubt for item in felt] == [STRANGE, IMPLAUSIBLE, "", STRANGE, IMPLAUSIBLE, ""]
    poses = [alone(unit.background, touch, 0.0).pose for touch in (first, second)]
    np.testing.assert_array_equal(felt[2].pose.T_sensor_object, poses[0].T_sensor_object)
    np.testing.assert_allclose(
        felt[5].pose.T_sensor_object, poses[1].T_sensor_object, rtol=0, atol=1e-3
    )


def test_a_doubt_is_told_of_any_state_but_of_a_stream_that_stands_still():
    weak = replace(SURE, state="weak", reason="a shift is not seen by this touch")
    for found, state in ((SURE, "weak"), (weak, "weak"), (LOST, "lost")):
        told = doubted(found, "none", still=False, doubt=STRANGE)
        assert told == replace(found, state=state, reason=STRANGE)
    frozen = replace(SURE, state="frozen", reason="the stream stands still")
    assert doubted(frozen, "none", still=True, doubt=STRANGE) is frozen
    assert doubted(LOST, "none", still=True, doubt=STRANGE).reason == frozen.reason


def test_a_frozen_stream_is_told_with_and_without_a_touch():
    unit = make_unit(SIZE_PX)
    follow, first = Follower(unit), bead_pair(0)[0]
    changed = unit.background.copy()
    changed[0, 0] += 1
    frames = [unit.background, changed, changed, changed, changed]
    felt = [
        follow(frame, touch, 0.1)
        for frame, touch in zip(frames, (blank(), blank(), blank(), first, first), strict=True)
    ]
    assert [item.pose.words for item in felt] == [
        "lost: nothing touches",
        "lost: nothing touches",
        "lost: the stream stands still",
        "tracking",
        "frozen: the stream stands still",
    ]


def test_a_reconstructor_that_is_told_the_dots_before_follows_them_past_their_neighbours():
    reconstruct = Reconstructor(replace(make_unit(SIZE_PX), background=dotted_frame()))
    before = None
    for step in range(9):
        frame = dotted_frame((2.5 * step, 0.0))
        before = reconstruct(frame, before).dots
        seen = before.displacement_px[before.seen]
        assert np.median(seen[:, 0]) == pytest.approx(2.5 * step, abs=0.3)
    alone = reconstruct(frame).dots  # 20 px, of a grid of 16: taken for 4
    assert np.median(alone.displacement_px[alone.seen][:, 0]) == pytest.approx(4.0, abs=0.3)
