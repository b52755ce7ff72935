# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Compiles or loads a tracker's loops before the first touch, which would wait for that else."""

from functools import cache

import numpy as np

from recon.pose.registration import OwnTouch, pixel_grid_mm
from recon.pose.tracker import Tracker

SIZE_PX, MM_PER_PX = (64, 64), (0.25, 0.25)
RADIUS_MM, DEPTH_MM = 4.0, 1.0


@cache
def warm_up() -> None:
    """Follow a cap that turns a little, once per process: every loop runs."""
    track = Tracker()
    for turn in (0.0, 0.02):
        track(_cap(turn))


def _cap(turn: float) -> OwnTouch:
    """A round cap whose outline is clear, with ripples that tell a turn about the normal."""
    x_mm, y_mm = np.meshgrid(*pixel_grid_mm(SIZE_PX, MM_PER_PX))
    radius_mm, angle = np.hypot(x_mm, y_mm), np.arctan2(y_mm, x_mm) - turn
    inside = radius_mm < RADIUS_MM
    shape = 1 - 0.5 * (radius_mm / RADIUS_MM) ** 2 * (1 + 0.2 * np.cos(3 * angle))
    depth_mm = (DEPTH_MM * shape * inside).astype(np.float32)
    along_y, along_x = np.gradient(depth_mm, *MM_PER_PX[::-1])
    return OwnTouch(
        gradient=np.stack([along_x, along_y], -1).astype(np.float32),
        depth_mm=depth_mm,
        contact=inside,
        mm_per_px=MM_PER_PX,
    )
