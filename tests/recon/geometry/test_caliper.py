# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""A caliper's gap is measured at any angle, on the twin's elastic skin and in closed form."""

from dataclasses import replace
from functools import partial

import numpy as np
import pytest

from recon.geometry.caliper import (
    Gap,
    find_gap,
    scale_in_proportion,
    scale_of,
    shading_response,
    slopes_of,
)
from recon.lights import Axis
from recon.pixels import BallPress
from sensor.design import STANDARD
from sensor.errors import WedgeError
from simulation.skin import gel_view, pressed
from tests.shading import pressed as pressed_ball

GAP_MM, JAW_MM, COLLAR_MM = 5.0, 3.5, 0.5
CENTER_MM = (1.5, -0.7)
VIEW = gel_view(STANDARD, 240)


def away_from_jaws(x: np.ndarray, y: np.ndarray, angle_deg: float) -> list[np.ndarray]:
    """Distance in mm into the gap side from each jaw's edge, infinite beside the jaws."""
    angle = np.radians(angle_deg)
    across = np.cos(angle) * (x - CENTER_MM[0]) + np.sin(angle) * (y - CENTER_MM[1])
    along = np.cos(angle) * (y - CENTER_MM[1]) - np.sin(angle) * (x - CENTER_MM[0])
    return [
        np.where(np.abs(along) < half_mm, GAP_MM / 2 - side * across, np.inf)
        for side, half_mm in ((-1, 4.5), (1, 3.5))
    ]


def jaws(angle_deg: float) -> np.ndarray:
    """Gradient field of two jaws, one a little deeper, in closed form; pixels average their area.

    The gel hangs on as exp(-distance / COLLAR_MM), which is the twin's law where an edge is long.
    """
    fine = 4
    side = (np.arange(fine) + 0.5) / fine - 0.5
    x, y = (axis[..., None, None] for axis in VIEW.grid_mm)
    x = x + side[:, None] * VIEW.mm_per_px[0]
    y = y + side[None, :] * VIEW.mm_per_px[1]
    x, y = np.broadcast_arrays(x, y)
    angle = np.radians(angle_deg)
    slope = np.zeros(x.shape)
    for sign, depth_mm, away in zip(
        (-1, 1), (0.5, 0.4), away_from_jaws(x, y, angle_deg), strict=True
    ):
        outside = (away > 0) & (away < GAP_MM)
        slope += sign * np.where(outside, depth_mm / COLLAR_MM * np.exp(-away / COLLAR_MM), 0)
        outer = (away < -JAW_MM) & np.isfinite(away)
        hung = depth_mm / COLLAR_MM * np.exp((away + JAW_MM) / COLLAR_MM)
        slope -= sign * np.where(outer, hung, 0)
    mean = slope.mean((-1, -2))
    noise = np.random.default_rng(0).normal(0, 0.02, (*mean.shape, 2))
    field = np.stack([np.cos(angle) * mean, np.sin(angle) * mean], -1) + noise
    return field.astype(np.float32)


def matches(gap: Gap | None, angle_deg: float, within_mm: float) -> bool:
    """Width and direction and place of a gap."""
    assert gap is not None
    lean = np.degrees(np.arctan2(gap.normal[1], gap.normal[0])) - angle_deg
    away = np.dot(np.subtract(gap.center_px, VIEW.pixel(*CENTER_MM)), gap.normal)
    width_mm = gap.width_px * VIEW.mm_per_px[0]
    straight = abs((lean + 90) % 180 - 90) < 1
    return bool(abs(width_mm - GAP_MM) < within_mm and straight and abs(away) < 1)


@pytest.mark.parametrize("angle_deg", [0, 20, 45, 90, 133, 250])
def test_the_gap_between_jaws_is_found_at_any_angle(angle_deg: float) -> None:
    assert matches(find_gap(jaws(angle_deg)), angle_deg, 0.05)


