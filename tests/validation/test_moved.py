# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""A camera that has moved in any way is seen by the gel's film, and one that has not is not."""

import cv2
import numpy as np
import pytest
from scipy import ndimage

from sensor.dataset import read_dataset
from tests.validation.sensors import accepted_on, change_frames, failed_of, good_set, unit_of
from validation.acceptance.moved import moved_px


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
