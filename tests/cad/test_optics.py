# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""The light path against rays that are bent face by face, and against the lens's definition."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cad.optics import (
    FAULTS,
    camera_axes,
    faulty_pictures,
    gel_thickness_mm,
    keystone,
    mirror_plane,
    mm_per_px,
    pad_center_x_mm,
    pad_grid,
    pixel_margin,
    project,
    seen_mm,
    trace,
)
from sensor.design import FINGER, STANDARD, Wedge

DESIGNS = pytest.mark.parametrize("design", [STANDARD, FINGER], ids=lambda design: design.name)


def bent(direction: np.ndarray, before: float, after: float) -> np.ndarray:
    """Snell's law in vector form at a face z = const, for a ray that goes down."""
    normal = np.array([0.0, 0.0, 1.0])
    ratio = before / after
    cosine = -direction @ normal
    return ratio * direction + (ratio * cosine - np.sqrt(1 - ratio**2 * (1 - cosine**2))) * normal


def landed(design: Wedge, mirror: np.ndarray, gel_mm: float) -> np.ndarray:
    """Shoot a ray from the pupil to a point of the mirror and on, down to the skin."""
    camera, acrylic = design.camera, design.acrylic
    pupil = np.array([camera.pupil_x_mm, 0.0, camera.pupil_z_mm])
    way = (mirror - pupil) / np.linalg.norm(mirror - pupil)
    normal, _ = mirror_plane(design)
    way = way - 2 * (way @ normal) * normal
    point = mirror - way * (mirror[2] / way[2])
    way = bent(way, 1.0, acrylic.refractive_index)
    point = point - way * (acrylic.thickness_mm / way[2])
    way = bent(way, acrylic.refractive_index, design.gel.refractive_index)
    return np.asarray(point - way * (gel_mm / way[2]))


@DESIGNS
def test_a_ray_shot_backward_lands_on_the_point_it_came_from(design: Wedge) -> None:
    grid = pad_grid(design, 9)
    paths = trace(design, grid)
    thickness = gel_thickness_mm(design, grid)
    hits = [landed(design, m, t) for m, t in zip(paths.mirror, thickness, strict=True)]
    assert np.abs(np.array(hits) - paths.skin).max() < 1e-9


@DESIGNS
def test_gel_thickness_agrees_with_the_design(design: Wedge) -> None:
    corners = pad_grid(design, 2)
    assert gel_thickness_mm(design, corners) == pytest.approx(design.gel.corner_thickness_mm)
    flat = replace(design, gel=replace(design.gel, curved=False))
    assert (gel_thickness_mm(flat, corners) == design.gel.thickness_mm).all()


@DESIGNS
def test_the_picture_is_symmetric_across_the_finger(design: Wedge) -> None:
    pixels = trace(design, pad_grid(design, 9)).pixels.reshape(9, 9, 2)
    height = design.camera.height_px
    assert np.abs(pixels[:, ::-1, 0] - pixels[..., 0]).max() < 1e-9
    assert np.abs(pixels[:, ::-1, 1] + pixels[..., 1] - height).max() < 1e-9


@DESIGNS
def test_the_way_in_air_is_that_from_the_pupil_s_image(design: Wedge) -> None:
    paths = trace(design, pad_grid(design, 5))
    normal, foot = mirror_plane(design)
    image = paths.pupil - 2 * ((paths.pupil - foot) @ normal) * normal
    assert paths.air_mm == pytest.approx(np.linalg.norm(paths.acrylic - image, axis=1))
    # Straight down, what lies under a layer seems nearer by 1 - 1/n of its thickness.
    nearer = paths.air_mm + design.acrylic.thickness_mm + design.gel.thickness_mm
    nearer -= seen_mm(design, paths)
    acrylic, gel = design.acrylic, design.gel
    assert nearer == pytest.approx(
        acrylic.thickness_mm * (1 - 1 / acrylic.refractive_index)
        + gel.thickness_mm * (1 - 1 / gel.refractive_index)
    )


def test_the_keystone_is_the_tip_s_width_over_the_base_s() -> None:
    across = np.array([[-1.0, 0.0, 1.0], [-2.0, 0.0, 2.0], [-4.0, 0.0, 4.0]])
    pixels = np.stack([np.zeros((3, 3)), 50 + across], -1).reshape(-1, 2)
    assert keystone(pixels, 3) == 0.25
    assert pad_grid(STANDARD, 3)[0, 0] < pad_grid(STANDARD, 3)[-1, 0]  # x runs from the tip


@DESIGNS
def test_a_pixel_s_millimetres_are_the_slope_of_the_light_path(design: Wedge) -> None:
    ranges = mm_per_px(design)
    place = np.array([[pad_center_x_mm(design), 0.0]])
    for axis, (low, high) in enumerate(ranges):
        step = 0.01 * np.eye(2)[axis]
        ends = trace(design, np.concatenate([place - step, place + step])).pixels
        assert low < 0.02 / np.linalg.norm(ends[1] - ends[0]) < high


