# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Random balls are wholly visible, and judged where the error table judges."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from recon.ball import offsets_mm
from recon.training.random_balls import SQUARE, random_ball

SIZES = st.tuples(st.integers(40, 200), st.integers(40, 200))


@given(seed=st.integers(0, 10_000), size_px=SIZES)
def test_a_ball_is_wholly_visible_and_flat_gel_lies_around(
    seed: int, size_px: tuple[int, int]
) -> None:
    ball = random_ball(np.random.default_rng(seed), size_px)
    assert 0 < ball.contact_radius_px < ball.ball_radius_px
    for center, side in zip(ball.center_px, size_px, strict=True):
        assert ball.contact_radius_px < center < side - ball.contact_radius_px
    tilted = np.abs(ball.gradient).sum(-1) > 0
    distance = np.hypot(*offsets_mm(size_px, ball.center_px, SQUARE))
    assert not (tilted & (distance >= ball.contact_radius_px)).any()
    assert tilted[(distance > 1) & (distance < ball.contact_radius_px)].all()


@given(seed=st.integers(0, 10_000), size_px=SIZES)
def test_judged_are_the_contact_and_a_few_untouched_pixels(
    seed: int, size_px: tuple[int, int]
) -> None:
    random = np.random.default_rng(seed)
    ball = random_ball(random, size_px)
    judged = ball.judged(random)
    distance, contact = (
        np.hypot(*offsets_mm(size_px, ball.center_px, SQUARE)),
        ball.contact_radius_px,
    )
    assert judged[distance < contact - 1].all()
    assert not judged[(distance >= contact - 1) & (distance <= 1.3 * contact)].any()


def test_one_untouched_pixel_in_twenty_is_judged() -> None:
    random = np.random.default_rng(0)
    shares = []
    for _ in range(20):
        ball = random_ball(random, (160, 120))
        beside = np.hypot(*offsets_mm((160, 120), ball.center_px, SQUARE))
        beside = beside > 1.3 * ball.contact_radius_px
        shares.append(ball.judged(random)[beside].mean())
    assert np.mean(shares) == pytest.approx(0.05, abs=0.003)
