# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""The lens's file of a design makes of the twin's rays those of a pinhole."""

from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest

from recon.geometry.lens import Lens, read_lens
from sensor.design import FINGER, STANDARD, Wedge
from simulation.indenters import calibration_ball
from simulation.lens import lens_text
from simulation.presses import Press, skin_under
from simulation.raw_view import Points, directions, pixels_of, unwarped_skin
from simulation.skin import gel_view

BOTH = pytest.mark.parametrize("design", [STANDARD, FINGER], ids=lambda design: design.name)


def lens_of(design: Wedge, folder: Path) -> Lens:
    text = lens_text(design)
    assert text is not None
    (folder / "camera.toml").write_text(text)
    return read_lens(folder / "camera.toml")


def pad_px(design: Wedge) -> Points:
    """Raw pixels all over the pad, to its corners."""
    x, y = np.meshgrid(np.linspace(-1, 1, 21), np.linspace(-1, 1, 15))
    share = np.stack([x.ravel(), y.ravel()], 1)
    return pixels_of(design, (1 - 1e-6) * share * np.array(design.pad_size_mm) / 2)


def on_the_face_mm(design: Wedge, pixels: Points) -> Points:
    """Where rays, over the mirror, meet the acrylic's plane before it bends them."""
    camera, mirror = design.camera, design.mirror
    tilt = np.radians(mirror.angle_deg)
    normal = np.array([-np.sin(tilt), 0, np.cos(tilt)])
    foot = np.array([mirror.foot_x_mm, 0, mirror.foot_height_mm])
    pupil = np.array([camera.pupil_x_mm, 0, camera.pupil_z_mm])
    ray = directions(camera, pixels)
    behind = pupil - 2 * ((pupil - foot) @ normal) * normal  # the pupil's picture in the mirror
    turned = ray - 2 * (ray @ normal)[:, None] * normal
    return (behind - turned * (behind[2] / turned[:, 2:]))[:, :2]


def off_straight_px(pixels: Points, plane_mm: Points) -> float:
    """How far pixels are from a homography of a plane: that takes all of its lines to lines."""
    to_pixels, _ = cv2.findHomography(plane_mm, pixels)
    straight = cv2.perspectiveTransform(plane_mm[:, None], to_pixels)[:, 0]
    return float(np.linalg.norm(pixels - straight, axis=1).max())


@BOTH
def test_lines_of_a_plane_over_the_mirror_are_lines_once_the_file_has_undone_the_lens(
    design: Wedge, tmp_path: Path
) -> None:
    pixels = pad_px(design)
    plane_mm = on_the_face_mm(design, pixels)
    assert off_straight_px(pixels, plane_mm) > 2
    assert off_straight_px(lens_of(design, tmp_path).undistort(pixels), plane_mm) < 0.12


@BOTH
@pytest.mark.parametrize("view_deg", [90.0, 120.0, 160.0])
def test_the_file_says_how_far_off_it_is(design: Wedge, view_deg: float, tmp_path: Path) -> None:
    design = replace(design, camera=replace(design.camera, diagonal_view_deg=view_deg))
    lens = lens_of(design, tmp_path)
    pixels = pad_px(design)
    axis = directions(design.camera, np.array([lens.center_px]))[0]
    ray = directions(design.camera, pixels)
    away = pixels - lens.center_px
    tangent = np.linalg.norm(np.cross(ray, axis), axis=1) / (ray @ axis)
    ideal = away * (tangent / np.linalg.norm(away, axis=1))[:, None] * lens.focal_px
    off_px = np.linalg.norm(lens.distort(ideal + lens.center_px) - pixels, axis=1)
    (told,) = (line for line in lens_text(design).splitlines() if line.startswith("#"))
    assert off_px.max() == pytest.approx(float(told.split()[-3]), abs=0.006)
    assert 0.5 * off_px.max() < lens.rms_px < off_px.max()


@BOTH
def test_a_frame_without_its_lens_is_a_pinholes(design: Wedge) -> None:
    pinhole = replace(design, camera=replace(design.camera, projection="pinhole"))
    assert lens_text(pinhole) is None
    view = gel_view(design, 161)
    press = Press(name="ball", indenter=calibration_ball(1.5), center_mm=(-4.5, 2.2), depth_mm=0.6)
    skin = skin_under(design, view, press)
    undone = unwarped_skin(design, view, skin, lens_undone=True).depth_mm
    for lens_undone in (False, True):
        seen = unwarped_skin(pinhole, view, skin, lens_undone=lens_undone).depth_mm
        np.testing.assert_allclose(seen, undone, atol=1e-4)
    assert np.abs(unwarped_skin(design, view, skin).depth_mm - undone).max() > 0.02
