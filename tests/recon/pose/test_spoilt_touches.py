# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""A touch that is not the object's costs that frame alone, however large and deep it seems."""

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.touches import SyntheticTouch
from recon.pose.tracker import LEAST_DEPTH, LEAST_SHARE, Tracker
from tests.recon.pose.touched import bead_pair, coarse_bead, touch


def small(seed: int) -> SyntheticTouch:
    """The middle of a contact, less than a tenth of the frame."""
    whole = touch(coarse_bead(), np.eye(4), seed)
    height, width = whole.contact.shape
    middle = np.zeros_like(whole.contact)
    middle[height // 2 - 14 : height // 2 + 14, width // 2 - 16 : width // 2 + 16] = True
    return replace(
        whole,
        contact=whole.contact & middle,
        depth_mm=np.where(middle, whole.depth_mm, 0).astype(np.float32),
        gradient=np.where(middle[..., None], whole.gradient, 0).astype(np.float32),
    )


def flash(like: SyntheticTouch) -> SyntheticTouch:
    """All of the frame in contact, ten times as deep."""
    noise = np.random.default_rng(0).standard_normal(like.gradient.shape)
    return replace(
        like,
        contact=np.ones_like(like.contact),
        depth_mm=np.full_like(like.depth_mm, 10 * like.depth_mm.max()),
        gradient=noise.astype(np.float32),
    )


def torn(like: SyntheticTouch) -> SyntheticTouch:
    """One depth of it is infinite."""
    depth_mm = like.depth_mm.copy()
    depth_mm[np.nonzero(like.contact)[0][0], np.nonzero(like.contact)[1][0]] = np.inf
    return replace(like, depth_mm=depth_mm)


@pytest.mark.parametrize("spoil", [flash, torn])
def test_a_spoilt_touch_is_lost_and_the_next_is_followed_again(spoil) -> None:
    first, second = small(1), small(2)
    spoilt = spoil(first)
    assert first.contact.mean() < LEAST_SHARE < spoilt.contact.mean() or spoil is torn
    assert first.depth_mm.max() < LEAST_DEPTH * spoilt.depth_mm.max() or spoil is flash
    track = Tracker()
    assert track(first).state == "tracking"
    assert track(spoilt).state == "lost"
    assert track(second).state == "tracking"


def test_a_remnant_of_what_was_followed_is_lost() -> None:
    first = bead_pair(0)[0]
    track = Tracker()
    assert track(first).state == "tracking"
    shallow = replace(first, depth_mm=(first.depth_mm * LEAST_DEPTH / 2).astype(np.float32))
    assert track(shallow).reason == "too little of the object touches"
