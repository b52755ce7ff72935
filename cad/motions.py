# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""How a body moves on its way out: shifts and turns, one after the other, in places and mm.

A way is listed from the body's place outward; going in is the same way backward.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Vector = tuple[float, float, float]
Pose = NDArray[np.float64]
"""(4, 4): moves homogeneous points of the finished sensor."""


@dataclass(frozen=True)
class Shift:
    """Straight on."""

    by: Vector

    def reach_mm(self, corners: NDArray[np.float64]) -> float:
        """Farthest that any point of a body travels, whose box has these (n, 3) corners."""
        return float(np.linalg.norm(self.by))

    def part(self, share: float) -> Pose:
        """The pose after a share, 0 to 1, of the motion."""
        pose = np.eye(4)
        pose[:3, 3] = share * np.array(self.by)
        return pose


@dataclass(frozen=True)
class Turn:
    """About a line along y through a point, from z toward x."""

    through: Vector
    angle_deg: float

    def reach_mm(self, corners: NDArray[np.float64]) -> float:
        """Farthest that any point of a body travels, whose box has these (n, 3) corners."""
        x, _, z = self.through
        radius = np.hypot(corners[:, 0] - x, corners[:, 2] - z).max()
        return float(radius * math.radians(abs(self.angle_deg)))

    def part(self, share: float) -> Pose:
        """The pose after a share, 0 to 1, of the motion."""
        angle = math.radians(share * self.angle_deg)
        cosine, sine = math.cos(angle), math.sin(angle)
        pose = np.eye(4)
        pose[:3, :3] = np.array([(cosine, 0.0, sine), (0.0, 1.0, 0.0), (-sine, 0.0, cosine)])
        point = np.array(self.through)
        pose[:3, 3] = point - pose[:3, :3] @ point
        return pose


Way = Sequence[Shift | Turn]


def poses(way: Way, box: NDArray[np.float64], step_mm: float) -> Iterator[tuple[float, Pose]]:
    """Poses along a way, so close that no point of the body moves farther than ``step_mm``.

    Args:
        way: shifts and turns from the body's place outward.
        box: (2, 3) lowest and highest corner of the body in its place.
        step_mm: longest step of the farthest point.

    Yields:
        How far the farthest point has travelled, in mm, and the pose; the first is the place.
    """
    corners = np.array(np.meshgrid(*box.T)).reshape(3, -1).T
    before, travelled = np.eye(4), 0.0
    yield 0.0, before
    for motion in way:
        reach = motion.reach_mm(moved(corners, before))
        count = max(1, math.ceil(reach / step_mm - 1e-9))
        for number in range(1, count + 1):
            yield travelled + reach * number / count, motion.part(number / count) @ before
        before, travelled = motion.part(1.0) @ before, travelled + reach


def turned_out(way: Way) -> Pose:
    """The pose after the turns alone: as the body is held when it comes near."""
    pose = np.eye(4)
    for motion in way:
        if isinstance(motion, Turn):
            pose = motion.part(1.0) @ pose
    return pose


def straight(way: Way) -> NDArray[np.float64]:
    """(3,) sum of the shifts, by which pictures pull the body away."""
    shifts = [motion.by for motion in way if isinstance(motion, Shift)]
    return np.sum(np.array(shifts, np.float64).reshape(-1, 3), axis=0)


def moved(points: NDArray[np.float64], pose: Pose) -> NDArray[np.float64]:
    """(n, 3) points in a pose."""
    return np.asarray(points @ pose[:3, :3].T + pose[:3, 3])
