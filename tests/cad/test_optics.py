# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""The light path against rays that are bent face by face, and against the lens's definition."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cad.optics import (
    camera_axes,
    faulty_pictures,
    gel_thickness_mm,
    mirror_plane,
    pad_center_x_mm,
    pad_grid,
    pixel_margin,
    project,
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


def test_a_ray_behind_the_lens_has_no_pixel() -> None:
    forward, _, _ = camera_axes(STANDARD.camera)
    assert np.isnan(project(STANDARD.camera, -forward[None])).all()


def test_the_pad_sits_in_the_middle_of_the_acrylic() -> None:
    x = pad_grid(STANDARD, 3)[:, 0]
    assert (x.min() + x.max()) / 2 == pytest.approx(pad_center_x_mm(STANDARD))
    assert np.ptp(x) == pytest.approx(STANDARD.gel.pad_length_mm)
