# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""The network in numpy and in torch, and its training."""

import subprocess
import sys

import numpy as np
import pytest

from recon import unet
from recon.unet.weights import load_weights, save_weights, shipped_weights
from sensor.errors import WedgeError
from sensor.extras import how_to_install

CHANNELS = (4, 6, 8)


@pytest.fixture
def training():
    """The training script, with torch."""
    pytest.importorskip("torch")
    from recon.training import missing_axis as training

    training.torch.set_num_threads(1)
    return training


def settings(training, steps, **others):
    return training.Settings(steps=steps, horizon=steps, channels=CHANNELS, **others)


@pytest.mark.parametrize(
    ("channels", "doubt"), [(unet.CHANNELS, 12), (CHANNELS, 0), (CHANNELS, 5), ((4, 6), 3)]
)
def test_the_numpy_network_is_the_torch_network(training, channels, doubt):
    torch = training.torch
    torch.manual_seed(0)
    network = training.UNet(channels, doubt)
    for last in ("out", "doubt1") if doubt else ("out",):
        torch.nn.init.normal_(network.layers[last].weight)  # zero at first, which proves nothing
    maps = np.random.default_rng(6).normal(size=(unet.INPUTS, 96, 160)).astype(np.float32)
    with torch.no_grad():
        expected = network(torch.from_numpy(maps)[None])[0].numpy()
    found = unet.forward(network.weights(), maps)
    np.testing.assert_allclose(found, expected, atol=2e-4)
    assert unet.channels_of(network.weights()) == channels
    assert unet.doubt_of(network.weights()) == doubt
    assert np.abs(expected[:2] - maps[:2]).max() > 1e-2


def test_what_goes_in_is_both_slopes_and_a_depth_that_explains_them():
    rng = np.random.default_rng(0)
    measured = rng.normal(0, 0.1, (48, 64, 2)).astype(np.float32)
    support = np.ones((48, 64), bool)
    support[:, :20] = False
    seen, both = (unet.network_input(measured, support, both=b) for b in (False, True))
    np.testing.assert_array_equal(both[0], measured[..., 0] * support)
    np.testing.assert_array_equal(seen[1], measured[..., 1] * support)
    along_x = np.gradient(seen[2] * unet.DEPTH_UNIT_PX, axis=1) * support
    np.testing.assert_allclose(seen[0][:, 1:-1], along_x[:, 1:-1], atol=1e-5)
    assert np.abs(seen[2]).max() > 0.01


def test_inference_needs_no_torch():
    code = (
        "import sys; sys.modules['torch'] = None\n"
        "import numpy as np; from recon.missing_axis.inference import infer_missing_axis\n"
        "infer_missing_axis(np.zeros((32, 32)), 'x', (1.0, 1.0))"
    )
    subprocess.run([sys.executable, "-c", code], check=True)


def test_without_torch_training_says_so_in_one_sentence():
    code = (
        "import sys, runpy; sys.modules['torch'] = None\n"
        "runpy.run_module('recon.training.missing_axis', run_name='__main__')"
    )
    done = subprocess.run([sys.executable, "-c", code], check=False, capture_output=True, text=True)
    assert done.returncode == 1
    assert done.stderr == f"Training needs torch: {how_to_install('train')}.\n"


def test_a_short_training_beats_zero_and_its_start(training, monkeypatch):
    monkeypatch.setattr(training, "LARGE_SHARE", 0.0)  # large frames are slow
    monkeypatch.setattr(training, "SMALL_PX", (32, 48))
    chosen = settings(training, 40, seed=1, recipes=("contact",))
    batches = [training.training_batch(chosen, 1000 + step) for step in range(2)]
    first = training.UNet(CHANNELS).weights()  # these take the slopes seen for all
    learnt, _ = training.train(chosen)

    def error(weights):
        found = [unet.forward(weights, frame) for maps, _ in batches for frame in maps]
        truth = [frame for _, frames in batches for frame in frames]
        pairs = zip(found, truth, strict=True)
        return sum(np.square(f[0] - t[0]).sum() for f, t in pairs), sum(
            np.square(t[0]).sum() for t in truth
        )

    before, of_zero = error(first)
    after, _ = error(learnt)
    assert after < before and after < 0.8 * of_zero


def test_the_script_leaves_weights_and_the_curve(training, tmp_path, capsys, monkeypatch):
    monkeypatch.setattr(training, "SMALL_PX", (32, 32))
    monkeypatch.setattr(training, "LARGE_PX", (32, 64))
    monkeypatch.setattr(training, "print_measures", lambda weights: None)
    words = ["missing_axis", "--steps", "3", "--workers", "0", "--channels", "4,6,8"]
    monkeypatch.setattr("sys.argv", [*words, "--out", str(tmp_path / "net.safetensors")])
    training.main()
    assert "step 3/3" in capsys.readouterr().out
    weights = load_weights(tmp_path / "net.safetensors")
    assert unet.channels_of(weights) == CHANNELS
    assert (tmp_path / "net.csv").read_text().splitlines()[0] == "step,loss"
    assert len((tmp_path / "net.csv").read_text().splitlines()) == 4
    assert (tmp_path / "net.png").read_bytes().startswith(b"\x89PNG")
    assert not list(tmp_path.glob("*checkpoint*"))


@pytest.mark.parametrize("horizon", [200, 500])
def test_the_learning_rate_rises_then_falls_to_nothing(training, horizon):
    rates = [training.learning_rate(step, 200, horizon) for step in range(200)]
    top = int(np.argmax(rates))
    assert rates[0] > 0 and 0.12 * horizon < top < 0.18 * horizon
    assert (np.diff(rates[: top + 1]) > 0).all() and (np.diff(rates[top:]) < 0).all()
    assert rates[-1] < 0.03 * rates[top]  # the last of 40 steps down


@pytest.mark.parametrize("name", ["down0a.bias", "doubt0.bias", "out.bias", "lift0.weight"])
@pytest.mark.parametrize("shape", [(), (0,), (1, 12), (2, 3, 2, 1)])
def test_weights_of_other_dimensions_are_refused(tmp_path, name, shape):
    path = tmp_path / "weights.safetensors"
    save_weights(path, shipped_weights() | {name: np.zeros(shape, np.float32)}, "by hand", 0)
    with pytest.raises(WedgeError, match="another network"):
        load_weights(path)


def test_weights_of_another_network_are_refused(tmp_path):
    path = tmp_path / "weights.safetensors"
    short = {name: values for name, values in shipped_weights().items() if name != "out.bias"}
    save_weights(path, short, "python -m recon.training.missing_axis", 0)
    with pytest.raises(WedgeError, match="another network"):
        load_weights(path)
