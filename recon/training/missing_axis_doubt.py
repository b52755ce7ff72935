# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Teach the U-Net of the missing axis how far off its slopes are, once these are kept.

The layers that the doubt has of its own learn alone: nothing that a slope comes from changes. They
see random surfaces and rendered presses, half and half, and maximize the likelihood of the x
slope's error under Laplace's law, by which the doubt becomes the error to be expected.
"""

import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from recon import unet
from recon.training.further_courses import settings_of
from recon.training.measured_presses import MeasuredPress
from recon.training.missing_axis import Settings, UNet, doubt_losses, learning_rate, training_batch
from recon.training.resumable import DEVICE, ResumableTraining
from sensor.extras import how_to_install

try:
    import torch
    from torch import Tensor, nn
except ModuleNotFoundError:  # one sentence in place of a traceback
    sys.exit(f"Training needs torch: {how_to_install('train')}.")

MAPS = 12
"""Feature maps of the doubt's own: with more, nothing is told better."""
PEAK = 2.0
"""Of the first course's learning rate: few weights, and none of them deep."""
PRESSES_A_STEP = 3  # beside a batch of random surfaces
LEAST_MOVED_PX = 400  # so that a small press does not count for more than a large one
STEEPEST_STEP = 1.0


def train_doubt(
    weights: unet.Weights,
    presses: Sequence[MeasuredPress],
    steps: int,
    seed: int,
    checkpoint: Path | None = None,
) -> tuple[dict[str, np.ndarray], list[float]]:
    """The same weights and those of the doubt's own layers, and every step's loss.

    Progress goes to stdout.

    Args:
        weights: whose slopes are kept; layers of the doubt's own that it has are taught anew.
        presses: rendered, as sensors measured them.
        steps: batches.
        seed: of surfaces, of the first weights and of the order of presses.
        checkpoint: what is kept on the way, from which it goes on where it is there.

    Raises:
        WedgeError: the checkpoint belongs to another training, or cannot be read or written.
    """
    torch.manual_seed(seed)
    channels = unet.channels_of(weights)
    network = UNet(channels, MAPS).to(DEVICE)
    network.take(weights)
    network.requires_grad_(False)
    own = [network.layers[name] for name in ("doubt0", "doubt1")]
    taught = [parameter.requires_grad_() for layer in own for parameter in layer.parameters()]
    optimizer = torch.optim.Adam(taught)
    surfaces = Settings(seed=seed, steps=steps, horizon=steps, channels=channels)
    settings = settings_of(seed, weights, (press.truth for press in presses))
    training = ResumableTraining(network, optimizer, steps, settings, checkpoint)

    def learn(step: int) -> float:
        for group in optimizer.param_groups:
            group["lr"] = PEAK * learning_rate(step, steps, steps)
        maps, truth = (torch.from_numpy(item).to(DEVICE) for item in training_batch(surfaces, step))
        loss = doubt_losses(network(maps), truth).mean()
        rng = np.random.default_rng([seed, step, 1])
        for index in rng.integers(len(presses), size=PRESSES_A_STEP):
            loss = loss + _on_what_moved(network, presses[index].mirrored(rng)) / PRESSES_A_STEP
        optimizer.zero_grad()
        loss.backward()
        nn.utils.clip_grad_norm_(taught, STEEPEST_STEP)
        optimizer.step()
        return loss.item() / 2

    losses = training.follow(learn)
    return network.weights(), losses


def _on_what_moved(network: UNet, press: MeasuredPress) -> Tensor:
    """Loss on the gel that may have moved; elsewhere no doubt is told."""
    maps, truth = (torch.from_numpy(item[None]).to(DEVICE) for item in (press.maps, press.truth))
    support = torch.from_numpy(press.support).to(DEVICE)
    losses = doubt_losses(network(maps), truth) * support
    return losses.sum() / max(float(press.support.sum()), LEAST_MOVED_PX)
