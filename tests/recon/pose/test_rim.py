# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""The contact's rim: what it brings beside gel that lies still, and what beside a collar."""

from dataclasses import replace
from functools import cache

import cv2
import numpy as np
import pytest
from jaxtyping import Float32

from benchmarks.touches import (
    SLOPE_NOISE,
    SyntheticTouch,
    Thing,
    bar_edges,
    lowest_surface,
    motions,
)
from recon.integration.poisson import integrate
from recon.pose.joint import Joint
from recon.pose.pyramid import Pyramid
from recon.pose.registration import pixel_grid_mm
from recon.pose.rigid import angle_deg, inverse, shift_mm
from recon.pose.rim import Rim, rim
from recon.pose.template import residuals
from tests.recon.pose.touched import MM_PER_PX, SIZE_PX

PAIRS = 5
SOFT_MM = 0.4
"""How far soft gel drags its neighbours along."""
ROUNDS, OVERSHOOT = 60, 1.7


def skin(object_mm: Float32[np.ndarray, "h w"], drag_mm: float) -> Float32[np.ndarray, "h w"]:
    """Depth w of gel that an object presses; free gel obeys w = s^2 lap w (red-black SOR)."""
    stiff = np.float32((drag_mm / MM_PER_PX[0]) ** 2)
    cross = np.array([[0, 1, 0], [1, 0, 1], [0, 1, 0]], np.float32)
    depth = np.maximum(object_mm, 0)
    odd = np.indices(depth.shape).sum(0) % 2 == 1
    for half in (odd, ~odd) * ROUNDS:
        around = cv2.filter2D(depth, -1, cross, borderType=cv2.BORDER_CONSTANT)
        free = depth + OVERSHOOT * (around * stiff / (1 + 4 * stiff) - depth)
        depth = np.where(half, np.maximum(free, object_mm), depth)
    return np.maximum(depth, 0)


def pressed_into_gel(thing: Thing, pose: np.ndarray, drag_mm: float, seed: int) -> SyntheticTouch:
    lattice = np.stack(np.meshgrid(*pixel_grid_mm(SIZE_PX, MM_PER_PX)), -1)
    object_mm = -lowest_surface(thing, pose, lattice)[0].astype(np.float32)
    depth = skin(object_mm, drag_mm)
    along_y, along_x = np.gradient(depth, MM_PER_PX[0])
    noise = SLOPE_NOISE * np.random.default_rng(seed).standard_normal((*depth.shape, 2))
    gradient = (np.stack([along_x, along_y], -1) + noise).astype(np.float32)
    return SyntheticTouch(
        gradient=gradient,
        depth_mm=integrate(gradient, MM_PER_PX, "dirichlet"),
        contact=(depth > 0.04) & (depth <= object_mm + 1e-5),
        mm_per_px=MM_PER_PX,
    )


@cache
def bar_pairs(drag_mm: float) -> list[tuple[SyntheticTouch, SyntheticTouch, np.ndarray]]:
    return [
        (
            pressed_into_gel(bar_edges(), np.eye(4), drag_mm, 10 + number),
            pressed_into_gel(bar_edges(), moved, drag_mm, 50 + number),
            moved,
        )
        for number, moved in enumerate(motions(np.random.default_rng(7), PAIRS))
    ]


def errors(drag_mm: float) -> tuple[float, float]:
    """Root mean squares in degrees and mm."""
    found = []
    for first, second, moved in bar_pairs(drag_mm):
        left = (
            inverse(moved)
            @ Joint().align(Pyramid(first), Pyramid(second), np.eye(4)).T_current_reference
        )
        found.append((angle_deg(left), shift_mm(left)))
    turn, shift = np.sqrt(np.mean(np.square(found), 0))
    return float(turn), float(shift)


def believing(monkeypatch: pytest.MonkeyPatch, share: float) -> None:
    monkeypatch.setattr(Rim, "believed", lambda *_: share)