def test_the_gap_is_found_on_the_skin_of_the_twin() -> None:
    angle_deg = 25.0
    reach = np.full(VIEW.grid_mm[0].shape, -np.inf)
    half_px_mm = VIEW.mm_per_px[0] / 2  # a jaw's first pixel is wholly pressed: it begins before
    for away in away_from_jaws(*VIEW.grid_mm, angle_deg):
        reach[(away < half_px_mm) & (away > -JAW_MM)] = 0.4
    depth = pressed(VIEW, STANDARD.gel, reach, cover_mm=0.1).depth_mm
    down, right = np.gradient(depth, *VIEW.mm_per_px[::-1])
    assert matches(find_gap(np.stack([right, down], -1).astype(np.float32)), angle_deg, 0.1)


@pytest.mark.parametrize("faces_away", [-1, 1])
def test_a_lone_light_may_show_one_edge_half_as_steep(faces_away: int) -> None:
    seen = jaws(0.0)
    seen[faces_away * seen > 0] *= 0.55
    assert matches(find_gap(seen), 0.0, 0.05)


def test_what_the_edge_of_the_pad_shows_is_no_jaw() -> None:
    seen = jaws(90.0)
    seen[-4:, :, 1] += 2.0
    assert matches(find_gap(seen), 90.0, 0.05)


def test_the_rim_of_a_hole_is_no_gap() -> None:
    """Its sides face each other and are alike, but they are round."""
    x, y = (axis - at for axis, at in zip(VIEW.grid_mm, CENTER_MM, strict=True))
    inward_mm = GAP_MM / 2 - np.hypot(x, y)
    steep = np.where(inward_mm > 0, np.exp(-inward_mm / COLLAR_MM), 0.0)
    outward = np.stack([x, y], -1) / np.maximum(np.hypot(x, y), 1e-9)[..., None]
    assert find_gap((steep[..., None] * outward).astype(np.float32)) is None


def ball_press(x_px: float, y_px: float, radius_px: float) -> BallPress:
    """A ball's press, by a circle that lies where it touched."""
    return BallPress(
        file="ball.png",
        difference=pressed_ball((240, 180), (x_px, y_px), radius_px, 30.0),
        center_px=(x_px, y_px),
        contact_radius_px=radius_px,
        ball_radius_mm=3.0,
        mm_per_px=(0.1, 0.1),
    )


def test_circles_that_are_not_the_balls_hardly_change_how_colours_are_read() -> None:
    right = [ball_press(60.0, 60.0, 16.0), ball_press(150.0, 110.0, 18.0)]
    pressed = ball_press(110.0, 90.0, 14.0)
    wrong = replace(pressed, center_px=(115.0, 72.0), contact_radius_px=27.0)
    known = shading_response(right)
    read = shading_response([*right, wrong])
    assert np.abs(read - known).max() < 0.05 * np.abs(known).max()
    # ... although it has more pixels than both others, and a reading of its own.
    assert np.abs(shading_response([wrong]) - known).max() > 0.5 * np.abs(known).max()


def test_neither_balls_nor_blank_gel_have_a_gap() -> None:
    press = ball_press(100.0, 90.0, 20.0)
    ball, response = press.difference, shading_response([press])
    assert find_gap(slopes_of(ball, response)) is None
    assert find_gap(np.zeros((120, 160, 2), np.float32)) is None
    noise = np.random.default_rng(1).normal(0, 0.02, (180, 240, 2)).astype(np.float32)
    assert find_gap(noise) is None


def exact_gap(angle_deg: float, mm_per_px: tuple[float, float]) -> Gap:
    """What the jaws' two lines are in pixels that are not square."""
    normal_px = np.array([np.cos(np.radians(angle_deg)), np.sin(np.radians(angle_deg))]) * mm_per_px
    length = float(np.linalg.norm(normal_px))
    x, y = normal_px / length
    return Gap(width_px=GAP_MM / length, normal=(float(x), float(y)), center_px=(0.0, 0.0))


