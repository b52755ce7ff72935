# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""How four corners magnify a dent: not at all where a homography is exact, else more by depth."""

import re
from dataclasses import replace

import numpy as np
import pytest

import simulation.raw_view
from benchmarks.magnification import (
    caliper_scale,
    cap_mm,
    dented,
    magnification,
    middle,
    misplaced_mm,
    off_by,
    rows,
    seen_at_mm,
    times_as_wide,
    times_by,
    without_lens,
)
from sensor.design import FINGER, STANDARD, Wedge
from simulation.indenters import CALIBRATION_BALL_MM
from simulation.presses import contact_circle_px
from simulation.raw_view import corners_px, pad_corners_px, unwarped_skin
from simulation.skin import Skin, gel_view

GRID = np.stack(np.meshgrid([-0.8, 0.0, 0.8], [-0.8, 0.0, 0.8]), -1).reshape(-1, 2)
BOTH = pytest.mark.parametrize("design", [STANDARD, FINGER], ids=lambda design: design.name)


def straight_rays(design: Wedge, monkeypatch: pytest.MonkeyPatch) -> Wedge:
    """A pinhole over a plane, in acrylic and gel that bend no light."""
    bent = simulation.raw_view._bent
    monkeypatch.setattr(simulation.raw_view, "_bent", lambda ray, index: bent(ray, 1.0))
    return without_lens(replace(design, gel=replace(design.gel, curved=False)))


def test_a_dent_seen_straight_on_is_as_wide_as_it_is() -> None:
    skin = dented(STANDARD, gel_view(STANDARD, 160), 0.0, 0.0, 0.6)
    assert times_as_wide(skin, skin) == 1
    twice = Skin(depth_mm=skin.depth_mm, contact=np.kron(skin.contact, np.ones((2, 2))) > 0)
    assert times_as_wide(twice, skin) == pytest.approx(2)


@BOTH
def test_straight_rays_show_a_plane_where_it_is_and_nearer_ones_larger_all_alike(
    design: Wedge, monkeypatch: pytest.MonkeyPatch
) -> None:
    design = straight_rays(design, monkeypatch)
    points_mm = GRID * np.array(design.pad_size_mm) / 2
    np.testing.assert_allclose(seen_at_mm(design, points_mm, 0.0), points_mm, atol=1e-3)
    assert misplaced_mm(design) < 2e-3
    far_mm = []
    for depth_mm in (0.3, 0.9):
        seen_mm = seen_at_mm(design, points_mm, depth_mm)
        times = (np.ptp(seen_mm, axis=0) / np.ptp(points_mm, axis=0)).mean()
        middle_mm = seen_mm[len(GRID) // 2]
        np.testing.assert_allclose(seen_mm, middle_mm + times * points_mm, atol=2e-3)
        far_mm.append(depth_mm * times / (times - 1))  # of the camera's picture in the mirror
    assert far_mm[0] == pytest.approx(far_mm[1], rel=0.02)


@BOTH
def test_the_deeper_the_larger_with_the_lens_and_without(design: Wedge) -> None:
    for camera in (design, without_lens(design)):
        times = [magnification(camera, depth_mm) for depth_mm in (0.0, 0.3, 0.6, 0.9)]
        assert times == sorted(set(times))
    assert magnification(design, 0.0) > 1.02 > magnification(without_lens(design), 0.0)
    flat = replace(design, gel=replace(design.gel, curved=False))
    assert magnification(flat, 0.0) > magnification(design, 0.0)  # a dome's middle lies farther


@BOTH
def test_contacts_are_as_many_times_as_wide_as_skin_at_their_rim(design: Wedge) -> None:
    view, depth_mm = gel_view(design, 320), 0.6
    skin = dented(design, view, 0.0, 0.0, depth_mm)
    *_, radius_px = contact_circle_px(skin)
    rim_mm = depth_mm - cap_mm(radius_px * view.mm_per_px[0])
    for camera in (design, without_lens(design)):
        times = times_as_wide(unwarped_skin(camera, view, skin), skin)
        assert times == pytest.approx(magnification(camera, rim_mm), abs=0.012)


@BOTH
def test_a_caliper_in_the_middle_measures_what_is_pressed_there(design: Wedge) -> None:
    for camera in (design, without_lens(design)):
        assert caliper_scale(camera) * magnification(camera, 0.4) == pytest.approx(1, abs=0.005)


def test_skin_away_from_the_corners_is_seen_beside_its_place_less_far_without_the_lens() -> None:
    corners_mm = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) * np.array(STANDARD.pad_size_mm) / 2
    off_mm = np.hypot(*(seen_at_mm(STANDARD, 0.5 * corners_mm, 0.0) - 0.5 * corners_mm).T)
    assert off_mm.max() <= misplaced_mm(STANDARD)
    assert misplaced_mm(without_lens(STANDARD)) < misplaced_mm(STANDARD)


@pytest.mark.parametrize("radius_mm", [0.1, 1.2, 2.4])
def test_a_cap_ends_where_the_ball_is_as_wide_as_its_circle(radius_mm: float) -> None:
    to_middle_mm = CALIBRATION_BALL_MM - cap_mm(radius_mm)
    assert np.hypot(to_middle_mm, radius_mm) == pytest.approx(CALIBRATION_BALL_MM)


def test_the_command_tells_the_middle_as_it_is() -> None:
    rest, per_mm, flat, pinhole, both = map(float, re.findall(r"[-+]?\d\.\d{3}", middle(STANDARD)))
    assert rest + 0.4 * per_mm == pytest.approx(magnification(STANDARD, 0.4), abs=2e-3)
    assert flat > rest > both > pinhole  # the lens magnifies, the dome takes away


@BOTH
def test_by_corners_beside_the_pad_s_all_looks_smaller_by_as_much(design: Wedge) -> None:
    length_mm, width_mm = design.pad_size_mm
    own_px = np.array(pad_corners_px(design))
    wider_px = np.array(corners_px(design, (1.02 * length_mm, 1.02 * width_mm)))
    for x_mm, y_mm in GRID * np.array(design.pad_size_mm) / 2:
        assert times_by(design, own_px, own_px, x_mm, y_mm) == pytest.approx(1, abs=1e-6)
        assert times_by(design, wider_px, own_px, x_mm, y_mm) == pytest.approx(1 / 1.02, 4e-3)
    assert off_by(design, own_px).endswith("0.0 to 0.0 px off")


def test_no_row_is_of_a_press_that_the_gel_does_not_bear() -> None:
    found = rows(FINGER, gel_view(FINGER, 80), np.array(pad_corners_px(FINGER)))
    told = [row.split(")")[1].split()[0] for row in found]
    assert set(told) == {"0.3", "0.6"}
