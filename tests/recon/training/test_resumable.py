# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Every training, interrupted, goes on to the very network it would have become."""

import signal
from concurrent.futures import ThreadPoolExecutor
from functools import cache

import numpy as np
import pytest

from recon.training.felt_presses import FeltPress
from recon.training.measured_presses import MeasuredPress
from recon.unet.weights import shipped_weights
from sensor.errors import WedgeError

torch = pytest.importorskip("torch")
from recon.contact.network import CONTACT  # noqa: E402
from recon.training import (  # noqa: E402
    contact,
    contact_further,
    missing_axis,
    missing_axis_doubt,
    missing_axis_further,
    resumable,
)

STEPS = 5


@pytest.fixture(autouse=True)
def small(monkeypatch):
    """Small frames, a checkpoint every second step, and sums that always round alike."""
    torch.set_num_threads(1)
    monkeypatch.setattr(resumable, "CHECKPOINT_STEPS", 2)
    monkeypatch.setattr(missing_axis, "SMALL_PX", (32, 32))
    monkeypatch.setattr(missing_axis, "SMALL_FRAMES", 2)
    monkeypatch.setattr(missing_axis, "LARGE_SHARE", 0.0)
    monkeypatch.setattr(contact, "FRAMES", 2)
    monkeypatch.setattr(contact_further, "PRESSES", 3)
    monkeypatch.setattr(contact_further, "FELT_FRAMES", 2)


def slopes(seed=0):
    return np.random.default_rng(seed).normal(0, 0.3, (2, 32, 32)).astype(np.float32)


def measured(seed=0):
    """As if a sensor had read the y slope alone."""
    truth = slopes(seed)
    maps = np.stack([np.zeros_like(truth[1]), truth[1], np.zeros_like(truth[1])])
    return [MeasuredPress(maps=maps, truth=truth, support=np.ones_like(truth[1]))]


def felt(seed=0):
    gradient = np.moveaxis(slopes(seed), 0, -1)
    depth = np.abs(gradient[..., 0])
    return [FeltPress(depth_px=depth, gradient=gradient, held=depth > 0.2)]


def first_course(path, steps=STEPS, seed=0, executor=None):
    chosen = missing_axis.Settings(seed=seed, steps=steps, horizon=steps, channels=(4, 6))
    return missing_axis.train(chosen, executor, path)


def further(path, steps=STEPS, seed=0, presses=None):
    return missing_axis_further.train_further(
        shipped_weights(), presses or measured(), steps, seed, checkpoint=path
    )


def doubt(path, steps=STEPS, seed=0, presses=None):
    return missing_axis_doubt.train_doubt(
        shipped_weights(), presses or measured(), steps, seed, path
    )


def contact_courses(path, steps=STEPS, seed=0):
    paths = [path.with_suffix(f".{course}") for course in (1, 2)] if path else ()
    with ThreadPoolExecutor(1) as executor:
        return contact.train(seed, (2, steps - 2), (4, 6), executor, count=3, checkpoints=paths)


def contact_again(path, steps=STEPS, seed=0, presses=None):
    weights = shipped_weights(CONTACT)
    return contact_further.train_further(weights, presses or felt(), steps, seed, path)


each_training = pytest.mark.parametrize(
    "train", [first_course, further, doubt, contact_courses, contact_again]
)
each_checkpoint = pytest.mark.parametrize("train", [first_course, further, doubt, contact_again])


@cache
def uninterrupted(train):
    """What a training becomes that nobody breaks off."""
    return train(None)


def at_step(step, monkeypatch, do):
    """Do something amid the step of that number, counted from 1."""
    clip, taken = torch.nn.utils.clip_grad_norm_, []

    def doing(*args):
        taken.append(None)
        if len(taken) == step:
            do()
        return clip(*args)

    monkeypatch.setattr(torch.nn.utils, "clip_grad_norm_", doing)


def interrupted_at(step, monkeypatch):
    """Break off the step of that number, counted from 1."""

    def interrupt():
        raise KeyboardInterrupt

    at_step(step, monkeypatch, interrupt)


