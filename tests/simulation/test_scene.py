# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Traced light obeys the design: where it comes from, what filters take, what symmetry demands."""

from dataclasses import replace
from functools import lru_cache
from typing import Any

import numpy as np
import pytest
from scipy import ndimage

from cad.layout import BASE_POST, TIP_POST, Layout
from cad.optics import pad_center_x_mm
from cad.parts.bought import led_array
from sensor.design import FINGER, STANDARD, Wedge
from sensor.errors import WedgeError
from simulation.engine import SCALAR
from simulation.indenters import calibration_ball, shapes
from simulation.presses import Press, marker_ink, skin_under
from simulation.render import render, smoothed
from simulation.scene import SIDE_END_MM, SIDE_START_MM, Paint, gel_scene, sides
from simulation.skin import gel_view

pytestmark = pytest.mark.usefixtures("mitsuba")
WIDTH_PX, SAMPLES = 24, 144


def lights(design: Wedge, **changes: object) -> Wedge:
    return replace(design, lights=replace(design.lights, **changes))


@lru_cache
def blank(design: Wedge, samples: int = SAMPLES, seed: int = 0) -> np.ndarray:
    view = gel_view(design, WIDTH_PX)
    rest = np.zeros(view.size_px[::-1])
    return render(SCALAR, design, view, rest, samples=samples, seed=seed)


@pytest.mark.parametrize("design", [STANDARD, FINGER])
def test_lights_sit_where_the_solids_have_them(design: Wedge) -> None:
    layout = Layout(design)
    assert (SIDE_START_MM, SIDE_END_MM) == (TIP_POST, BASE_POST)
    rows = {row.color[0].upper(): row for row in layout.light_rows()}
    for side in sides(design):
        row = rows[side.color]
        middle = (row.centers[0] + row.centers[-1]) / 2
        assert len(row.centers) == side.leds
        if side.color == "G":  # y across, and the base lies at gel x < 0
            assert middle == pytest.approx(side.row_center_mm[1])
            assert layout.acrylic_x1 - pad_center_x_mm(design) == pytest.approx(-side.center_mm[0])
        else:  # the body's x runs against the gel's
            assert pad_center_x_mm(design) - middle == pytest.approx(side.row_center_mm[0])
            assert abs(side.center_mm[1]) == layout.acrylic_half
        assert design.lights.azimuths_deg[side.color] % 360 == pytest.approx(
            np.degrees(np.arctan2(-side.inward[1], -side.inward[0])) % 360
        )


@pytest.mark.parametrize("design", [STANDARD, FINGER], ids=lambda design: design.name)
@pytest.mark.parametrize(
    ("film", "backing", "height"), [(0.25, 0.35, 1.9), (0.0, 0.25, 1.4), (0.6, 1.1, 2.2)]
)
def test_bare_leds_shine_from_where_the_solids_have_their_faces(
    mitsuba: Any, design: Wedge, film: float, backing: float, height: float
) -> None:
    bare = lights(
        design,
        diffuser=False,
        film_thickness_mm=film,
        backing_thickness_mm=backing,
        led_height_mm=height,
    )
    view = gel_view(bare, WIDTH_PX)
    scene = gel_scene(mitsuba, bare, view, np.zeros(view.size_px[::-1]))
    layout = Layout(bare)
    for row, side in zip(layout.light_rows(), sides(bare), strict=True):
        low, high = led_array(bare, row.color).BoundingBox(), layout.acrylic_half
        face = {"red": low.ymin - high, "blue": -high - low.ymax,
                "green": low.xmin - layout.acrylic_x1}[row.color]  # fmt: skip
        for index in range(side.leds):
            lamp = np.array(scene[f"light_{side.color}{index}"]["to_world"].matrix)[:2, 3]
            behind = (np.array(side.center_mm) - lamp) @ side.inward
            assert behind == pytest.approx(face, abs=2e-3)


def test_each_colour_is_brightest_on_its_own_half() -> None:
    picture = blank(STANDARD)
    half_x, half_y = picture.shape[1] // 2, picture.shape[0] // 2
    red, green, blue = np.moveaxis(picture, -1, 0)
    assert red[half_y:].mean() > 1.2 * red[:half_y].mean()
    assert blue[:half_y].mean() > 1.2 * blue[half_y:].mean()
    assert green[:, :half_x].mean() > 1.5 * green[:, half_x:].mean()


def test_red_and_blue_are_each_others_mirror_image() -> None:
    only = [
        blank(lights(STANDARD, **{f"{side}_leds": 0, "green_base_leds": 0}))
        for side in ("blue_side", "red_side")
    ]
    red, blue = only[0][..., 0], only[1][::-1, :, 2]
    bands = red.reshape(6, -1).mean(1) / blue.reshape(6, -1).mean(1)
    np.testing.assert_allclose(bands, 1, atol=0.12)
    assert red.mean() == pytest.approx(blue.mean(), rel=0.03)


def test_light_adds_up() -> None:
    dark = {"red_side_leds": 0, "green_base_leds": 0, "blue_side_leds": 0}
    alone = [blank(lights(STANDARD, **{key: 0 for key in dark if key != lit})) for lit in dark]
    np.testing.assert_allclose(sum(alone).mean((0, 1)), blank(STANDARD).mean((0, 1)), rtol=0.04)


