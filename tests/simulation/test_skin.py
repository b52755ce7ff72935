# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""The skin under an object obeys its equation, and its contact grows with the press."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import brentq
from scipy.special import k0, k1

from sensor.design import FINGER, STANDARD
from sensor.errors import WedgeError
from simulation.indenters import calibration_ball, shapes
from simulation.presses import (
    DEEPEST,
    Press,
    ball_presses,
    contact_circle_px,
    marker_ink,
    skin_under,
)
from simulation.skin import (
    NARROW_PX,
    SMALLEST_MM,
    Skin,
    View,
    collar_mm,
    gel_view,
    pressed,
    rest_height_mm,
)

FLAT = replace(STANDARD.gel, curved=False)
VIEW = View(size_px=(160, 120), mm_per_px=(0.05, 0.05))
BALL = calibration_ball()


def reach(depth_mm: float) -> np.ndarray:
    return depth_mm - BALL.profile(*VIEW.grid_mm)


@pytest.mark.parametrize("depth_mm", [0.3, 0.6, 1.0])
def test_a_ball_leaves_a_flat_skin_along_a_tangent(depth_mm: float) -> None:
    # Outside the contact w = c K0(r / s); where it leaves the ball, value and slope agree.
    s, R = collar_mm(FLAT), BALL.round_mm

    def mismatch(a: float) -> float:
        slope = a / np.sqrt(R**2 - a**2)
        depth = depth_mm - (R - np.sqrt(R**2 - a**2))
        return slope * s * k0(a / s) / k1(a / s) - depth

    skin = pressed(VIEW, FLAT, reach(depth_mm))
    x, y, radius_px = contact_circle_px(skin)
    assert radius_px * 0.05 == pytest.approx(brentq(mismatch, 1e-3, 2.3), abs=0.04)
    assert (x, y) == pytest.approx((79.5, 59.5))


@pytest.mark.parametrize("thickness_mm", [1.0, 3.5, 10.0])
def test_the_skin_lies_on_the_object_or_obeys_the_foundation(thickness_mm: float) -> None:
    floor, gel = reach(0.7), replace(FLAT, thickness_mm=thickness_mm)
    skin = pressed(VIEW, gel, floor)
    w, s = skin.depth_mm, collar_mm(gel)
    assert (w >= floor - 1e-6).all()
    inner = w[1:-1, 1:-1]
    bend = w[:-2, 1:-1] + w[2:, 1:-1] + w[1:-1, :-2] + w[1:-1, 2:] - 4 * inner
    pull = inner - s**2 * bend / 0.05**2
    free = ~skin.contact[1:-1, 1:-1] & (inner > 0.01)
    assert np.abs(pull[free]).max() < 0.02 * w.max()
    assert pull[skin.contact[1:-1, 1:-1]].min() > -0.02 * w.max()  # an object only pushes


@pytest.mark.parametrize("cover_mm", [0.0, 0.3])
def test_pixels_that_are_not_square_show_the_same_round_dent(cover_mm: float) -> None:
    dents = []
    for pitch in ((0.05, 0.1), (0.1, 0.05)):
        view = View(size_px=(round(8 / pitch[0]) + 1, round(8 / pitch[1]) + 1), mm_per_px=pitch)
        floor = 0.7 - BALL.profile(*view.grid_mm)
        dents.append(pressed(view, FLAT, floor, cover_mm).depth_mm)
    one, other = dents
    np.testing.assert_allclose(one, other.T, atol=1e-3)
    # Every second column of the one lies where the rows of its middle do.
    np.testing.assert_allclose(one[40, ::2], one[:, 80], atol=0.01)


@pytest.mark.parametrize("cover_mm", [0.0, 0.3])
def test_a_plate_over_all_of_the_view_leaves_no_rim_and_no_dent_is_too_faint(
    cover_mm: float,
) -> None:
    plate = np.full(VIEW.size_px[::-1], 0.5)
    np.testing.assert_allclose(pressed(VIEW, FLAT, plate, cover_mm).depth_mm, 0.5, atol=1e-6)
    half = np.where(VIEW.grid_mm[0] < -2, 0.5, -np.inf)
    dent = pressed(VIEW, FLAT, half, cover_mm).depth_mm
    assert np.abs(dent - dent[:1]).max() < 2 * SMALLEST_MM  # straight to both borders
    assert dent[dent > 0].min() >= SMALLEST_MM and (dent == 0).any()


def test_balls_on_thin_gel_are_pressed_no_deeper_than_it_bears() -> None:
    thin = replace(FINGER, gel=replace(FINGER.gel, curved=False, thickness_mm=1.5))
    depths = [press.depth_mm for press in ball_presses(thin, BALL, 40, seed=3)]
    assert max(depths) <= DEEPEST * 1.5 < 0.42 * BALL.round_mm
    assert max(depths) > 0.9 * DEEPEST * 1.5


