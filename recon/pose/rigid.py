# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Rigid transforms as 4 x 4 matrices: ``T_a_b`` maps coordinates of b to those of a.

A twist is (rotation vector in rad, translation in mm). Formulas: Lynch and Park, Modern Robotics,
2017, chapter 3.
"""

import math

import numpy as np
from jaxtyping import Float
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

Transform = Float[np.ndarray, "4 4"]
Twist = Float[np.ndarray, "6"]
Covariance = Float[np.ndarray, "6 6"]
"""Of a twist."""
Points = Float[np.ndarray, "*n 3"]

IDENTITY = np.eye(4)
LAST_ROW = np.array([0.0, 0.0, 0.0, 1.0])
MOST_OFF = 1e-6
"""Of a rigid transform's numbers, by rounding."""
MOST_OFF_TYPED = 2e-3
"""The same of one that somebody wrote down with three decimals or more."""


def rigid(rotation: Float[np.ndarray, "3 3"], translation_mm: Float[np.ndarray, "3"]) -> Transform:
    """The transform that rotates, then shifts."""
    transform = np.eye(4)
    transform[:3, :3] = rotation
    transform[:3, 3] = translation_mm
    return transform


def motion(twist: Twist) -> Transform:
    """The rigid motion along a twist for one unit of time (the exponential)."""
    wx, wy, wz, vx, vy, vz = twist.tolist()
    change = np.array([[0, -wz, wy, vx], [wz, 0, -wx, vy], [-wy, wx, 0, vz], [0, 0, 0, 0.0]])
    angle = math.sqrt(wx * wx + wy * wy + wz * wz)
    if angle < 1e-6:  # what is left out is less than rounding takes
        versine, rest = 0.5, 1 / 6
    else:
        versine = 2 * (math.sin(angle / 2) / angle) ** 2
        rest = (1 - math.sin(angle) / angle) / angle**2
    # Of a turn's generator, cube = -angle^2 x itself; so the series is one of three terms.
    square = change @ change
    moved: Transform = IDENTITY + change + versine * square + rest * (square @ change)
    return moved


def inverse(transform: Transform) -> Transform:
    """``T_b_a`` of ``T_a_b``."""
    back = transform[:3, :3].T
    return rigid(back, -back @ transform[:3, 3])


def applied(transform: Transform, points: Points) -> Points:
    """Points of b in coordinates of a."""
    moved: Points = points @ transform[:3, :3].T + transform[:3, 3]
    return moved


def adjoint(transform: Transform) -> Covariance:
    """Maps twists of b to twists of a: ``T motion(x) inverse(T) = motion(adjoint(T) @ x)``."""
    rotation = transform[:3, :3]
    matrix = np.zeros((6, 6))
    matrix[:3, :3] = matrix[3:, 3:] = rotation
    matrix[3:, :3] = skew(transform[:3, 3]) @ rotation
    return matrix


def turned_covariance(covariance: Covariance, T_a_b: Transform) -> Covariance:
    """Of twists of a in coordinates of b."""
    back = adjoint(inverse(T_a_b))
    return back @ covariance @ back.T


def greatest_std(covariance: Covariance, point_mm: Float[np.ndarray, "3"]) -> tuple[float, float]:
    """Standard deviations in the directions of most doubt: of the turn, deg, and the shift, mm.

    Args:
        covariance: of a twist.
        point_mm: whose shift is asked for, in the frame of the twist.
    """
    shift = np.concatenate([-skew(point_mm), IDENTITY[:3, :3]], 1)  # of the point, by a twist
    blocks = np.stack([covariance[:3, :3], shift @ covariance @ shift.T])
    turn, shift_mm = np.sqrt(np.maximum(np.linalg.eigvalsh(blocks)[:, -1], 0))
    return float(np.degrees(turn)), float(shift_mm)


def skew(vector: Float[np.ndarray, "3"]) -> Float[np.ndarray, "3 3"]:
    """The matrix of ``vector x``."""
    x, y, z = vector
    return np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]], float)


def angle_deg(transform: Transform) -> float:
    """How far a transform turns."""
    # From the sine and the cosine: either alone loses digits somewhere.
    rotation = transform[:3, :3]
    sine = np.linalg.norm(rotation - rotation.T) / np.sqrt(8)
    return float(np.degrees(np.arctan2(sine, (np.trace(rotation) - 1) / 2)))


def shift_mm(transform: Transform) -> float:
    """How far a transform moves the origin."""
    return float(np.linalg.norm(transform[:3, 3]))


def turn_and_shift(transform: Transform) -> Twist:
    """The rotation vector in rad and the translation in mm; of a small motion, its twist."""
    turn = Rotation.from_matrix(transform[:3, :3]).as_rotvec()
    return np.concatenate([turn, transform[:3, 3]])


def straightened(transform: Transform) -> Transform:
    """The rigid transform nearest to one with rounding errors; in long products they would grow."""
    left, _, right = np.linalg.svd(transform[:3, :3])
    return rigid(left @ right, transform[:3, 3])


def rigid_or_none(given: ArrayLike) -> Transform | None:
    """The rigid transform nearest to what somebody gave; ``None`` where it is none."""
    try:
        transform = np.array(given, float)
    except (TypeError, ValueError):  # ragged lists, words
        return None
    if is_rigid(transform):
        return transform
    return straightened(transform) if is_rigid(transform, MOST_OFF_TYPED) else None


def is_rigid(transform: np.ndarray, most_off: float = MOST_OFF) -> bool:
    """Whether it is a matrix of a rotation and a shift, and finite, but for so much."""
    if transform.shape != (4, 4) or not np.isfinite(transform).all():
        return False
    rotation = transform[:3, :3]
    bent, moved = rotation @ rotation.T - np.eye(3), transform[3] - LAST_ROW
    off = max(np.abs(bent).max(), np.abs(moved).max())
    return bool(off < most_off and np.linalg.det(rotation) > 0)
