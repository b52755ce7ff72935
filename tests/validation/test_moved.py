# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""A camera that has moved in any way is seen by the gel's film, and one that has not is not."""

from dataclasses import replace

import cv2
import numpy as np
import pytest
from scipy import ndimage

from sensor.dataset import read_dataset, write_card, write_labels
from sensor.errors import WedgeError
from tests.validation.sensors import accepted_on, change_frames, failed_of, good_set, unit_of
from validation.acceptance.moved import moved_px
from validation.drift import difference, evaluate_on
from validation.report.drift import pictures_moved, verdict


def motion_of(turn_deg, zoom, shift_px, size_px):
    width, height = size_px
    motion = cv2.getRotationMatrix2D(((width - 1) / 2, (height - 1) / 2), turn_deg, zoom)
    motion[:, 2] += shift_px, 0
    return motion


@pytest.mark.parametrize(
    ("turn_deg", "zoom", "shift_px"),
    [(0, 1, 0), (0, 1, 0.6), (0, 1, 12), (1, 1, 0), (-4, 1, 3), (0, 1.05, 0), (0, 0.95, 0)],
)
def test_the_farthest_corner_tells_how_far_a_picture_moved(turn_deg, zoom, shift_px):
    rng = np.random.default_rng(0)
    film = 0.5 + 0.3 * ndimage.gaussian_filter(rng.standard_normal((180, 240)), 1.5)
    motion = motion_of(turn_deg, zoom, shift_px, (240, 180))
    seen = cv2.warpAffine(film, motion, (240, 180), borderMode=cv2.BORDER_REFLECT)
    before, now = (
        np.repeat(x[..., None] + rng.normal(0, 0.004, (180, 240, 3)), 1, -1).astype(np.float32)
        for x in (film, 0.8 * seen + 0.05)  # and the lights have aged
    )
    corners = np.array([[0, 0, 1], [239, 0, 1], [0, 179, 1], [239, 179, 1]])
    true_px = np.hypot(*(corners @ motion.T - corners[:, :2]).T).max()
    assert moved_px(before, now) == pytest.approx(true_px, rel=0.05, abs=0.15)


def speck(film):
    return cv2.circle(film.copy(), (160, 120), 5, 0.1, -1)


def scratch(film):
    return film + 0.25 * cv2.line(np.zeros_like(film), (80, 60), (380, 280), 1.0, 2)


def worn_patch(film):
    patch = cv2.ellipse(np.zeros_like(film), (240, 180), (44, 24), 20, 0, 360, 1.0, -1)
    return film * (1 - 0.55 * cv2.GaussianBlur(patch, (0, 0), 1.5))


def glare(film):
    rows, columns = np.indices(film.shape)
    return np.minimum(film + 1.6 * np.exp(-(((columns - 360) ** 2 + (rows - 100) ** 2) / 144)), 1)


@pytest.mark.parametrize("blemish", [speck, scratch, worn_patch, glare])
@pytest.mark.parametrize("shift_px", [0, 3])
def test_a_blemish_is_no_motion_and_hides_none(blemish, shift_px):
    """As strong as on a real film, whose levels differ by a hundredth."""
    rng = np.random.default_rng(0)
    film = 0.5 + 0.05 * ndimage.gaussian_filter(rng.standard_normal((360, 480)), 1.5)
    motion = motion_of(0, 1, shift_px, (480, 360))
    seen = cv2.warpAffine(film, motion, (480, 360), borderMode=cv2.BORDER_REFLECT)
    before, now = (
        (x[..., None] + rng.normal(0, 0.003, (360, 480, 3))).astype(np.float32)
        for x in (film, blemish(seen))
    )
    assert moved_px(before, now) == pytest.approx(shift_px, abs=0.3)


def lit_film(rng, strength, shift_px):
    """A gel lit from the left and its film, ``strength`` grey levels of 255; one that moved, too.

    Both whole grey levels.
    """
    film = ndimage.gaussian_filter(rng.standard_normal((240, 320)), 1.5)
    light = np.linspace(150, 60, 320) + strength / film.std() * film
    seen = cv2.warpAffine(
        light, motion_of(0, 1, shift_px, (320, 240)), (320, 240), borderMode=cv2.BORDER_REFLECT
    )
    return [(x[..., None] + rng.normal(0, 0.5, (240, 320, 3))).round() for x in (light, seen)]


def through_jpeg(levels, quality=60):
    _, data = cv2.imencode(".jpg", levels.astype(np.uint8), [cv2.IMWRITE_JPEG_QUALITY, quality])
    return cv2.imdecode(data, cv2.IMREAD_COLOR)


def moved_of(before, now):
    return moved_px(*(np.asarray(x / 255, np.float32) for x in (before, now)))


@pytest.mark.parametrize("quality", [40, 20])
@pytest.mark.parametrize("seed", range(3))
def test_a_film_that_jpeg_has_swallowed_tells_nothing_and_a_stronger_one_does(quality, seed):
    before, now = lit_film(np.random.default_rng(seed), 0.35, 0)
    assert moved_of(before, through_jpeg(now, quality)) is None
    before, now = lit_film(np.random.default_rng(seed), 4, 2)
    assert moved_of(before, through_jpeg(now, quality)) == pytest.approx(2, abs=0.5)


