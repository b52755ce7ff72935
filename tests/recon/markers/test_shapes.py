# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Dots that the frame cuts hide pixels too, and what is no dot hides none."""

import numpy as np
import pytest

from recon.markers.detection import find_markers
from recon.markers.shapes import dot_shapes
from tests.dotted import dotted, grid_px

PLACES = grid_px(20.0)


@pytest.mark.parametrize(("darkness", "is_dot"), [(0.05, False), (0.4, True)])
def test_a_spot_on_the_frame_s_edge_is_a_cut_dot_where_it_is_as_dark_as_one(darkness, is_dot):
    blank = dotted(PLACES, noise=0.002)
    place = (1.0, PLACES[PLACES[:, 0].argmin()][1])
    spotted = dotted([place], image=blank.astype(float), darkness=darkness, noise=0.0)
    cut = dot_shapes(spotted, find_markers(blank)).owner == -2
    assert cut.any() == is_dot
    rows, columns = np.nonzero(cut)
    assert not is_dot or np.hypot(columns - place[0], rows - place[1]).max() < 8
