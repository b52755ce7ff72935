# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""What a tracker says of touches that are small, given, or little of what it knows."""

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.touches import SyntheticTouch, bead, pressed
from recon.pose.joint import Joint
from recon.pose.rigid import motion, rigid, turned_covariance
from recon.pose.tracker import LEAST_CONTACT_PX, LONGEST_STEP_DEG, LONGEST_STEP_MM, Tracker
from sensor.errors import WedgeError
from tests.recon.pose.touched import MM_PER_PX, bead_pair, coarse_bead, corner, touch, touches


@pytest.mark.parametrize(
    ("fewer", "reason"),
    [(LEAST_CONTACT_PX, "nothing touches"), (1, "too little touches to be followed"), (0, "")],
)
def test_a_contact_of_few_pixels_is_not_followed(fewer, reason):
    first = bead_pair(0)[0]
    rows, columns = np.indices(first.contact.shape)
    middle = [part[first.contact].mean() for part in (rows, columns)]
    nearest = np.argsort(np.hypot(rows - middle[0], columns - middle[1]), axis=None)
    few = np.zeros_like(first.contact)
    few.flat[nearest[: LEAST_CONTACT_PX - fewer]] = True
    assert Tracker()(replace(first, contact=few)).reason == reason


@pytest.mark.parametrize("part", ["gradient", "depth_mm"])
def test_a_touch_that_is_not_finite_is_not_the_object(part):
    first, second = bead_pair(0)[:2]
    broken = getattr(first, part).copy()
    broken[3, 4] = np.nan
    track = Tracker()
    assert track(replace(first, **{part: broken})).reason == "slopes or depths are not finite"
    assert not track.begun and track(second).state != "lost"


@pytest.mark.parametrize("model", ["its first touch", "touches before"])
def test_a_touch_of_another_sensor_is_refused(model):
    first, second = bead_pair(0)[:2]
    track = Tracker(model=touches([(first, np.eye(4))], Joint()) if "before" in model else None)
    if model == "its first touch":
        track(first)
    with pytest.raises(WedgeError, match="one sensor"):
        track(replace(second, mm_per_px=(0.1, 0.2)))
    with pytest.raises(WedgeError, match="one sensor"):
        track(pressed(coarse_bead(), np.eye(4), None, size_px=(80, 60), mm_per_px=MM_PER_PX))
    calibrated_again = replace(second, mm_per_px=(1.01 * MM_PER_PX[0], 0.99 * MM_PER_PX[1]))
    assert track(calibrated_again).state == "tracking"


def test_a_pose_may_be_lists_of_numbers():
    pose = motion(np.array([0.1, 0, 0, 1, 2, 3]))
    found = Tracker(T_sensor_object=pose.tolist())(bead_pair(0)[0])
    np.testing.assert_array_equal(found.T_sensor_object, pose)


def test_a_pose_that_was_given_is_followed_and_not_searched_for():
    smooth = bead(press_mm=1.4, amplitude_mm=0.0)
    start = rigid(np.eye(3), np.array([1.0, 2, 3]))
    model = touches([(touch(smooth, np.eye(4), 1), start)], Joint())
    given, searched = Tracker("joint", model, start), Tracker("joint", model)
    found = given(touch(smooth, np.eye(4), 2))
    assert found.words == "weak: its details do not match, or it has none"
    assert searched(touch(smooth, np.eye(4), 2)).words == "weak: several poses fit this touch"


def parts(share: float) -> tuple[SyntheticTouch, SyntheticTouch]:
    """So much of a contact's left, and of the same one's right a little later."""
    first, second, _ = bead_pair(0)
    column = np.indices(first.contact.shape)[1]
    low, high = np.quantile(column[first.contact], [1 - share, share])
    left, right = first.contact & (column < high), second.contact & (column > low)
    return replace(first, contact=left), replace(second, contact=right)


def test_who_is_searched_by_a_part_of_what_is_known_stays_in_doubt():
    known, seen = parts(0.75)
    found = Tracker("joint", touches([(known, np.eye(4))], Joint()))(seen)
    assert found.explained > 0.99 and found.overlap < 0.75
    assert found.words == "weak: no pose of the object fits this touch well"


@pytest.mark.parametrize(
    ("share", "words"),
    [(0.75, "tracking"), (0.57, "lost: too little in common with what was seen before")],
)
def test_two_parts_that_have_little_in_common_tell_of_no_motion(share, words):
    known, seen = parts(share)
    track = Tracker()
    track(known)
    assert track(seen).words == words


def test_of_a_contact_that_shrinks_within_the_frame_nothing_lies_beyond_its_border():
    first, second, _ = bead_pair(0)
    rows, columns = np.indices(first.contact.shape)
    away = np.hypot(rows - rows[first.contact].mean(), columns - columns[first.contact].mean())
    for share, words in (
        (0.45, "tracking"),
        (0.3, "weak: a rotation is not seen by this touch"),
    ):
        less = second.contact & (away < np.quantile(away[first.contact], share))
        track = Tracker()
        track(first)
        assert track(replace(second, contact=less)).words == words


@pytest.mark.parametrize(
    "longest", [(0, 0, np.radians(LONGEST_STEP_DEG), 0, 0, 0), (0, 0, 0, LONGEST_STEP_MM, 0, 0)]
)
@pytest.mark.parametrize(("share", "words"), [(0.9, "tracking"), (1.1, "lost: the object jumped")])
def test_a_motion_that_is_longer_than_a_step_is_a_jump(longest, share, words):
    track = Tracker()
    track(touch(coarse_bead(), np.eye(4), 1))
    moved = motion(share * np.array(longest))
    assert track(touch(coarse_bead(), moved, 2)).words == words


def test_doubt_is_told_in_the_object_s_frame():
    first, second, _ = bead_pair(0)
    start = motion(np.array([0.4, -1.0, 0.3, 5, 6, 7]))
    plain, placed = Tracker(), Tracker(T_sensor_object=start)
    plain(first), placed(first)
    wanted = turned_covariance(plain(second).covariance, start)
    found = placed(second).covariance
    np.testing.assert_allclose(found, wanted, rtol=1e-6, atol=1e-9 * np.abs(wanted).max())


def test_what_stands_still_and_is_lost_stays_lost():
    track = Tracker()
    track(bead_pair(0)[0])
    assert track(corner()).state == "lost"
    before = track(corner())
    assert before.state == "lost" and track(corner()) == before
