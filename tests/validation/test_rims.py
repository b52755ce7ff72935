# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Slopes ring by ring round a ball's circle."""

from dataclasses import replace

import numpy as np

from recon.ball import ball_cap
from recon.presses import read_presses
from tests.synthetic import make_dataset
from validation.rims import RINGS, rim_profile


def test_the_balls_own_slopes_are_those_that_labels_say(tmp_path):
    presses = read_presses(make_dataset(tmp_path / "set", presses=3)).presses
    caps = [
        ball_cap(p.size_px, p.center_px, p.contact_radius_mm, p.ball_radius_mm, p.mm_per_px)
        for p in presses
    ]
    profile = rim_profile(presses, [cap.gradient for cap in caps])
    assert profile.presses == 3
    assert np.allclose(profile.found, profile.labelled, atol=1e-6)
    assert np.all(np.diff(profile.found[profile.middles < 1]) > 0)
    assert np.all(profile.found[profile.middles > 1] == 0)


def test_a_label_that_is_too_wide_is_seen(tmp_path):
    (press,) = read_presses(make_dataset(tmp_path / "set", presses=1)).presses
    shape = press.size_px, press.center_px
    cap = ball_cap(*shape, press.contact_radius_mm, press.ball_radius_mm, press.mm_per_px)
    wide = replace(press, contact_radius_px=1.2 * press.contact_radius_px)
    profile = rim_profile([wide], [cap.gradient])
    # The last ring that lies wholly inside the true rim.
    assert 0 < 1 / 1.2 - profile.steepest_at < 2 * np.diff(RINGS).max()
    assert profile.labelled[profile.middles < 1][-1] > 0.2 > profile.found[profile.middles < 1][-1]
