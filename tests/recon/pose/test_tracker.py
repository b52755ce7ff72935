# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""What every tracker owes: the pose, or a plain word."""

import inspect
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from benchmarks.touches import SyntheticTouch, Thing, _below, _convex, bead, lowest_surface
from recon.integration.poisson import integrate
from recon.pose.joint import Joint
from recon.pose.models import MOST_LEARNT, TouchModel, keyframe
from recon.pose.pyramid import Pyramid
from recon.pose.registration import PRIOR, PRIOR_DEG, own, pixel_grid_mm
from recon.pose.rigid import angle_deg, inverse, motion, rigid, shift_mm, turn_and_shift
from recon.pose.tracker import REGISTRATIONS, Tracker
from sensor.errors import WedgeError
from tests.recon.pose.touched import (
    MM_PER_PX,
    SIZE_PX,
    bead_pairs,
    blank,
    coarse_bead,
    corner,
    touch,
    touches,
)

every_tracker = pytest.mark.parametrize("name", REGISTRATIONS)
ACCURACY = {"joint": (0.5, 0.03), "gicp": (0.7, 0.04), "plane": (0.7, 0.04)}
"""Degrees and mm of a step on a quarter of the pixels."""


def rolled(angle: float) -> np.ndarray:
    turn = Rotation.from_rotvec([0, np.radians(angle), 0]).as_matrix()
    center = np.array([0, 0, 5.0 - 1.4])
    return rigid(turn, center - turn @ center)


@every_tracker
def test_a_small_motion_is_found(name):
    errors = []
    for first, second, moved in bead_pairs()[:4]:
        track = Tracker(name)
        np.testing.assert_array_equal(track(first).T_sensor_object, np.eye(4))
        found = track(second)
        assert found.words == "tracking"
        left = inverse(moved) @ found.T_sensor_object
        errors.append((angle_deg(left), shift_mm(left)))
    worst_deg, worst_mm = np.max(errors, 0)
    assert worst_deg < ACCURACY[name][0] and worst_mm < ACCURACY[name][1]


@every_tracker
def test_a_given_first_pose_carries_over(name):
    first, second, _ = bead_pairs()[0]
    start = motion(np.array([0.4, -1.0, 0.3, 5, 6, 7]))
    plain, placed = Tracker(name), Tracker(name, T_sensor_object=start)
    plain(first), placed(first)
    expected = plain(second).T_sensor_object @ start
    np.testing.assert_allclose(placed(second).T_sensor_object, expected, atol=1e-6)


def studs(shift_mm: float) -> SyntheticTouch:
    """Two by two round studs, 6 mm apart, moved along x."""
    x_mm, y_mm = np.meshgrid(*pixel_grid_mm(SIZE_PX, MM_PER_PX))
    depth, gradient = np.zeros(x_mm.shape), np.zeros((*x_mm.shape, 2))
    for stud_x, stud_y in ((-3, -3), (-3, 3), (3, -3), (3, 3)):
        dx, dy = x_mm - stud_x - shift_mm, y_mm - stud_y
        away = np.hypot(dx, dy) + 1e-9
        edge = np.tanh((away - 1.7) / 0.3)
        depth += 0.2 * (1 - edge)
        gradient += -0.2 / 0.3 * ((1 - edge**2) / away)[..., None] * np.stack([dx, dy], -1)
    noise = 0.02 * np.random.default_rng(round(100 * shift_mm)).standard_normal(gradient.shape)
    return SyntheticTouch(
        gradient=(gradient + noise).astype(np.float32),
        depth_mm=depth.astype(np.float32),
        contact=depth > 0.05,
        mm_per_px=MM_PER_PX,
    )


def test_a_pattern_that_comes_back_one_step_further_is_not_taken_for_itself():
    track = Tracker()
    assert track(studs(0.0)).state == "tracking"
    assert track(studs(0.3)).state == "tracking"
    assert track(blank()).state == "lost"
    assert track(studs(5.9)).state == "lost"  # half of the studs where others were
    assert track(studs(0.5)).state == "tracking"


@every_tracker
def test_nothing_touches(name):
    track = Tracker(name)
    assert track(blank()).reason == "nothing touches"
    assert track(bead_pairs()[0][0]).state == "tracking"
    gone = track(blank())
    assert gone.state == "lost" and gone.T_sensor_object is None and gone.covariance is None


@every_tracker
def test_the_object_is_found_again_where_it_was(name):
    first, second, moved = bead_pairs()[0]
    track = Tracker(name)
    track(first), track(blank())
    found = track(second)
    assert found.T_sensor_object is not None
    assert angle_deg(inverse(moved) @ found.T_sensor_object) < ACCURACY[name][0]


