# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from scipy.linalg import expm

from recon.pose.rigid import (
    adjoint,
    angle_deg,
    applied,
    greatest_std,
    inverse,
    is_rigid,
    motion,
    rigid,
    rigid_or_none,
    skew,
    straightened,
    turn_and_shift,
    turned_covariance,
)

twists = st.lists(st.floats(-3, 3), min_size=6, max_size=6).map(np.array)


@given(twists, st.integers(3, 9))
def test_a_pose_written_down_with_few_digits_is_taken_and_straightened(twist, digits):
    pose = motion(twist)
    taken = rigid_or_none(np.round(pose, digits))
    assert taken is not None and is_rigid(taken)
    np.testing.assert_allclose(taken, pose, atol=2 * 0.1**digits)
    assert rigid_or_none(np.round(pose, 9) + 0.01 * np.eye(4)) is None


@given(twists)
def test_a_motion_is_rigid_and_its_inverse_undoes_it(twist):
    moved = motion(twist)
    assert is_rigid(moved)
    np.testing.assert_allclose(moved @ inverse(moved), np.eye(4), atol=1e-12)


@given(twists, st.integers(-8, 0))
def test_a_motion_is_the_exponential_of_its_twist(twist, power):
    turn = twist * 10.0 ** np.array([power] * 3 + [0] * 3)
    generator = np.zeros((4, 4))
    generator[:3, :3], generator[:3, 3] = skew(turn[:3]), turn[3:]
    np.testing.assert_allclose(motion(turn), expm(generator), atol=1e-12)


@given(twists, twists)
def test_adjoint_carries_twists_from_one_frame_to_another(twist, place):
    transform = motion(place)
    there = transform @ motion(twist) @ inverse(transform)
    np.testing.assert_allclose(there, motion(adjoint(transform) @ twist), atol=1e-9)


@given(twists, st.integers(-8, -3))
def test_turn_and_shift_of_a_small_motion_are_its_twist(twist, power):
    small = twist * 10.0**power
    np.testing.assert_allclose(turn_and_shift(motion(small)), small, atol=10.0 ** (2 * power + 1))


@given(twists)
def test_half_a_motion_twice_is_the_whole(twist):
    np.testing.assert_allclose(motion(twist / 2) @ motion(twist / 2), motion(twist), atol=1e-9)


@given(twists, st.integers(-8, 0))
def test_half_of_a_small_motion_twice_is_the_whole(twist, power):
    turn = twist * 10.0 ** np.array([power] * 3 + [0] * 3)  # the shift is none
    np.testing.assert_allclose(motion(turn / 2) @ motion(turn / 2), motion(turn), atol=1e-9)


def test_a_mirror_image_is_no_rigid_transform():
    mirror = np.diag([-1.0, 1, 1, 1])
    assert is_rigid(np.eye(4)) and is_rigid(mirror @ mirror)
    assert not is_rigid(mirror)


def test_small_angles_keep_their_digits():
    assert abs(angle_deg(motion(np.array([1e-7, 0, 0, 0, 0, 0]))) - np.degrees(1e-7)) < 1e-12
    assert abs(angle_deg(motion(np.array([0, np.pi - 1e-7, 0, 0, 0, 0]))) - 180) < 1e-4


def test_points_turn_about_the_axis():
    quarter = motion(np.array([0, 0, np.pi / 2, 0, 0, 0]))
    np.testing.assert_allclose(applied(quarter, np.array([[1.0, 0, 2]])), [[0, 1, 2]], atol=1e-12)


def test_rounding_errors_are_taken_out():
    bent = motion(np.array([0.3, -0.2, 0.5, 1, 2, 3]))
    bent[0, 1] += 1e-4
    assert not is_rigid(bent) and is_rigid(straightened(bent))


@given(twists)
def test_the_greatest_doubt_is_that_of_its_direction_wherever_that_points(twist):
    turn = adjoint(rigid(motion(twist)[:3, :3], np.zeros(3)))
    stated = np.diag(np.square([*np.radians([1.0, 3.0, 2.0]), 0.1, 0.2, 0.4]))
    doubt = greatest_std(turn @ stated @ turn.T, np.zeros(3))
    np.testing.assert_allclose(doubt, (3.0, 0.4), rtol=1e-9)


@given(twists, twists)
def test_the_doubt_about_a_point_s_shift_is_the_same_wherever_the_frame_begins(twist, stated):
    """Though a turn in doubt shifts a frame's origin the more, the farther away that lies."""
    root = np.diag(np.abs(stated) + 0.01)
    T_a_b, point = motion(twist), np.array([1.0, -2.0, 0.5])
    there = greatest_std(turned_covariance(root, T_a_b), applied(inverse(T_a_b), point))
    np.testing.assert_allclose(there, greatest_std(root, point), rtol=1e-6)