def test_beside_still_gel_the_rim_brings_the_pose_nearer(monkeypatch):
    turn, shift = errors(0.0)
    believing(monkeypatch, 0.0)
    inside_turn, inside_shift = errors(0.0)
    assert turn < 0.8 * inside_turn and shift < 0.8 * inside_shift


def test_a_collar_does_not_pull_the_pose(monkeypatch):
    turn, shift = errors(SOFT_MM)
    believing(monkeypatch, 0.0)
    inside_turn, inside_shift = errors(SOFT_MM)
    assert turn < 1.2 * inside_turn and shift < 1.2 * inside_shift
    believing(monkeypatch, 1.0)
    assert errors(SOFT_MM)[0] > 1.5 * inside_turn  # so there was something to withstand


def test_what_noise_does_not_explain_is_added_to_the_variance():
    angles = np.linspace(0, 2 * np.pi, 400, endpoint=False)
    points = np.stack([np.cos(angles), np.sin(angles), 0 * angles], -1).astype(np.float32)
    noise_mm, off_mm = 0.01, 0.02
    whole = Rim(
        pixels=np.ones(400, bool),
        residual=np.full(400, off_mm, np.float32),
        change=np.zeros((400, 6), np.float32),
        points=points,
        weight=1.0,
    )
    alike = whole.believed(noise_mm**2, np.zeros((6, 6)))
    np.testing.assert_allclose(alike, noise_mm**2 / 400 / off_mm**2, rtol=1e-5)
    scattered = np.random.default_rng(0).normal(0, noise_mm, 400).astype(np.float32)
    assert replace(whole, residual=scattered).believed(noise_mm**2, np.zeros((6, 6))) > 0.3
    doubted = replace(whole, change=np.ones((400, 6), np.float32))
    assert doubted.believed(noise_mm**2, np.eye(6)) == 1.0  # the pose may be as far off


def plateau(last_column: int) -> Pyramid:
    height, width = SIZE_PX[::-1]
    column = np.arange(width)
    raised = np.where((column > 10) & (column < last_column), 0.3, 0.0)
    raised = np.broadcast_to(raised, (height, width))
    drift = 0.001 * column  # of depth, along the frame
    return Pyramid(
        SyntheticTouch(
            gradient=np.zeros((height, width, 2), np.float32),
            depth_mm=(raised + drift).astype(np.float32),
            contact=raised > 0,
            mm_per_px=MM_PER_PX,
        )
    )


def rim_of(reference: Pyramid, current: Pyramid) -> tuple[Rim, np.ndarray, np.ndarray]:
    """Where both touch as they are, and its columns and rows."""
    _, common = residuals(reference.templates[0], current.level(0), np.eye(4))
    edge = rim(reference, current, common, np.eye(4))
    assert edge is not None
    columns, rows = (
        np.rint(edge.points[:, axis] / MM_PER_PX[axis] + (count - 1) / 2)
        for axis, count in enumerate(SIZE_PX)
    )
    return edge, columns, rows


def test_the_rim_lies_beside_gel_and_its_height_is_taken_above_it():
    both = plateau(40)
    edge, columns, rows = rim_of(both, both)
    from_border = np.minimum(rows, SIZE_PX[1] - 1 - rows)
    assert set(columns[from_border > 3]) == {12, 38}
    assert not np.any(abs(columns - 25) < 5)  # the frame's border cuts there, and no gel is near
    np.testing.assert_allclose(-edge.points[:, 2], 0.3, atol=0.01)
    np.testing.assert_allclose(edge.residual, 0, atol=0.002)


def test_where_the_other_touch_has_no_gel_near_nothing_is_compared():
    edge, columns, rows = rim_of(plateau(40), plateau(80))
    from_border = np.minimum(rows, SIZE_PX[1] - 1 - rows)
    assert set(columns[from_border > 3]) == {12}
    np.testing.assert_allclose(edge.residual, 0, atol=0.002)