@every_tracker
def test_a_frozen_stream_is_said(name):
    first, second, _ = bead_pairs()[0]
    track = Tracker(name)
    track(first)
    before = track(second)
    found = track(replace(second))
    assert found.state == "frozen"
    np.testing.assert_array_equal(found.T_sensor_object, before.T_sensor_object)


def test_touches_may_come_in_the_same_arrays():
    first, second, _ = bead_pairs()[0]
    arrays = replace(first, gradient=first.gradient.copy(), depth_mm=first.depth_mm.copy())
    track, apart = Tracker(), Tracker()
    track(arrays), apart(first)
    arrays.gradient[:], arrays.depth_mm[:] = second.gradient, second.depth_mm
    found, wanted = track(replace(second, gradient=arrays.gradient)), apart(second)
    assert found.state == wanted.state == "tracking"
    np.testing.assert_array_equal(found.T_sensor_object, wanted.T_sensor_object)


@pytest.mark.parametrize("name", ["gicp", "plane"])
def test_too_few_points_leave_a_motion_as_unknown_as_before(name):
    registration, whole = REGISTRATIONS[name], bead_pairs()[0][0]
    some = np.zeros_like(whole.contact)
    some.flat[np.flatnonzero(whole.contact)[:3]] = True
    few = registration.prepare(replace(whole, contact=some))
    covariance = registration.align(few, few, np.eye(4)).covariance
    np.testing.assert_array_equal(covariance, PRIOR)


@every_tracker
def test_a_touch_far_deeper_than_the_last_is_a_pose_that_is_right_or_doubted(name):
    first, second, _ = bead_pairs()[0]
    track = Tracker(name)
    track(first)
    found = track(replace(second, depth_mm=second.depth_mm + np.float32(0.8) * second.contact))
    assert np.isfinite(found.covariance).all()
    assert found.state == "weak" or abs(found.T_sensor_object[2, 3] + 0.8) < 0.2


@every_tracker
def test_another_object_is_no_pose(name):
    track = Tracker(name)
    track(bead_pairs()[0][0])
    assert track(corner()).state == "lost"


@every_tracker
def test_a_jump_is_never_a_confident_wrong_pose(name):
    first = bead_pairs()[0][0]
    for angle in (35.0, 60.0, 90.0):
        track = Tracker(name)
        track(first)
        found = track(touch(coarse_bead(), rolled(angle), 5))
        right = found.T_sensor_object is not None and (
            angle_deg(inverse(rolled(angle)) @ found.T_sensor_object) < 2
        )
        assert found.state != "tracking" or right


@every_tracker
def test_slopes_that_are_not_finite_are_said(name):
    first = bead_pairs()[0][0]
    track = Tracker(name)
    track(first)
    broken = first.gradient.copy()
    broken[3, 4] = np.nan
    assert track(replace(first, gradient=broken)).state == "lost"


def beside_the_border(thing: Thing, shift_mm: tuple[float, float], seed: int) -> SyntheticTouch:
    """As it is reconstructed where the frame's border cuts it off: depth with a free border."""
    seen = touch(thing, motion(np.array([0, 0, 0, *shift_mm, 0])), seed)
    lattice = np.stack(np.meshgrid(*pixel_grid_mm(SIZE_PX, MM_PER_PX)), -1)
    surface_mm, _ = lowest_surface(thing, motion(np.array([0, 0, 0, *shift_mm, 0])), lattice)
    contact = surface_mm < -0.04
    depth = integrate(seen.gradient, MM_PER_PX, "neumann")
    return replace(seen, depth_mm=depth - np.median(depth[~contact]), contact=contact)


@every_tracker
def test_an_edge_across_the_whole_frame_does_not_show_how_it_slides(name):
    turned = Rotation.from_euler("z", 11, degrees=True).as_matrix()
    normals = np.array([[0, 0.5, -1.0], [0, -0.5, -1.0]]) @ turned.T
    edge = Thing(
        name="edge",
        field=_convex(normals, np.full(2, 0.6 / np.hypot(1, 0.5))),
        start_mm=_below(2.0),
    )
    for seed in range(3):
        track = Tracker(name)
        track(beside_the_border(edge, (0.0, 0.0), 10 + seed))
        found = track(beside_the_border(edge, tuple(0.5 * turned[:2, 0]), 20 + seed))
        assert found.words == "weak: a shift is not seen by this touch"
        assert found.translation_std_mm > 0.2


def test_an_object_mostly_beyond_the_border_is_followed_with_a_warning():
    track = Tracker()
    reasons = [
        track(beside_the_border(coarse_bead(), (0.0, shift), 30 + number)).reason
        for number, shift in enumerate(np.arange(-5.0, -9.0, -0.6))
    ]
    assert reasons[0] == "" and reasons[-1] == "most of the object lies beyond the frame's border"


