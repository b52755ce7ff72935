# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Dots that the frame cuts hide pixels too, and what is no dot hides none."""

import numpy as np
import pytest

from recon.markers.detection import find_markers
from recon.markers.shapes import dot_shapes
from tests.dotted import HEIGHT, WIDTH, dotted, grid_px

PLACES = grid_px(20.0)
BLANK = dotted(PLACES, noise=0.002)


@pytest.mark.parametrize(("darkness", "is_dot"), [(0.05, False), (0.4, True)])
def test_a_spot_on_the_frame_s_edge_is_a_cut_dot_where_it_is_as_dark_as_one(darkness, is_dot):
    place = (1.0, PLACES[PLACES[:, 0].argmin()][1])
    spotted = dotted([place], image=BLANK.astype(float), darkness=darkness, noise=0.0)
    cut = dot_shapes(spotted, find_markers(BLANK)).owner == -2
    assert cut.any() == is_dot
    rows, columns = np.nonzero(cut)
    assert not is_dot or np.hypot(columns - place[0], rows - place[1]).max() < 8


def moved_by(by):
    """What the dots hide when all are moved so far, and where their centres then are."""
    markers = find_markers(BLANK)
    shapes = dot_shapes(BLANK, markers)
    shift = np.tile(np.array(by, float), (len(markers), 1))
    return shapes, shapes.hidden(shift), markers.position_px + shift


@pytest.mark.parametrize("by", [(-30, 0), (0, -30), (30, 0), (0, 30)])
def test_a_dot_that_has_left_the_frame_hides_nothing_at_the_other_edge(by):
    shapes, now, places = moved_by(by)
    rows, columns = np.nonzero(now & (shapes.owner == -1))
    away_px = np.hypot(columns[:, None] - places[:, 0], rows[:, None] - places[:, 1]).min(1)
    assert len(rows) > 100 and away_px.max() < 8


def test_a_dot_that_moved_hides_a_pixel_more_on_each_side():
    by = np.array([10, 10])  # between the others
    shapes, now, places = moved_by(by)
    dot = np.hypot(*(places - [WIDTH / 2, HEIGHT / 2]).T).argmin()
    rows, columns = np.nonzero(shapes.owner == dot) + by[:, None]
    for down, right in ((1, 0), (-1, 0), (0, 1), (0, -1)):
        assert now[rows + down, columns + right].all()
