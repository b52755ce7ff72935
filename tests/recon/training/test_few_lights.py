# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest

from recon.ball import ball_cap
from recon.training.few_lights import _seen_by, measure

CAP = ball_cap((128, 96), (64.0, 48.0), 20.0, 26.0, (1.0, 1.0))
GRADIENT = CAP.gradient.astype(np.float32)


def measured(lights, count=60):
    """y slopes of one ball by many sensors, on its contact: (sensors, pixels)."""
    rng = np.random.default_rng(0)
    return np.stack([_seen_by(rng, GRADIENT, lights)[0][CAP.contact] for _ in range(count)])


@pytest.mark.parametrize(("lights", "most"), [(1, 0.35), (2, 0.25)])
def test_a_calibrated_sensor_is_about_right(lights, most):
    truth = GRADIENT[CAP.contact][:, 1]
    found = measured(lights)[..., 1]
    assert np.median(np.abs(found - truth)) < most * np.abs(truth).mean() / 0.4
    gains = found @ truth / (truth @ truth)
    assert 0.5 < np.median(gains) < 1.05


def test_one_light_is_worse_than_two():
    truth = GRADIENT[CAP.contact][:, 1]
    one, two = (np.abs(measured(lights)[..., 1] - truth).mean() for lights in (1, 2))
    assert one > 1.2 * two


def test_nothing_is_said_of_the_axis_across_the_lights():
    assert not measured(1, 5)[..., 0].any() and not measured(2, 5)[..., 0].any()


def test_the_three_kinds_occur_and_outside_the_support_nothing_is_reported():
    rng = np.random.default_rng(1)
    seen = [measure(rng, GRADIENT) for _ in range(80)]
    assert 4 <= sum(one.both for one in seen) <= 30
    assert 10 <= sum(bool(one.support.all()) for one in seen) <= 40
    for one in seen:
        assert one.gradient.shape == GRADIENT.shape and one.gradient.dtype == np.float32
        assert np.isfinite(one.gradient).all()
        assert not one.gradient[~one.support].any()
        assert one.both == bool(one.gradient[..., 0].any())


def test_the_support_holds_what_is_steep():
    rng = np.random.default_rng(2)
    steep = np.abs(GRADIENT[..., 1]) > 0.5
    held = [np.mean(measure(rng, GRADIENT).support[steep]) for _ in range(40)]
    assert np.median(held) == 1 and np.mean(held) > 0.9


def test_the_same_chance_gives_the_same_measurement():
    first, again = (measure(np.random.default_rng(3), GRADIENT) for _ in range(2))
    np.testing.assert_array_equal(first.gradient, again.gradient)