@every_tracker
def test_a_last_remnant_is_not_the_object(name):
    first = bead_pairs()[0][0]
    rows, columns = np.nonzero(first.contact)
    near = np.hypot(rows - rows.mean(), columns - columns.mean()) < 7
    rest = np.zeros_like(first.contact)
    rest[rows[near], columns[near]] = True
    track = Tracker(name)
    track(first)
    found = track(replace(first, gradient=first.gradient + np.float32(1e-4), contact=rest))
    assert found.state == "lost" and found.reason == "too little of the object touches"


def test_errors_that_are_alike_over_millimetres_are_stated():
    first, second, _ = bead_pairs()[0]
    rows, columns = np.indices(second.contact.shape)
    wave = 0.15 * np.sin(columns / 6)[..., None] * np.sin(rows / 6)[..., None]
    bent = replace(second, gradient=second.gradient + wave.astype(np.float32))
    plain, doubtful = (
        Joint().align(Pyramid(first), Pyramid(seen), np.eye(4)).covariance
        for seen in (second, bent)
    )
    turns = [np.sqrt(np.trace(found[:3, :3])) for found in (plain, doubtful)]
    assert turns[1] > 1.8 * turns[0]
    assert turns[1] < np.sqrt(3) * np.radians(PRIOR_DEG) * 1.001


def test_gel_that_only_follows_moves_no_pose():
    """A surface around the contact may take any shape, and the whole frame any height."""
    first, second, _ = bead_pairs()[0]
    rows, columns = np.nonzero(second.contact)
    height, width = second.contact.shape
    x, y = np.meshgrid(np.arange(width), np.arange(height))
    apart = np.hypot(x - columns.mean(), y - rows.mean()) - 42
    assert np.hypot(columns - columns.mean(), rows - rows.mean()).max() < 30
    ridge = np.exp(-((apart / 4) ** 2)) * (2 + np.sin(5 * np.arctan2(y - 60, x - 80)))
    along_y, along_x = np.gradient(ridge)
    followed = replace(
        second,
        gradient=second.gradient + 0.2 * np.stack([along_x, along_y], -1).astype(np.float32),
        depth_mm=second.depth_mm + np.float32(0.3),
    )
    plain, other = (
        Joint().align(Pyramid(first), Pyramid(seen), np.eye(4)).T_current_reference
        for seen in (second, followed)
    )
    assert angle_deg(inverse(plain) @ other) < 0.02
    assert shift_mm(inverse(plain) @ other) < 0.001


@pytest.mark.parametrize("angle", [0.5, 15.0])
def test_after_a_loss_the_object_is_recognized_as_it_was_seen_before(angle):
    track = Tracker()
    for before in (0.0, 6.0, 12.0, 18.0, 24.0, 30.0):
        track(touch(coarse_bead(), rolled(before), 60))
    assert track(corner()).state == "lost"
    again = track(touch(coarse_bead(), rolled(angle), 61))
    assert again.state == "tracking"
    assert angle_deg(inverse(rolled(angle)) @ again.T_sensor_object) < 0.5


def test_doubt_that_has_added_up_ends_at_a_surer_keyframe_and_is_said_without():
    for others in (True, False):
        track = Tracker()
        track(touch(coarse_bead(), rolled(0), 20))
        assert isinstance(track.model, TouchModel)
        (first,) = track.model.keyframes
        doubtful = replace(first, covariance=0.01 * np.eye(6))
        track._keyframe = doubtful
        track.model.keyframes[:] = [doubtful, first] if others else [doubtful]
        found = track(touch(coarse_bead(), rolled(3.0), 21))
        assert angle_deg(inverse(rolled(3.0)) @ found.T_sensor_object) < 0.5
        assert found.state == ("tracking" if others else "weak")
        assert (found.rotation_std_deg < 1) == others and bool(found.reason) != others


def test_who_is_adrift_recognizes_the_object_wherever_it_was():
    track = Tracker()
    track(touch(coarse_bead(), rolled(0), 20))
    assert isinstance(track.model, TouchModel)
    (first,) = track.model.keyframes
    adrift = replace(first, T_sensor_object=rolled(40), covariance=0.01 * np.eye(6))
    track._keyframe, track._last = adrift, adrift.T_sensor_object
    track.model.keyframes[:] = [adrift, first]
    found = track(touch(coarse_bead(), rolled(1.0), 21))
    assert found.state == "tracking"
    assert angle_deg(inverse(rolled(1.0)) @ found.T_sensor_object) < 0.5


