# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Where nothing touches no ball is found, and what is looked at touches nothing."""

from dataclasses import replace

import numpy as np
import pytest

from recon.labels.find_circle import find_circle
from recon.presses import press_reader
from tests.synthetic import make_dataset
from validation.untouched import CLEAR_OF_BALL, clear_part, seen_again


@pytest.fixture(scope="module")
def dataset(tmp_path_factory):
    return make_dataset(tmp_path_factory.mktemp("untouched") / "set", presses=2)


def test_no_ball_is_found_on_a_blank_frame_seen_again(dataset):
    row = seen_again(str(dataset.folder), count=3)
    assert (row.searches, row.found) == (3, ())


def test_the_clear_part_is_the_largest_one_without_the_ball(dataset):
    difference = np.zeros((90, 120, 3), np.float32)
    label = replace(dataset.labels[0], center_x_px=30.0, center_y_px=20.0, contact_radius_px=10.0)
    difference[20, int(30 + CLEAR_OF_BALL * 10) - 1] = 1
    part = clear_part(difference, label)
    assert part is not None
    assert part.shape == (90, 60, 3)
    assert not part.any()
    assert clear_part(difference, replace(label, center_x_px=60.0, contact_radius_px=20.0)) is None


def test_a_disc_whose_centre_lies_outside_is_not_a_ball(dataset):
    reader, label = press_reader(dataset), dataset.labels[0]
    press = reader.read(label)
    beyond = int(np.ceil(label.center_x_px + 0.4 * label.contact_radius_px))
    part = np.ascontiguousarray(press.difference[:, beyond:])
    assert find_circle(part, press.ball_radius_mm, press.mm_per_px) is None