@each_training
def test_an_interrupted_training_goes_on_to_the_same_network(train, tmp_path, monkeypatch, capsys):
    path = tmp_path / "checkpoint.safetensors"
    whole, losses = uninterrupted(train)
    with monkeypatch.context() as broken, pytest.raises(KeyboardInterrupt):
        interrupted_at(4 if train is not contact_courses else 5, broken)
        train(path)
    assert "going on" not in capsys.readouterr().out
    resumed, again = train(path)
    assert "going on from step 2" in capsys.readouterr().out
    assert len(losses) == STEPS and again == losses
    for name, values in whole.items():
        np.testing.assert_array_equal(values, resumed[name])


@each_training
@pytest.mark.parametrize("asked_at", [1, 2, STEPS])  # the second is contact's first course's last
@pytest.mark.usefixtures("usual_ctrl_c")
def test_ctrl_c_is_heard_after_a_step_and_the_checkpoint_has_that_step(
    train, asked_at, tmp_path, monkeypatch, capsys
):
    path = tmp_path / "checkpoint.safetensors"
    whole, losses = uninterrupted(train)
    with monkeypatch.context() as asked, pytest.raises(KeyboardInterrupt, match="the same command"):
        at_step(asked_at, asked, lambda: signal.raise_signal(signal.SIGINT))
        train(path)
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
    resumed, again = train(path)
    done = asked_at if train is not contact_courses or asked_at < STEPS else asked_at - 2
    assert f"going on from step {done} of" in capsys.readouterr().out
    assert again == losses
    for name, values in whole.items():
        np.testing.assert_array_equal(values, resumed[name])


@each_training
def test_a_training_that_was_done_is_not_taken_again(train, tmp_path, monkeypatch):
    path = tmp_path / "checkpoint.safetensors"
    whole, losses = train(path)
    interrupted_at(1, monkeypatch)
    again, kept = train(path)
    assert kept == losses
    for name, values in whole.items():
        np.testing.assert_array_equal(values, again[name])


@each_checkpoint
@pytest.mark.parametrize("other", [{"steps": STEPS + 1}, {"seed": 1}])
def test_a_checkpoint_of_other_settings_is_refused(train, other, tmp_path):
    path = tmp_path / "checkpoint.safetensors"
    train(path)
    with pytest.raises(WedgeError, match="other settings: delete it"):
        train(path, **other)


@pytest.mark.parametrize(
    ("train", "presses"), [(further, measured(1)), (doubt, measured(1)), (contact_again, felt(1))]
)
def test_a_checkpoint_of_other_presses_is_refused(train, presses, tmp_path):
    path = tmp_path / "checkpoint.safetensors"
    train(path)
    with pytest.raises(WedgeError, match="other settings: delete it"):
        train(path, presses=presses)


@each_checkpoint
@pytest.mark.parametrize("damaged", [b"nothing", b""])
def test_a_damaged_checkpoint_is_refused(train, damaged, tmp_path):
    path = tmp_path / "checkpoint.safetensors"
    path.write_bytes(damaged)
    with pytest.raises(WedgeError, match=r"cannot be read as a checkpoint: .*; delete it to begin"):
        train(path)


def test_a_checkpoint_of_the_same_settings_and_another_network_is_refused(tmp_path):
    path = tmp_path / "checkpoint.safetensors"

    def training(channels):
        network = missing_axis.UNet(channels)
        return resumable.ResumableTraining(
            network, resumable.Soap(network.parameters()), 2, {}, path
        )

    training((1, 1)).follow(lambda step: 0.0)
    training((1, 1))
    with pytest.raises(WedgeError, match="another network: delete it"):
        training((2, 2))


def test_batches_that_others_make_ahead_are_those_of_one_process():
    with ThreadPoolExecutor(2) as executor:
        ahead, losses = first_course(None, executor=executor)
    alone, same = uninterrupted(first_course)
    assert same == losses
    for name, values in alone.items():
        np.testing.assert_array_equal(values, ahead[name])