def test_a_skin_that_has_not_settled_is_no_answer(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("simulation.skin.SWEEPS", 10)
    with pytest.raises(WedgeError, match="does not settle in 10 steps"):
        pressed(VIEW, FLAT, reach(0.7))


def test_a_wide_collar_that_creeps_has_settled_too(monkeypatch: pytest.MonkeyPatch) -> None:
    thick = replace(FLAT, thickness_mm=10.0)
    assert collar_mm(thick) > NARROW_PX * VIEW.mm_per_px[0]
    found = pressed(VIEW, thick, reach(0.7)).depth_mm
    monkeypatch.setattr("simulation.skin.SETTLED_MM", 1e-8)
    np.testing.assert_allclose(found, pressed(VIEW, thick, reach(0.7)).depth_mm, atol=1e-4)


def test_a_deeper_press_touches_more_and_a_thicker_gel_follows_farther() -> None:
    areas = [pressed(VIEW, FLAT, reach(depth)).contact.sum() for depth in (0.2, 0.4, 0.8)]
    assert areas == sorted(set(areas))
    thin = replace(FLAT, thickness_mm=1.0)
    assert (
        pressed(VIEW, thin, reach(0.5)).depth_mm.sum()
        < pressed(VIEW, FLAT, reach(0.5)).depth_mm.sum()
    )


def test_a_thicker_glove_hides_more() -> None:
    threads = shapes(STANDARD.pad_size_mm)["threads"]
    floor = 0.3 - threads.profile(*VIEW.grid_mm)
    relief = [
        np.ptp(pressed(VIEW, FLAT, floor, glove).depth_mm[60, 60:100]) for glove in (0.03, 0.1, 0.3)
    ]
    assert relief == sorted(relief, reverse=True)
    assert relief[2] < 0.1 * relief[0]


def test_what_does_not_reach_the_skin_is_refused() -> None:
    with pytest.raises(WedgeError, match="does not reach"):
        pressed(VIEW, FLAT, reach(-0.1))
    with pytest.raises(WedgeError, match="does not reach"):
        pressed(VIEW, FLAT, reach(0.0009))
    needle = np.where(np.hypot(*VIEW.grid_mm) < 0.06, 0.002, -1)
    assert pressed(VIEW, FLAT, needle).depth_mm.any()
    with pytest.raises(WedgeError, match="does not reach"):
        pressed(VIEW, FLAT, needle, cover_mm=0.5)
    still = np.zeros(VIEW.size_px[::-1])
    with pytest.raises(WedgeError, match="no pixel shows the contact"):
        contact_circle_px(Skin(depth_mm=still, contact=still > 0))


@pytest.mark.parametrize("design", [STANDARD, FINGER])
def test_the_untouched_skin_is_the_designs(design) -> None:
    view = gel_view(design, 40)
    rest = rest_height_mm(design.gel, *view.grid_mm)
    for row, column in ((0, 0), (5, 30), (20, 3)):
        thickness = design.gel.thickness_at_mm(view.x_mm[column], view.y_mm[row])
        assert rest[row, column] == pytest.approx(thickness - design.gel.thickness_mm)


@pytest.mark.parametrize("design", [STANDARD, FINGER])
def test_balls_touch_where_they_were_sent_inside_the_pad(design) -> None:
    view = gel_view(design, 160)
    presses = ball_presses(design, BALL, 6, seed=3)
    for press in presses:
        skin = skin_under(design, view, press)
        x, y, radius = contact_circle_px(skin)
        assert np.hypot(*np.subtract((x, y), view.pixel(*press.center_mm))) < 1.0
        width, height = view.size_px
        assert radius < x < width - radius and radius < y < height - radius
        assert skin.depth_mm.max() == pytest.approx(press.depth_mm, rel=0.1)
    assert presses == ball_presses(design, BALL, 6, seed=3)
    assert presses != ball_presses(design, BALL, 6, seed=4)


@pytest.mark.parametrize("design", [STANDARD, FINGER])
def test_every_shape_fits_the_pad_and_stands_on_its_lowest_point(design) -> None:
    view = gel_view(design, 320)
    x, y = np.meshgrid(np.linspace(-9, 9, 601), np.linspace(-9, 9, 601))
    for name, shape in shapes(design.pad_size_mm).items():
        height = shape.profile(x, y)
        assert 0 <= height.min() < 0.03, name
        inside = (np.abs(x) <= shape.size_mm[0] / 2 + 0.01) & (
            np.abs(y) <= shape.size_mm[1] / 2 + 0.01
        )
        low = height < shape.depth_mm
        assert inside[low].all(), name
        press = Press(name=name, indenter=shape, center_mm=(0, 0), depth_mm=shape.depth_mm)
        assert skin_under(design, view, press).contact.any(), name


@pytest.mark.parametrize(
    ("depth_mm", "design", "words"),
    [
        (-0.1, STANDARD, "deeper than zero"),
        (0.0, STANDARD, "deeper than zero"),
        (np.nan, STANDARD, "deeper than zero"),
        (np.inf, STANDARD, "finite"),
        (0.5, FINGER, "larger than the pad"),
    ],
)
def test_a_press_that_cannot_be_is_refused(depth_mm, design, words) -> None:
    view = gel_view(design, 32)
    big = calibration_ball(5.0)
    with pytest.raises(WedgeError, match=words):
        skin_under(design, view, Press(name="b", indenter=big, center_mm=(0, 0), depth_mm=depth_mm))


@pytest.mark.parametrize("depth_mm", [2.41, 4.0, np.inf])
def test_a_ball_is_pressed_no_deeper_than_its_middle(depth_mm) -> None:
    deep = Press(name="b", indenter=BALL, center_mm=(0, 0), depth_mm=depth_mm)
    with pytest.raises(WedgeError, match=r"past its middle, 2\.4 mm|finite"):
        skin_under(STANDARD, VIEW, deep)
    skin = skin_under(STANDARD, VIEW, replace(deep, depth_mm=2.4))
    assert skin.depth_mm.max() == pytest.approx(2.4, abs=0.03)


@pytest.mark.parametrize(("name", "radius_mm"), [("ball_array", 1.2), ("m2_screw", 1.0)])
def test_nor_are_small_round_things(name: str, radius_mm: float) -> None:
    thing = shapes(STANDARD.pad_size_mm)[name]
    low = thing.profile(*np.meshgrid(np.linspace(-1.6, 1.6, 801), np.linspace(-1.6, 1.6, 801)))
    assert low[np.isfinite(low)].max() == pytest.approx(radius_mm, abs=0.15)
    press = Press(name=name, indenter=thing, center_mm=(0, 0), depth_mm=radius_mm)
    skin_under(STANDARD, VIEW, press)
    with pytest.raises(WedgeError, match=f"{name}: .* past its middle, {radius_mm:g} mm"):
        skin_under(STANDARD, VIEW, replace(press, depth_mm=radius_mm + 0.01))


@pytest.mark.parametrize("design", [STANDARD, FINGER])
@pytest.mark.parametrize("center_mm", [(0.0, 0.0), (3.0, -1.5)])
def test_nothing_is_pressed_through_the_gel(design, center_mm) -> None:
    prism = shapes(design.pad_size_mm)["prism"]
    thickness = design.gel.thickness_at_mm(*center_mm)
    deep = Press(name="edge", indenter=prism, center_mm=center_mm, depth_mm=thickness - 0.01)
    view = gel_view(design, 160)
    x, y = view.grid_mm
    left = design.gel.thickness_mm + rest_height_mm(design.gel, x, y)
    left -= skin_under(design, view, deep).depth_mm
    assert 0 < left.min() < 0.2
    for depth_mm in (thickness, 8.0):
        with pytest.raises(WedgeError, match=r"^edge: .* goes through the gel"):
            skin_under(design, view, replace(deep, depth_mm=depth_mm))


@pytest.mark.parametrize("height_mm", [np.nan, -np.inf])
def test_an_object_without_a_height_is_refused_as_such(height_mm) -> None:
    holed = replace(BALL, profile=lambda x, y: np.where(np.hypot(x, y) < 0.5, height_mm, 0.0))
    press = Press(name="holed", indenter=holed, center_mm=(0, 0), depth_mm=0.3)
    with pytest.raises(WedgeError, match=r"^holed: the object's profile is NaN or -inf"):
        skin_under(STANDARD, gel_view(STANDARD, 80), press)
    reach_mm = np.where(np.hypot(*VIEW.grid_mm) < 0.5, -height_mm, 0.3)
    with pytest.raises(WedgeError, match="NaN or -inf"):
        pressed(VIEW, FLAT, reach_mm)


@pytest.mark.parametrize("center_mm", [(50, 0), (-17.1, 0), (0, 12.8), (np.nan, 0), (0, np.inf)])
def test_a_place_off_the_pad_is_refused_as_such(center_mm) -> None:
    press = Press(name="b", indenter=BALL, center_mm=center_mm, depth_mm=0.3)
    with pytest.raises(WedgeError, match=r"^b: its place .* lies off the pad of 34 x 25\.5 mm"):
        skin_under(STANDARD, gel_view(STANDARD, 80), press)


@pytest.mark.parametrize("center_mm", [(17.0, 0.0), (0.0, -12.75)])
def test_a_place_on_the_pad_s_border_is_on_it(center_mm) -> None:
    press = Press(name="b", indenter=BALL, center_mm=center_mm, depth_mm=0.3)
    assert skin_under(STANDARD, gel_view(STANDARD, 80), press).contact.any()


def test_a_ball_beside_the_middle_of_a_curved_gel_goes_lower_than_its_depth() -> None:
    # It is pressed along the skin's normal: its lowest point is below the place by more.
    at, ball = (14.0, 10.0), calibration_ball(6.0)
    thickness = STANDARD.gel.thickness_at_mm(*at)
    deep = Press(name="b", indenter=ball, center_mm=at, depth_mm=thickness - 0.05)
    with pytest.raises(WedgeError, match="through the gel"):
        skin_under(STANDARD, gel_view(STANDARD, 160), deep)


def test_markers_cover_their_dots_alone() -> None:
    ink = marker_ink(gel_view(STANDARD, 320))
    share_of_dots = np.pi * 0.2**2 / 1.5**2
    assert ink.min() == pytest.approx(0.1)
    assert (1 - ink).mean() / 0.9 == pytest.approx(share_of_dots, rel=0.1)