def test_what_a_smooth_ball_hides_is_said():
    smooth = bead(press_mm=1.4, amplitude_mm=0.0)
    track = Tracker()
    track(touch(smooth, np.eye(4), 1))
    found = track(touch(smooth, rolled(4.0), 2))
    assert found.state == "weak" and found.reason
    assert found.rotation_std_deg > 4


def test_errors_are_as_large_as_the_covariance_says():
    squares = []
    for first, second, moved in bead_pairs():
        found = Joint().align(Pyramid(first), Pyramid(second), np.eye(4))
        left = inverse(moved) @ found.T_current_reference
        error = turn_and_shift(left)
        squares.append(error @ np.linalg.solve(found.covariance, error))
    assert 1 < np.mean(squares) < 15  # six, of a perfect covariance


def test_keyframes_bring_a_roll_back_to_where_it_began():
    there = [5.0 * i for i in range(8)]
    angles = [*there, *there[-2::-1]]
    track = Tracker()
    for index, angle in enumerate(angles):
        found = track(touch(coarse_bead(), rolled(angle), 100 + index))
        left = inverse(rolled(angle)) @ found.T_sensor_object
        assert found.state == "tracking" and angle_deg(left) < 1.5
    assert angle_deg(found.T_sensor_object) < 0.5
    assert found.rotation_std_deg < 1


def test_earlier_touches_are_a_model_to_search_in():
    first, second, moved = bead_pairs()[0]
    pose = motion(np.array([0.1, 0.2, 2.0, 1, 2, 3]))
    track = Tracker("joint", touches([(first, pose)], Joint()))
    found = track(second)
    assert angle_deg(inverse(moved @ pose) @ found.T_sensor_object) < 0.5


def test_a_known_touch_that_comes_back_turned_is_searched_anew():
    first, second, _ = bead_pairs()[0]
    track = Tracker("joint", touches([(first, np.eye(4))], Joint()))
    assert track(second).state == "tracking" and track(blank()).state == "lost"
    turned = rigid(Rotation.from_euler("z", 90, degrees=True).as_matrix(), np.zeros(3))
    found = track(touch(coarse_bead(), turned, 5))
    assert found.state == "tracking"
    assert angle_deg(inverse(turned) @ found.T_sensor_object) < 0.5


def test_of_touches_learnt_in_a_long_run_the_first_and_the_latest_are_kept():
    first = keyframe(bead_pairs()[0][0], np.eye(4), np.zeros((6, 6)), Joint())
    learnt = [replace(first, covariance=number * np.eye(6)) for number in range(3 * MOST_LEARNT)]
    for given in (0, 5):
        model = TouchModel(keyframes=learnt[:given])
        for seen in learnt[given:]:
            model.learn(seen)
        stay = max(given, 1)
        assert model.keyframes[:stay] == learnt[:stay]
        assert model.keyframes[stay:] == learnt[-MOST_LEARNT:]


def test_derivatives_are_those_of_a_moved_object():
    still = touch(coarse_bead(), np.eye(4), None)
    pyramid = Pyramid(still)
    template = pyramid.templates[pyramid.finest]
    height, width = still.contact.shape
    columns = np.round(template.points[:, 0] / 0.1268 + (width - 1) / 2).astype(int)
    rows = np.round(template.points[:, 1] / 0.1268 + (height - 1) / 2).astype(int)
    for axis in range(6):
        twist = np.zeros(6)
        twist[axis] = step = 0.002 if axis < 3 else 0.01
        seen = [touch(coarse_bead(), motion(sign * twist), None) for sign in (1, -1)]
        slopes = (seen[0].gradient - seen[1].gradient)[rows, columns] / (2 * step)
        depth = (seen[0].depth_mm - seen[1].depth_mm)[rows, columns] / (2 * step)
        for predicted, measured in zip(template.change[axis], (*slopes.T, depth), strict=True):
            apart = float(np.median(np.abs(predicted - measured)))
            assert apart < 0.4 * float(np.median(np.abs(measured))) + 0.02


def test_bad_arguments_are_one_sentence():
    with pytest.raises(WedgeError, match="no tracker"):
        Tracker("magic")
    for given in (2 * np.eye(4), np.eye(3), [[1, 0], [0]], "identity", np.full((4, 4), np.nan)):
        with pytest.raises(WedgeError, match="rigid"):
            Tracker(T_sensor_object=given)
    with pytest.raises(WedgeError, match="MeshModel"):
        inspect.unwrap(Tracker.__init__)(None, model=corner())
    with pytest.raises(WedgeError, match="reconstruct it first"):
        inspect.unwrap(own)(np.zeros((8, 8, 3), np.uint8))  # else the tests' check of types does
