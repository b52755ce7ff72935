# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""What a network learns from rendered presses: measured and true slopes, kept together."""

import numpy as np
import pytest

from recon import unet
from recon.training import measured_presses as measured
from recon.training.contact_surfaces import surface_gradient
from recon.training.measured_presses import MeasuredPress, measured_presses
from recon.unet.weights import shipped_weights
from sensor.errors import WedgeError
from tests.synthetic import make_dataset, make_rendered_set

STRIDE = unet.stride(shipped_weights())


@pytest.fixture
def quick(monkeypatch):
    monkeypatch.setattr(measured, "ESTIMATORS", ("table",))


def test_measured_presses_hold_what_was_measured_beside_what_is_true(tmp_path, quick):
    balls = make_dataset(tmp_path / "balls").folder
    presses = make_rendered_set(tmp_path / "presses", presses=2, seed=5).folder
    found = list(measured_presses(balls, [presses], STRIDE, seed=0))
    assert len(found) == 2 * len(measured.LIGHTS)
    for press in found:
        height, width = press.support.shape
        assert height % STRIDE == width % STRIDE == 0
        assert press.maps.shape == (3, height, width) and press.truth.shape == (2, height, width)
        along_y, true = press.maps[1], press.truth[1]
        inside = np.hypot(*press.truth) > 0.1
        assert np.corrcoef(along_y[inside], true[inside])[0, 1] > 0.95
        assert not along_y[press.support == 0].any()


def test_balls_whose_lights_hide_no_axis_are_refused(tmp_path, quick):
    balls = make_dataset(tmp_path / "balls", lights_deg={"R": 0.0, "G": 120.0, "B": 240.0}).folder
    with pytest.raises(WedgeError, match="hide no axis"):
        next(measured_presses(balls, [balls], STRIDE, seed=0))


def test_a_mirrored_press_is_the_press_of_a_mirrored_object():
    depth = np.zeros((32, 48), np.float32)
    depth[8:20, 10:25] = np.add.outer(np.arange(12), np.arange(15)) / 10
    slopes = np.moveaxis(surface_gradient(depth), -1, 0).astype(np.float32)
    press = MeasuredPress(
        maps=np.stack([*slopes, depth.astype(np.float32)]),
        truth=slopes,
        support=(depth > 0).astype(np.float32),
    )
    seen = set()
    for seed in range(20):
        other = press.mirrored(np.random.default_rng(seed))
        np.testing.assert_array_equal(other.maps[:2], other.truth)
        np.testing.assert_array_equal(other.support, other.maps[2] > 0)
        again = np.moveaxis(surface_gradient(other.maps[2]), -1, 0)
        np.testing.assert_allclose(again, other.truth, atol=1e-6)
        seen.add(other.maps[2].tobytes())
    assert len(seen) == 4


@pytest.fixture
def small(monkeypatch):
    """The training modules, with torch, on small surfaces."""
    pytest.importorskip("torch").set_num_threads(1)
    from recon.training import missing_axis, missing_axis_doubt, missing_axis_further

    monkeypatch.setattr(missing_axis, "SMALL_PX", (32, 32))
    monkeypatch.setattr(missing_axis, "SMALL_FRAMES", 2)
    monkeypatch.setattr(missing_axis, "LARGE_SHARE", 0.0)
    return missing_axis_further, missing_axis_doubt


def press_of(truth):
    """Of that truth the y slope was measured, everywhere."""
    maps = np.stack([np.zeros_like(truth[1]), truth[1], np.zeros_like(truth[1])])
    return MeasuredPress(maps=maps, truth=truth, support=np.ones_like(truth[1]))


