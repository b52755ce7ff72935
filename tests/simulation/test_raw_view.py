# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""The raw frame follows the light path that the solids were laid out by, and unwarps to the gel."""

from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest

from cad import optics
from recon.geometry.lens import read_lens
from recon.geometry.unwarp import prepare_unwarp
from sensor.design import FINGER, STANDARD, Wedge
from sensor.errors import WedgeError
from simulation.indenters import calibration_ball
from simulation.lens import lens_text
from simulation.presses import Press, contact_circle_px, skin_under
from simulation.raw_view import (
    MIRROR_REFLECTANCE,
    Points,
    _through,
    _unwarping_px,
    corners_px,
    follow,
    pad_corners_px,
    pixels_of,
    raw_frame,
    unwarped_skin,
)
from simulation.skin import View, gel_view

DESIGNS = pytest.mark.parametrize("design", [STANDARD, FINGER])


def in_gel_frame(design: Wedge, body: np.ndarray) -> np.ndarray:
    return np.stack([optics.pad_center_x_mm(design) - body[:, 0], body[:, 1]], 1)


def unwarped_px(design: Wedge, view: View, points_mm: Points) -> Points:
    """Where points of the untouched skin land once four corners have unwarped the frame.

    Not quite where they lie: a homography knows neither refraction nor the gel's curve.
    """
    homography = cv2.getPerspectiveTransform(*_unwarping_px(design, view))
    return cv2.perspectiveTransform(pixels_of(design, points_mm)[:, None], homography)[:, 0]


@DESIGNS
def test_rays_run_back_along_the_path_of_the_solids(design: Wedge) -> None:
    body = optics.pad_grid(design, 9).reshape(9, 9, 2)[1:-1, 1:-1].reshape(-1, 2)
    pixels = optics.trace(design, body).pixels - 0.5  # there the first pixel's edge is zero
    seen = follow(design, pixels, None, None)
    np.testing.assert_allclose(seen.point_mm, in_gel_frame(design, body), atol=1e-9)
    assert not seen.direct.any()
    assert (0.8 < seen.share).all() and (seen.share < MIRROR_REFLECTANCE).all()


@pytest.mark.parametrize(("before", "after"), [(1.0, 1.49), (1.49, 1.41), (1.41, 1.0)])
def test_a_face_lets_through_what_fresnel_says(before: float, after: float) -> None:
    ratio = after / before
    brewster = before * np.sin(np.arctan(ratio))
    lost = 1 - _through(np.array([0.0, brewster]), before, after)
    # Straight on both polarizations are alike; at Brewster's angle one is not reflected at all.
    assert lost[0] == pytest.approx(((1 - ratio) / (1 + ratio)) ** 2)
    assert lost[1] == pytest.approx(((1 - ratio**2) / (1 + ratio**2)) ** 2 / 2)
    sine = np.linspace(0, min(before, after), 50)
    assert _through(sine, before, after) == pytest.approx(_through(sine, after, before))
    assert _through(sine, before, after)[-1] == pytest.approx(0, abs=1e-6)  # grazing


@DESIGNS
def test_every_face_and_the_mirror_take_their_share(design: Wedge) -> None:
    body = optics.pad_grid(design, 9).reshape(9, 9, 2)[1:-1, 1:-1].reshape(-1, 2)
    paths = optics.trace(design, body)
    way = paths.acrylic - paths.mirror
    sine = np.hypot(way[:, 0], way[:, 1]) / np.linalg.norm(way, axis=1)
    acrylic, gel = design.acrylic.refractive_index, design.gel.refractive_index
    share = MIRROR_REFLECTANCE * _through(sine, 1.0, acrylic) * _through(sine, acrylic, gel)
    np.testing.assert_allclose(follow(design, paths.pixels - 0.5, None, None).share, share)