@pytest.mark.parametrize("period_px", [17, 40])
@pytest.mark.parametrize("axis", [0, 1])
@pytest.mark.parametrize("shift_px", [0, 3])
def test_lights_that_flicker_are_no_motion_and_hide_none(period_px, axis, shift_px):
    before, now = lit_film(np.random.default_rng(0), 1.0, shift_px)
    wave = 1 + 0.05 * np.sin(2 * np.pi * np.arange(now.shape[axis]) / period_px)
    banded = (now * np.expand_dims(wave, (1 - axis, 2))).round()
    assert moved_of(before, banded) == pytest.approx(shift_px, abs=0.3)


def test_a_picture_that_is_another_and_one_without_any_texture_are_told_apart():
    rng = np.random.default_rng(0)
    films = ndimage.gaussian_filter(rng.standard_normal((2, 90, 120, 3)), (0, 1.5, 1.5, 0))
    one, other = (0.5 + films).astype(np.float32)
    assert moved_px(one, other) == np.inf and moved_px(one, one[:-1]) == np.inf
    smooth = (0.5 + rng.normal(0, 0.005, (2, 90, 120, 3))).astype(np.float32)
    assert moved_px(*smooth) is None
    assert moved_px(np.full_like(one, 0.5), one) is None


@pytest.mark.parametrize(("turn_deg", "zoom"), [(4, 1), (0, 1.07)], ids=["turned", "nearer"])
def test_a_sensor_whose_camera_turned_or_came_nearer_fails(tmp_path, turn_deg, zoom):
    unit, dataset = unit_of(good_set(tmp_path / "taught")), good_set(tmp_path / "set", 1)
    assert "moved_px" not in failed_of(accepted_on(unit, dataset))
    motion = motion_of(turn_deg, zoom, 0, (120, 90))

    def moved(frame, _):
        return cv2.warpAffine(frame, motion, (120, 90), borderMode=cv2.BORDER_REFLECT)

    change_frames(dataset, moved)
    assert "moved_px" in failed_of(accepted_on(unit, read_dataset(dataset.folder)))


def with_corners(dataset, left_px, top_px, pad_mm=(10.0, 7.0)):
    """The set as if its frames showed more than the pad; presses that lie off it are left out."""
    width, height = (
        round(pad / pitch) for pad, pitch in zip(pad_mm, dataset.card.mm_per_px, strict=True)
    )
    right, bottom = left_px + 100, top_px + 70
    corners = ((left_px, top_px), (right, top_px), (right, bottom), (left_px, bottom))
    card = replace(dataset.card, corners_px=corners, pad_size_mm=pad_mm)
    there = [
        replace(x, center_x_px=x.center_x_px - left_px, center_y_px=x.center_y_px - top_px)
        for x in dataset.labels
    ]
    labels = [x for x in there if 0 <= x.center_x_px < width and 0 <= x.center_y_px < height]
    write_card(dataset.folder / "dataset.toml", card)
    write_labels(dataset.folder / "labels.csv", labels)
    return read_dataset(dataset.folder)


def test_a_camera_that_moved_is_seen_though_the_set_has_corners_of_its_own(tmp_path):
    unit = unit_of(with_corners(good_set(tmp_path / "taught"), 10, 9))
    dataset = good_set(tmp_path / "set", 1)
    still = evaluate_on(unit, with_corners(good_set(tmp_path / "still", 2), 10, 9), seed=0)
    shift = np.float32([[1, 0, 6], [0, 1, 4]])
    change_frames(
        dataset,
        lambda x, _: cv2.warpAffine(x, shift, (120, 90), borderMode=cv2.BORDER_REFLECT),
    )
    went = [
        replace(x, center_x_px=x.center_x_px + 6, center_y_px=x.center_y_px + 4)
        for x in dataset.labels
    ]
    moved = with_corners(replace(dataset, labels=tuple(went)), 16, 13)
    found = accepted_on(unit, moved)
    assert found.values["moved_px"][""] == pytest.approx(np.hypot(6, 4), abs=0.3)
    assert "moved_px" in failed_of(found)
    judged = evaluate_on(unit, moved, seed=0, called="later")
    assert judged.moved_px == found.values["moved_px"][""]
    one, other = still.numbers["theta_x_deg"], judged.numbers["theta_x_deg"]
    assert difference(other, one)[0] < 0  # its errors do not tell
    assert pictures_moved([still]) == []
    (said,) = pictures_moved([still, judged])
    assert "on later: the blank gel's picture has moved by 7.2" in said
    assert verdict([still, judged], []) == [said]
    (lost,) = pictures_moved([replace(judged, moved_px=np.inf)])
    assert "cannot be recognised" in lost and "inf" not in lost
    assert pictures_moved([replace(judged, moved_px=None)]) == []


def test_a_scale_measured_again_is_no_move_of_the_camera(tmp_path):
    unit = unit_of(with_corners(good_set(tmp_path / "taught"), 10, 9))
    again = with_corners(good_set(tmp_path / "set", 1), 10, 9, pad_mm=(10.1, 7.1))
    found = accepted_on(unit, again)
    assert found.blank.shape != unit.unwarp(unit.background).shape
    assert found.values["moved_px"][""] < 0.3 and "brightness_change_share" in found.values
    other = with_corners(good_set(tmp_path / "other", 1), 10, 9, pad_mm=(11.0, 7.7))
    other = replace(other, card=replace(other.card, mm_per_px=(0.11, 0.11)))
    with pytest.raises(WedgeError, match=r"0\.11 x 0\.11 mm, but those of the unit"):
        accepted_on(unit, other)