def test_the_margin_is_to_the_nearest_edge_and_none_of_what_has_no_pixel() -> None:
    camera = STANDARD.camera
    middle = np.array([camera.width_px, camera.height_px]) / 2
    for axis in (0, 1):
        for side in (-1, 1):
            point = middle + side * (middle - 7.0) * np.eye(2)[axis]
            assert pixel_margin(camera, np.stack([middle, point])) == pytest.approx(7.0)
            out = middle + side * (middle + 7.0) * np.eye(2)[axis]
            assert pixel_margin(camera, np.stack([middle, out])) == pytest.approx(-7.0)
    assert pixel_margin(camera, np.stack([middle, [np.nan, np.nan]])) == -np.inf


@given(st.floats(0.01, 1.4), st.floats(-3, 3), st.sampled_from(["equidistant", "pinhole"]))
def test_the_lens_maps_angles_as_its_name_says(angle: float, azimuth: float, lens: str) -> None:
    camera = replace(STANDARD.camera, projection=lens)
    forward, up, across = camera_axes(camera)
    side = np.cos(azimuth) * up + np.sin(azimuth) * across
    (pixel,) = project(camera, (np.cos(angle) * forward + np.sin(angle) * side)[None])
    offset = pixel - [camera.width_px / 2, camera.height_px / 2]
    spread = angle if lens == "equidistant" else np.tan(angle)
    assert np.hypot(*offset) == pytest.approx(camera.focal_length_px * spread, rel=1e-9)
    assert np.arctan2(offset[1], offset[0]) == pytest.approx(azimuth, abs=1e-9)


@DESIGNS
def test_faults_move_the_picture_as_the_model_says(design: Wedge) -> None:
    found = {fault.name: fault for fault in faulty_pictures(design)}
    margin = pixel_margin(design.camera, trace(design, pad_grid(design, 9)).pixels)
    # An equidistant picture turns by f radians a radian.
    pitch = found["camera.pitch_deg ± 1"]
    assert pitch.shift_px == pytest.approx(design.camera.focal_length_px * np.pi / 180, rel=0.15)
    for fault in found.values():
        assert margin - fault.shift_px <= fault.margin_px <= margin


@DESIGNS
def test_a_fault_counts_in_its_worse_direction_and_within_its_bounds(design: Wedge) -> None:
    grid = pad_grid(design, 9)
    nominal = trace(design, grid).pixels
    found = {fault.name: fault for fault in faulty_pictures(design)}
    assert found.keys() == {f"{field} ± {by:g}" for field, by in FAULTS}
    assert len(found) == len(FAULTS)  # none twice in another's place
    for named, by in FAULTS:
        part, _, field = named.partition(".")
        shifts, margins = [], []
        for amount in (-by, by):
            group = getattr(design, part)
            built = replace(group, **{field: getattr(group, field) + amount})
            wrong = replace(design, **{part: built})
            pixels = trace(wrong, grid).pixels
            shifts.append(np.linalg.norm(pixels - nominal, axis=1).max())
            margins.append(pixel_margin(wrong.camera, pixels))
        fault = found[f"{named} ± {by:g}"]
        assert fault.shift_px == pytest.approx(max(shifts))
        assert fault.margin_px == pytest.approx(min(margins))
    # A lens as wide as any cannot be built wider.
    widest = replace(design, camera=replace(design.camera, diagonal_view_deg=170.0))
    assert len(faulty_pictures(widest)) == len(FAULTS)


def test_a_ray_behind_the_lens_has_no_pixel() -> None:
    forward, _, _ = camera_axes(STANDARD.camera)
    assert np.isnan(project(STANDARD.camera, -forward[None])).all()


def test_the_pad_sits_in_the_middle_of_the_acrylic() -> None:
    x = pad_grid(STANDARD, 3)[:, 0]
    assert (x.min() + x.max()) / 2 == pytest.approx(pad_center_x_mm(STANDARD))
    assert np.ptp(x) == pytest.approx(STANDARD.gel.pad_length_mm)


@DESIGNS
def test_the_picture_s_long_side_stands_on_the_acrylic(design: Wedge) -> None:
    """By which the guide has a builder turn the camera's head; a quarter more cuts corners off."""
    camera = design.camera
    forward, *_ = camera_axes(camera)
    low, high = project(camera, np.array([forward, forward + np.array([0, 0, 0.1])]))
    assert camera.width_px > camera.height_px and abs(high - low)[0] > 10 * abs(high - low)[1]
    pixels = trace(design, pad_grid(design, 9)).pixels
    center = np.array([camera.width_px, camera.height_px]) / 2
    turned = center + (pixels - center)[:, ::-1]
    assert pixel_margin(camera, turned) < 0.3 * pixel_margin(camera, pixels)