def test_the_gray_filter_takes_a_quarter_once_and_more_of_what_reflects() -> None:
    clear = blank(lights(STANDARD, gray_filter_transmission=1.0))
    share = (blank(STANDARD) / clear.mean((0, 1))).mean((0, 1))
    assert (share < 0.25).all()  # one pass takes three quarters; reflections pass twice
    assert (share > 0.15).all()


def test_without_a_diffuser_a_side_lies_in_its_own_lights_shadow() -> None:
    def own_edge(design: Wedge) -> float:
        blue = blank(design, 400)[..., 2]
        return blue[1:3].mean() / blue.mean()

    bare = lights(STANDARD, diffuser=False)
    assert own_edge(bare) < 0.5 * own_edge(STANDARD)


def test_more_paths_leave_less_grain_about_the_same_mean() -> None:
    def grain(samples: int) -> float:
        return float((blank(STANDARD, samples, 1) - blank(STANDARD, samples, 2)).std())

    assert 3.5 < grain(16) / grain(256) < 7  # stratified paths do better than the square root
    assert blank(STANDARD, 64, 1).mean() == pytest.approx(blank(STANDARD, 256, 2).mean(), rel=0.04)


def test_one_seed_one_picture() -> None:
    again = blank.__wrapped__(STANDARD, 16, 1)
    np.testing.assert_array_equal(again, blank(STANDARD, 16, 1))


def test_a_dent_brightens_toward_the_light_it_faces() -> None:
    design, view = STANDARD, gel_view(STANDARD, 64)
    press = Press(name="b", indenter=calibration_ball(4.0), center_mm=(0, 0), depth_mm=1.4)
    depth = skin_under(design, view, press).depth_mm
    window = (slice(24, 40), slice(16, 32))
    around = dict(samples=256, seed=0, window=window)
    dented = render(SCALAR, design, view, depth, **around)
    change = dented - render(SCALAR, design, view, np.zeros_like(depth), **around)
    assert change.shape == (16, 16, 3)
    # A dent stands out toward the camera: its flank at y > 0 faces the red light there.
    assert change[9:, :, 0].mean() > 0 > change[:7, :, 0].mean()
    assert change[:7, :, 2].mean() > 0 > change[9:, :, 2].mean()
    assert change[:, :7, 1].mean() > 0 > change[:, 9:, 1].mean()


@pytest.mark.parametrize("paint", ["gray", "silver"])
def test_markers_darken_their_dots_alone(paint: Paint) -> None:
    view = gel_view(STANDARD, 320)
    ink, rest = marker_ink(view), np.zeros(view.size_px[::-1])
    window = (slice(140, 180), slice(100, 140))
    dotted, clear = (
        render(
            SCALAR, STANDARD, view, rest, samples=36, seed=0, window=window, paint=paint, ink=dots
        )
        for dots in (ink, None)
    )
    seen = ink[window[1], window[0]]
    dots, beside = seen < 0.15, ndimage.distance_transform_edt(seen == 1) > 1
    assert dotted[dots].mean() < 0.4 * clear[dots].mean()
    # Smoothing takes the ink off and puts it back: it leaves no halo around a dot.
    pitch, rest = view.mm_per_px[0], np.zeros(seen.shape)
    share = smoothed(dotted, pitch, rest, seen) / smoothed(clear, pitch, rest, None)
    assert share[dots].mean() == pytest.approx(seen[dots].mean(), rel=0.1)
    assert share[beside].mean() == pytest.approx(1, abs=0.06)


@pytest.mark.parametrize("name", ["ball_array", "threads", "m2_screw", "lego"])
def test_smoothing_keeps_what_is_linear_in_the_slopes(name: str) -> None:
    view, shape = gel_view(STANDARD, 320), shapes(STANDARD.pad_size_mm)[name]
    press = Press(name=name, indenter=shape, center_mm=(0, 0), depth_mm=shape.depth_mm)
    pitch, depth = view.mm_per_px[0], skin_under(STANDARD, view, press).depth_mm
    slope_y, slope_x = np.gradient(depth, pitch)
    truth = 1 + 0.5 * slope_x[..., None] * [1, 0, -1] + 0.3 * slope_y[..., None]
    noise = 0.1 * np.random.default_rng(0).standard_normal(truth.shape)
    kept = smoothed(truth.astype(np.float32), pitch, depth, None)
    touched = depth > 0.05
    assert np.abs(kept - truth)[touched].mean() < 0.02 * truth[touched].std()
    left = smoothed((truth + noise).astype(np.float32), pitch, depth, None) - kept
    assert left[touched].std() < 0.35 * noise.std()
    assert left[~touched].std() < 0.2 * noise.std()
    # The wider window, where nothing touches, takes more.
    assert left[depth == 0].std() < 0.7 * left[touched].std()


def test_no_samples_are_refused() -> None:
    view = gel_view(STANDARD, 16)
    with pytest.raises(WedgeError, match="samples"):
        render(SCALAR, STANDARD, view, np.zeros(view.size_px[::-1]), samples=0, seed=0)
