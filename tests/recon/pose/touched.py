# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Touches of a quarter of a frame's pixels, made once for all tests."""

from collections.abc import Iterable
from functools import cache

import numpy as np

from benchmarks.touches import SyntheticTouch, Thing, bead, cube_corner, motions, pressed
from recon.pose.models import TouchModel, keyframe
from recon.pose.registration import Registration, Touch, own
from recon.pose.rest import laid
from recon.pose.rigid import Transform
from sensor.design import Gel

SIZE_PX, MM_PER_PX = (160, 120), (0.1268, 0.1268)
PAIRS = 8


def touch(thing: Thing, pose: np.ndarray, seed: int | None) -> SyntheticTouch:
    rng = None if seed is None else np.random.default_rng(seed)
    return pressed(thing, pose, rng, size_px=SIZE_PX, mm_per_px=MM_PER_PX)


def coarse_bead() -> Thing:
    return bead(press_mm=1.4)


@cache
def bead_pair(number: int) -> tuple[SyntheticTouch, SyntheticTouch, np.ndarray]:
    moved = motions(np.random.default_rng(7), PAIRS)[number]
    before = touch(coarse_bead(), np.eye(4), 10 + number)
    return before, touch(coarse_bead(), moved, 50 + number), moved


def bead_pairs() -> list[tuple[SyntheticTouch, SyntheticTouch, np.ndarray]]:
    return [bead_pair(number) for number in range(PAIRS)]


@cache
def corner() -> SyntheticTouch:
    return touch(cube_corner(2.0), np.eye(4), 3)


def blank() -> SyntheticTouch:
    rng = np.random.default_rng(1)
    gradient = 0.05 * rng.standard_normal((*SIZE_PX[::-1], 2)).astype(np.float32)
    empty = np.zeros(SIZE_PX[::-1], np.float32)
    return SyntheticTouch(gradient=gradient, depth_mm=empty, contact=empty > 0, mm_per_px=MM_PER_PX)


def touches(
    seen: Iterable[tuple[Touch, Transform]], registration: Registration, gel: Gel | None = None
) -> TouchModel:
    """A model of touches with known poses, for a tracker of the same registration and gel."""
    return TouchModel(
        keyframes=[
            keyframe(laid(own(item), gel), pose, np.zeros((6, 6)), registration)
            for item, pose in seen
        ]
    )