@DESIGNS
@pytest.mark.parametrize("side", ["width_mm", "length_mm"])
def test_a_smaller_mirror_shows_what_it_reflects_and_no_more(design: Wedge, side: str) -> None:
    """Past the mirror the same pixels look straight ahead, past the pad."""
    body = optics.pad_grid(design, 33).reshape(33, 33, 2)[1:-1, 1:-1].reshape(-1, 2)
    paths = optics.trace(design, body)
    mirror = replace(design.mirror, **{side: 0.5 * getattr(design.mirror, side)})
    along = (paths.mirror[:, 0] - mirror.foot_x_mm) / np.cos(np.radians(mirror.angle_deg))
    met = (np.abs(paths.mirror[:, 1]) <= mirror.width_mm / 2) & (along <= mirror.length_mm)
    assert 0.1 < met.mean() < 0.9
    seen = follow(replace(design, mirror=mirror), paths.pixels - 0.5, None, None)
    np.testing.assert_array_equal(np.isfinite(seen.point_mm[:, 0]) & ~seen.direct, met)


@DESIGNS
def test_beside_the_pad_there_is_no_skin(design: Wedge) -> None:
    half = np.array([design.gel.pad_length_mm, design.gel.pad_width_mm]) / 2
    middle = [optics.pad_center_x_mm(design), 0]
    for share, inside in ((0.99, True), (1.01, False)):
        for side in (-1, 1):
            for axis in (0, 1):
                point = middle + side * share * half * np.eye(2)[axis]
                pixels = optics.trace(design, point[None]).pixels - 0.5
                seen = follow(design, pixels, None, None)
                assert np.isfinite(seen.point_mm).all() == inside
                assert (seen.share > 0).all() == inside


@DESIGNS
def test_corners_and_pixels_are_found_from_points(design: Wedge) -> None:
    body = optics.pad_grid(design, 5)
    expected = optics.trace(design, body).pixels - 0.5
    found = pixels_of(design, in_gel_frame(design, body))
    np.testing.assert_allclose(found, expected, atol=1e-6)
    corners = np.array(pad_corners_px(design))
    assert np.isfinite(follow(design, corners, None, None).point_mm).all()
    base, tip = np.ptp(corners[[0, 3], 1]), np.ptp(corners[[1, 2], 1])
    assert tip / base == pytest.approx(optics.keystone(expected, 5), abs=0.01)


@DESIGNS
def test_a_raw_frame_unwarps_to_the_gel(design: Wedge) -> None:
    view = gel_view(design, 160)
    x, y = view.grid_mm
    pattern = 1 + 0.4 * np.sin(x / design.gel.pad_length_mm * 12) * np.cos(
        y / design.gel.pad_width_mm * 9
    )
    radiance = np.repeat(pattern[..., None], 3, -1).astype(np.float32)
    raw = raw_frame(design, view, radiance, np.zeros_like(pattern))
    frame = np.round(np.clip(raw * 120, 0, 255)).astype(np.uint8)
    corners = pad_corners_px(design)
    unwarped = prepare_unwarp(frame.shape[1::-1], corners, view.size_px)(frame)
    # Where a homography misplaces the curved gel is known; there the pattern must be.
    points = np.stack([x[8:-8:6, 8:-8:6].ravel(), y[8:-8:6, 8:-8:6].ravel()], 1)
    place = unwarped_px(design, view, points).astype(np.float32)
    found = cv2.remap(unwarped, place[:, 0], place[:, 1], cv2.INTER_LINEAR)[:, 0, 0] * 255 / 120
    share = follow(design, pixels_of(design, points), None, None).share
    np.testing.assert_allclose(found / share, pattern[8:-8:6, 8:-8:6].ravel(), atol=0.03)