def test_the_second_course_keeps_weights_between_before_and_after(small, capsys):
    training, _ = small
    truth = np.random.default_rng(0).normal(0, 0.3, (2, 32, 32)).astype(np.float32)
    first = shipped_weights()
    kept = {}
    for share in (0.5, 1.0):
        kept[share], losses = training.train_further(first, [press_of(truth)], 8, 0, share)
    assert len(losses) == 8 and np.mean(losses[-3:]) < np.mean(losses[:3])
    for name, before in kept[0.5].items():
        np.testing.assert_allclose(before, (first[name] + kept[1.0][name]) / 2, atol=1e-6)
    assert any((kept[1.0][name] != first[name]).any() for name in kept[1.0])
    assert "step 8/8" in capsys.readouterr().out


def test_untouched_gel_is_a_window_of_any_size_without_slopes(small):
    rng, sizes = np.random.default_rng(0), set()
    for _ in range(40):
        gel = small[0].untouched_gel(rng, STRIDE)
        height, width = gel.support.shape
        assert height % STRIDE == width % STRIDE == 0
        assert gel.maps.shape == (unet.INPUTS, height, width) and not gel.maps.any()
        assert gel.truth.shape == (2, height, width) and not gel.truth.any()
        rows, columns = gel.support.any(1).sum(), gel.support.any(0).sum()
        assert gel.support.sum() == rows * columns
        assert height - rows < STRIDE and width - columns < STRIDE
        sizes.add((rows, columns))
    assert len(sizes) > 35


def test_every_step_of_the_second_course_learns_from_untouched_gel(small, monkeypatch):
    training, _ = small
    learn, learnt = training._learn_from, []

    def noted(network, press):
        loss = learn(network, press)
        learnt.append(press.truth.any())
        return loss

    monkeypatch.setattr(training, "_learn_from", noted)
    truth = np.random.default_rng(0).normal(0, 0.3, (2, 32, 32)).astype(np.float32)
    training.train_further(shipped_weights(), [press_of(truth)], 3, seed=0)
    assert learnt.count(False) == 3
    assert learnt.count(True) == 3 * training.PRESSES_A_STEP


def test_errors_that_neighbours_share_cost_more_than_noise_and_only_where_gel_may_have_moved(small):
    torch = pytest.importorskip("torch")
    errors_of, rows = small[0]._errors, np.indices((32, 32)).sum(0)
    support = torch.from_numpy((rows < 32).astype(np.float32))
    truth = torch.zeros(1, 2, 32, 32)
    alike, noise = (
        torch.from_numpy(np.broadcast_to(np.float32(0.04) * sign, (1, 2, 32, 32)).copy())
        for sign in (np.ones((32, 32), np.float32), np.where(rows % 2, 1, -1).astype(np.float32))
    )
    shared, single = (float(errors_of(error, truth, support)) for error in (alike, noise))
    assert single == pytest.approx(0.04**2 / 2, rel=0.1)
    assert 2.5 * single < shared < 3 * single + 1e-9
    beyond = errors_of(alike * (1 - support), truth, support)
    assert float(beyond) == 0


def test_the_doubt_learns_where_slopes_err_and_leaves_them_alone(small):
    """Half of a press is rough across the lights as well, of which nothing was measured."""
    _, training = small
    random = np.random.default_rng(0)
    rough = np.arange(64) >= 32
    truth = (random.normal(0, 0.5, (2, 64, 64)) * rough).astype(np.float32)
    press, before = press_of(truth), shipped_weights()
    after, losses = training.train_doubt(before, [press], 30, seed=0)
    assert len(losses) == 30 and np.mean(losses[-5:]) < np.mean(losses[:5])
    assert {name for name in before if (after[name] != before[name]).any()} == {
        f"doubt{layer}.{part}" for layer in (0, 1) for part in ("weight", "bias")
    }
    (slopes, doubt), (again, learnt) = (
        (found[:2], found[2])
        for found in (unet.forward(weights, press.maps) for weights in (before, after))
    )
    np.testing.assert_array_equal(slopes, again)
    error = np.abs(slopes[0] - truth[0])
    unlikely, still = (float((error * np.exp(-z) + z).mean()) for z in (doubt, learnt))
    assert still < unlikely - 0.1
    assert learnt[:, rough].mean() > learnt[:, ~rough].mean() + 1
