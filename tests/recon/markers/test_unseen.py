# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""A dot that is not there is not seen, whatever else is; with few in sight all are lost."""

import numpy as np
import pytest

from recon.markers.tracking import marker_tracker
from tests.dotted import dotted, grid_px

PLACES = grid_px(20.0)
TRACKER = marker_tracker(dotted(PLACES))


@pytest.mark.parametrize(("darkness", "is_seen"), [(0.08, False), (0.4, True)])
def test_a_faint_spot_beside_a_covered_dot_is_not_that_dot(darkness, is_seen):
    missing = np.linalg.norm(PLACES - [120, 90], axis=1).argmin()
    others = dotted(np.delete(PLACES, missing, 0)).astype(float)
    spot = PLACES[missing] + [4, 2]
    tracked = TRACKER.track(dotted([spot], image=others, darkness=darkness, noise=0.0))
    dot = np.linalg.norm(TRACKER.markers.position_px - PLACES[missing], axis=1).argmin()
    assert tracked.seen[dot] == is_seen
    assert np.delete(tracked.seen, dot).all()


@pytest.mark.parametrize(("share", "word"), [(0.6, "tracked"), (0.4, "lost")])
def test_with_fewer_than_half_of_the_dots_in_sight_they_are_lost(share, word):
    kept = np.random.default_rng(0).permutation(PLACES)[: round(share * len(PLACES))]
    tracked = TRACKER.track(dotted(kept))
    assert tracked.seen.mean() == pytest.approx(share, abs=0.02)
    assert tracked.word == word