@DESIGNS
@pytest.mark.parametrize("undone", [False, True], ids=["lens", "undone"])
def test_the_skin_of_a_raw_frame_is_what_the_unwarped_frame_shows(
    design: Wedge, undone: bool, tmp_path: Path
) -> None:
    # Paint that shines as deep as it is pressed tells the depth through the camera and back.
    (tmp_path / "camera.toml").write_text(lens_text(design) or "")
    view = gel_view(design, 161)  # no whole number of pixels across
    for x, y in ((-4.5, -2.2), (4.5, 2.2)):
        press = Press(name="b", indenter=calibration_ball(1.5), center_mm=(x, y), depth_mm=0.6)
        skin = skin_under(design, view, press)
        seen = unwarped_skin(design, view, skin, lens_undone=undone)
        unwarp = prepare_unwarp(
            (design.camera.width_px, design.camera.height_px),
            corners_px(design, view.size_mm),
            view.size_px,
            read_lens(tmp_path / "camera.toml") if undone else None,
        )
        looks = (skin.depth_mm / 0.6, skin.contact, np.ones_like(skin.depth_mm))
        frame = raw_frame(design, view, np.stack(looks, -1).astype(np.float32), skin.depth_mm)
        shown = unwarp(np.round(frame * 255).astype(np.uint8))
        depth, contact, share = np.moveaxis(shown.astype(float), -1, 0)
        sure = share > 0.5  # not where the baffle hides it
        assert sure.mean() > 0.95
        np.testing.assert_allclose(seen.depth_mm[sure], 0.6 * depth[sure] / share[sure], atol=0.03)
        assert np.abs(seen.depth_mm - 0.6 * depth / share.max())[sure].mean() < 0.005
        rows, columns = np.nonzero(contact > 0.5 * share)
        circle = (columns.mean(), rows.mean(), np.sqrt(len(rows) / np.pi))
        assert contact_circle_px(seen) == pytest.approx(circle, abs=0.3)


def test_a_camera_that_looks_away_from_the_pad_is_told() -> None:
    away = replace(STANDARD, camera=replace(STANDARD.camera, pitch_deg=-20.0, pupil_z_mm=40.0))
    with pytest.raises(WedgeError, match="sees nothing of the pad"):
        pixels_of(away, np.zeros((1, 2)))


def test_a_pad_of_no_whole_pixels_is_unwarped_at_their_scale() -> None:
    view = gel_view(FINGER, 80)
    assert view.size_mm[1] < 0.99 * FINGER.gel.pad_width_mm
    corners = np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)]) * np.array(view.size_mm) / 2
    wanted = np.stack(view.pixel(*corners.T), 1)
    np.testing.assert_allclose(unwarped_px(FINGER, view, corners * (1 - 1e-6)), wanted, atol=0.01)


def test_a_flat_gel_is_misplaced_less_than_a_curved_one() -> None:
    def misplaced(design: Wedge) -> float:
        view = gel_view(design, 320)
        x, y = (axis[20:-20:20, 20:-20:20].ravel() for axis in view.grid_mm)
        place = unwarped_px(design, view, np.stack([x, y], 1))
        wanted = np.stack(view.pixel(x, y), 1)
        return float(np.linalg.norm(place - wanted, axis=1).max())

    pinhole = replace(STANDARD, camera=replace(STANDARD.camera, projection="pinhole"))
    flat = replace(pinhole, gel=replace(pinhole.gel, curved=False))
    assert misplaced(flat) < 0.5 * misplaced(pinhole)


def test_a_baffle_hides_what_is_seen_past_the_mirror() -> None:
    view = gel_view(STANDARD, 80)
    radiance = np.ones((*view.size_px[::-1], 3), np.float32)
    rest = np.zeros(view.size_px[::-1])
    bare = raw_frame(STANDARD, view, radiance, rest, baffle=False) > 0
    hidden = raw_frame(STANDARD, view, radiance, rest) > 0
    assert (bare | ~hidden).all()
    assert bare.mean() > 1.5 * hidden.mean()


def test_a_dent_moves_what_is_seen_by_its_parallax() -> None:
    view = gel_view(STANDARD, 160)
    press = Press(name="b", indenter=calibration_ball(), center_mm=(6, 8), depth_mm=0.8)
    dent = skin_under(STANDARD, view, press).depth_mm
    pixel = pixels_of(STANDARD, np.array([[6.0, 8.0]]))
    below = follow(STANDARD, pixel, view, dent).point_mm[0]
    assert 0.05 < np.hypot(*(below - [6, 8])) < 0.8  # 0.8 mm deep, seen aslant
