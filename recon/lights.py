# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Which gradient a set of lights can see.

A light at azimuth a brightens slopes along a, so lights on one line leave the gradient across
that line unseen. (The paper's configurations R and RB, section IV-B.)
"""

from collections.abc import Mapping
from typing import Literal

Axis = Literal["x", "y"]

ALIGNED_DEG = 30.0
"""A light this close to an axis counts as lying on it."""


def unseen_axis(lights_deg: Mapping[str, float] | None, channels: str) -> Axis | None:
    """The axis whose gradient none of these channels' lights can see.

    ``None`` where both are seen, or where nobody said where the lights sit.
    """
    if lights_deg is None or not set(channels) <= set(lights_deg):
        return None
    angles = [lights_deg[channel] for channel in channels]
    if all(_from_axis_deg(angle, 90.0) <= ALIGNED_DEG for angle in angles):
        return "x"
    if all(_from_axis_deg(angle, 0.0) <= ALIGNED_DEG for angle in angles):
        return "y"
    return None


def sits_like_wedge(lights_deg: Mapping[str, float] | None) -> bool:
    """Whether green shines along x and red and blue against each other along y."""
    if lights_deg is None or set(lights_deg) != {"R", "G", "B"}:
        return False
    opposed = abs(azimuth_deg(lights_deg["R"] - lights_deg["B"])) >= 180 - 2 * ALIGNED_DEG
    along_y = all(_from_axis_deg(lights_deg[channel], 90.0) <= ALIGNED_DEG for channel in "RB")
    return opposed and along_y and _from_axis_deg(lights_deg["G"], 0.0) <= ALIGNED_DEG


def _from_axis_deg(angle_deg: float, axis_deg: float) -> float:
    """Angle between a light's azimuth and a line, 0 to 90."""
    return abs((angle_deg - axis_deg + 90) % 180 - 90)


def azimuth_deg(angle_deg: float) -> float:
    """The same direction, above -180 and up to 180."""
    return 180 - (180 - angle_deg) % 360
