# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""What is known of an object's pose, and in plain words what is not."""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from recon.pose.rigid import Covariance, Points, Transform, applied, greatest_std, inverse

State = Literal["tracking", "weak", "frozen", "lost"]
"""``weak``: a pose with a warning; ``frozen``: the stream stands still; ``lost``: no pose."""
WEAK_DEG, WEAK_MM = 1.5, 0.15
"""Standard deviations that deserve a warning, of a shift where the object touches."""


@dataclass(frozen=True, kw_only=True)
class PoseEstimate:
    """What one touch says of the object's pose."""

    state: State
    """``"tracking"``, ``"weak"``, ``"frozen"`` or ``"lost"``."""
    reason: str = ""
    """Why the state is not ``tracking``, in plain words."""
    T_sensor_object: Transform | None = None
    """``None`` where lost."""
    covariance: Covariance | None = None
    """Of a twist x (rad, mm) in ``T_sensor_object @ motion(x)``, since the start."""
    overlap: float = 0.0
    """Share of the smaller contact that both touches show."""
    explained: float = 0.0
    """Share of the energy of the slopes there that the pose explains."""

    @property
    def words(self) -> str:
        """The state, and why where there is a reason."""
        return f"{self.state}: {self.reason}" if self.reason else self.state

    @property
    def rotation_std_deg(self) -> float:
        """Of the rotation vector's length; infinite without a pose."""
        if self.covariance is None:
            return np.inf
        return float(np.degrees(np.sqrt(np.trace(self.covariance[:3, :3]))))

    @property
    def translation_std_mm(self) -> float:
        """Of the object's origin; infinite without a pose."""
        return (
            np.inf if self.covariance is None else float(np.sqrt(np.trace(self.covariance[3:, 3:])))
        )


def is_certain(found: PoseEstimate, middle_mm: Points) -> bool:
    """Whether no direction of a pose is in doubt.

    Args:
        found: a pose.
        middle_mm: (3,), of the contact, in the gel frame: the place whose shift counts.
    """
    assert found.covariance is not None and found.T_sensor_object is not None
    place_mm = applied(inverse(found.T_sensor_object), middle_mm)
    turn_deg, shift_mm = greatest_std(found.covariance, place_mm)
    return turn_deg < WEAK_DEG and shift_mm < WEAK_MM


def disbelieved(found: PoseEstimate, reason: str) -> PoseEstimate:
    """No pose, and how much of the touch agreed with the one that is not believed."""
    overlap, explained = found.overlap, found.explained
    return PoseEstimate(state="lost", reason=reason, overlap=overlap, explained=explained)
