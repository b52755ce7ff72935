# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Undersides of the showcase objects against the geometry of what they are called by."""

import numpy as np
import pytest

from sensor.design import STANDARD
from simulation.indenters import (
    cube_corner,
    lego_brick,
    m2_screw,
    prism,
    screw_cap,
    shapes,
    thread_rod,
    tyre_tread,
)


def test_the_faces_of_a_cube_s_corner_are_square_to_each_other() -> None:
    azimuths = np.radians([90.0, 210.0, 330.0])
    normals = []
    for azimuth in azimuths:
        at = np.array([np.cos(azimuth), np.sin(azimuth)])
        places = at[:, None] + 1e-3 * np.array([[0, 1, 0], [0, 0, 1]])
        height = cube_corner(*places, edge_mm=6.0)
        slope = (height[1:] - height[0]) / 1e-3
        normals.append(np.array([*slope, -1]) / np.sqrt(1 + slope @ slope))
    assert np.array(normals) @ np.array(normals).T == pytest.approx(np.eye(3), abs=1e-9)
    assert cube_corner(np.zeros(1), np.zeros(1), edge_mm=6.0) == [0.0]


@pytest.mark.parametrize("half_angle_deg", [30.0, 60.0])
def test_a_prism_s_edge_opens_by_its_angle(half_angle_deg: float) -> None:
    y = np.array([-1.0, 0.0, 1.0])
    low, edge, high = prism(np.zeros(3), y, length_mm=5.0, half_angle_deg=half_angle_deg)
    assert edge == 0 and low == high
    assert np.degrees(np.arctan2(1.0, high)) == pytest.approx(half_angle_deg)
    assert np.isinf(prism(np.array([2.51]), np.zeros(1), length_mm=5.0, half_angle_deg=60.0)).all()


def test_threads_side_by_side_are_half_circles_that_meet() -> None:
    x = np.linspace(-1.6, 1.6, 3201)
    height = thread_rod(x, np.zeros_like(x), pitch_mm=0.8, size_mm=6.0)
    beside = np.abs((x % 0.8) - 0.4)
    assert (0.4 - height) ** 2 + beside**2 == pytest.approx(np.full(x.shape, 0.4**2))
    assert height.min() == 0 and height.max() == pytest.approx(0.4)


def test_a_screw_s_thread_is_a_helix_as_deep_as_an_m2_s() -> None:
    pitch, depth = 0.4, 0.613 * 0.4  # ISO 68-1: 5/8 of the triangle's height
    x = np.linspace(-2, 2, 4001)
    for azimuth in np.radians([0.0, 20.0, -35.0]):
        y = np.full_like(x, np.sin(azimuth))
        above = 1 - m2_screw(x, y, length_mm=8.0)
        here = np.isfinite(above)
        radius = np.hypot(above, y)
        turned = 1 - m2_screw(x + pitch * azimuth / (2 * np.pi), 0 * y, length_mm=8.0)
        assert radius[here] == pytest.approx(turned[here])
        again = 1 - m2_screw(x + pitch, y, length_mm=8.0)
        assert above[here] == pytest.approx(again[here])
    assert 1 - np.ptp(turned) == pytest.approx(1 - depth)
    assert turned.max() == 1


def test_a_brick_s_studs_are_round_flat_and_blunt_at_their_edge() -> None:
    x = np.linspace(0, 3.9, 3901)
    height = lego_brick(x + 4.0, np.full_like(x, 4.0), studs=(2, 2))
    assert (height[x < 2.25] == 0).all() and (height[x > 2.4] == 1.8).all()
    edge = (x > 2.25) & (x < 2.399)
    assert (0.15 - height[edge]) ** 2 + (x[edge] - 2.25) ** 2 == pytest.approx(
        np.full(edge.sum(), 0.15**2)
    )


def test_a_cap_s_ring_has_its_ridges_outside_and_is_smooth_within() -> None:
    wall, azimuth = 0.8, np.radians(np.arange(0, 360, 0.5))
    out = np.linspace(3.5, 5.2, 1701)
    heights = screw_cap(
        out * np.cos(azimuth)[:, None], out * np.sin(azimuth)[:, None],
        radius_mm=5.0, wall_mm=wall, ridges=24,
    )  # fmt: skip
    under = np.isfinite(heights)
    outer = np.array([out[row].max() for row in under])
    inner = np.array([out[row].min() for row in under])
    assert inner == pytest.approx(np.full(inner.shape, 5.0 - 1.5 * wall), abs=0.002)
    assert (outer.max(), outer.min()) == pytest.approx((5.0, 5.0 - wall / 2), abs=0.002)
    waves = np.abs(np.fft.rfft(outer - outer.mean()))
    assert waves.argmax() == 24
    assert (
        np.array([row[seen].min() for row, seen in zip(heights, under, strict=True)]).max() < 0.01
    )


def test_a_tyre_s_blocks_stand_out_of_its_grooves_on_a_wheel() -> None:
    x, y = np.meshgrid(np.linspace(-5.9, 5.9, 400), np.linspace(-5.9, 5.9, 400))
    height = tyre_tread(x, y, size_mm=12.0)
    above = height - (30 - np.sqrt(30**2 - y**2))
    assert np.unique(np.round(above, 9)).tolist() == [0.0, 0.8]
    # The zigzag groove is 9 % of the width, and those across are 36 % of the length.
    assert (above < 0.4).mean() == pytest.approx(0.91 * 0.64, rel=0.02)
    assert (above[:, 180:220].max(axis=1) > 0.4).all()  # the zigzag groove goes all around


def test_the_showcase_s_objects_are_as_large_as_they_say_and_no_larger_than_the_pad() -> None:
    along = np.linspace(-13, 13, 651)
    x, y = np.meshgrid(along, along)
    for name, shape in shapes(STANDARD.pad_size_mm).items():
        seen = np.isfinite(shape.profile(x, y))
        reach = np.abs(x[seen]).max(), np.abs(y[seen]).max()
        for found, said, pad in zip(reach, shape.size_mm, STANDARD.pad_size_mm, strict=True):
            assert 2 * found <= said + 1e-9 or name in ("cube_corner", "prism"), name
            assert said <= pad