def test_scale_along_both_axes_follows_from_exact_gaps() -> None:
    pitch = (0.08, 0.13)
    scale = scale_of([exact_gap(angle, pitch) for angle in (10, 95, 50, 160)], GAP_MM)
    assert scale.mm_per_px == pytest.approx(pitch, rel=1e-9)
    assert 0 < scale.sigma_mm_per_px[0] < 0.02 * pitch[0]


@pytest.mark.parametrize("unseen", ["x", "y"])
def test_a_pitch_in_known_proportion_follows_from_gaps_of_one_direction(unseen: Axis) -> None:
    pitch, across = np.array([0.08, 0.13]), 90.0 if unseen == "x" else 0.0
    gaps = [exact_gap(across + lean, (0.08, 0.13)) for lean in (-3, 0, 4)]
    x, y = 0.7 * pitch
    scale = scale_in_proportion(gaps, GAP_MM, (float(x), float(y)), unseen)
    assert scale.mm_per_px == pytest.approx(tuple(pitch), rel=1e-9)
    assert scale.unseen == unseen
    shares = np.divide(scale.sigma_mm_per_px, pitch)
    assert shares[0] == pytest.approx(shares[1])
    one = scale_in_proportion(gaps[:1], GAP_MM, (float(x), float(y)), unseen)
    assert shares[0] == pytest.approx(one.sigma_mm_per_px[0] / pitch[0] / np.sqrt(3), rel=0.01)


def test_uncertainty_covers_the_error() -> None:
    rng = np.random.default_rng(2)
    pitch, pulls = np.array([0.1, 0.11]), []
    for _ in range(60):
        exact = [exact_gap(angle, (0.1, 0.11)) for angle in rng.uniform(0, 180, 3).cumsum()]
        seen = [
            Gap(width_px=g.width_px + rng.normal(0, 0.55), normal=g.normal, center_px=g.center_px)
            for g in exact
        ]
        try:
            scale = scale_of(seen, GAP_MM)
        except WedgeError:
            continue
        pulls.append((np.array(scale.mm_per_px) - pitch) / scale.sigma_mm_per_px)
    assert len(pulls) > 40
    assert 0.5 < np.square(pulls).mean() < 2.0


def test_the_uncertainty_of_two_readings_is_that_of_their_mean() -> None:
    """Of 54 and 46 px it is 4 px, their standard deviation over the root of two."""
    across = [Gap(width_px=w, normal=(1.0, 0.0), center_px=(0.0, 0.0)) for w in (54.0, 46.0)]
    along = Gap(width_px=50.0, normal=(0.0, 1.0), center_px=(0.0, 0.0))
    scale = scale_of([*across, along], GAP_MM)
    assert scale.sigma_mm_per_px[0] / scale.mm_per_px[0] == pytest.approx(4 / 50, rel=0.02)


@pytest.mark.parametrize("angle_deg", [0, 60, 133, 250])
def test_the_gap_s_middle_lies_where_both_jaws_are(angle_deg: float) -> None:
    gap = find_gap(jaws(angle_deg))
    assert gap is not None
    assert np.hypot(*np.subtract(gap.center_px, VIEW.pixel(*CENTER_MM))) < 3


def test_one_direction_and_no_picture_are_refused() -> None:
    for no_gaps in (scale_of, partial(scale_in_proportion, mm_per_px=(0.1, 0.1), unseen="x")):
        with pytest.raises(WedgeError, match="in none of its pictures"):
            no_gaps([], GAP_MM)
        with pytest.raises(WedgeError, match="measures nothing"):
            no_gaps([exact_gap(0, (0.1, 0.1))], 0.0)
    with pytest.raises(WedgeError, match="same direction"):
        scale_of([exact_gap(angle, (0.1, 0.1)) for angle in (2, 178, 9)], GAP_MM)
    for gap_mm in (0.0, -1.0):
        with pytest.raises(WedgeError, match="mm measures nothing"):
            scale_of([exact_gap(angle, (0.1, 0.1)) for angle in (2, 92)], gap_mm)
