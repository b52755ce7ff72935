# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Which colours a set of lights has, and which gradient it can see.

A light at azimuth a brightens slopes along a, so lights on one line leave the gradient across
that line unseen. (The paper's configurations R and RB, section IV-B.)
"""

from collections.abc import Mapping
from typing import Literal

import numpy as np

Axis = Literal["x", "y"]

ALIGNED_DEG = 30.0
"""Lights this close to an axis lie on one line..."""
OBLIQUE_DEG = 15.0
"""...and others that are this close to their mean line."""
LEAST_TURN_DEG = 5.0
"""A line this close to an axis counts as the axis itself."""


def unseen_axis(lights_deg: Mapping[str, float] | None, channels: str) -> Axis | None:
    """The axis whose gradient none of these channels' lights can see, or see least of.

    ``None`` where both are seen, or where nobody said where the lights sit.
    """
    line_deg = lights_line_deg(lights_deg, channels)
    if line_deg is None:
        return None
    return "x" if _from_axis_deg(line_deg, 90.0) <= 45 else "y"


def line_turn_deg(lights_deg: Mapping[str, float] | None, channels: str) -> float:
    """By how much the line of the lights is turned away from the axis that they see, -45 to 45.

    From x toward y; 0 where they lie on no line, or along an axis.
    """
    line_deg = lights_line_deg(lights_deg, channels)
    if line_deg is None:
        return 0.0
    seen_deg = 90.0 if unseen_axis(lights_deg, channels) == "x" else 0.0
    turn = (line_deg - seen_deg + 90) % 180 - 90
    return turn if abs(turn) > LEAST_TURN_DEG else 0.0


def lights_line_deg(lights_deg: Mapping[str, float] | None, channels: str) -> float | None:
    """The azimuth of the line on which these channels' lights lie, from 0 to below 180.

    ``None`` where they do not, so that both slopes are seen, or where nobody said where they sit.
    """
    if lights_deg is None or not channels or not set(channels) <= set(lights_deg):
        return None
    angles = [lights_deg[channel] for channel in channels]
    twice = np.exp(2j * np.radians(angles)).mean()  # opposite directions are one line
    line_deg = float(np.degrees(np.angle(twice)) / 2 % 180)
    tolerated = ((90.0, ALIGNED_DEG), (0.0, ALIGNED_DEG), (line_deg, OBLIQUE_DEG))
    on_one = any(
        all(_from_axis_deg(angle, axis) <= within for angle in angles) for axis, within in tolerated
    )
    return line_deg if on_one else None


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


def channel_indices(channels: str) -> list[int]:
    """Columns of "RGB" that the channels name."""
    return ["RGB".index(channel) for channel in channels]
