# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Training of the default estimator: all its networks side by side, with torch on one thread."""

from collections.abc import Callable, Sequence
from itertools import pairwise

import numpy as np
import torch
from jaxtyping import Float32, Int

from recon.estimators.networks import HIDDEN, Layer

STEPS = 4000
BATCH = 512
PEAK_LEARNING_RATE = 1e-2
"""Of a one-cycle schedule (Smith and Topin, 2018)."""
REPORT_EVERY = 200


def train(
    inputs: Float32[np.ndarray, "n f"],
    wanted: Float32[np.ndarray, "n o"],
    taught: Sequence[Int[np.ndarray, " _"]],
    seed: int,
    progress: Callable[[float], None],
    share: float = 1.0,
) -> tuple[Layer, ...]:
    """Fit a network to each choice of pixels, by mean squared error.

    The mean and not the median, as a median is biased where noise is skewed, and a bias of slopes
    adds up to depth. The same seed gives the same layers. ``share``
    of ``STEPS`` is done.
    """
    threads = torch.get_num_threads()
    torch.set_num_threads(1)
    try:
        random = torch.Generator().manual_seed(seed)
        layers = _fit(inputs, wanted, taught, random, progress, round(share * STEPS))
    finally:
        torch.set_num_threads(threads)
    return tuple((w.detach().numpy().copy(), b.detach().numpy()[:, 0].copy()) for w, b in layers)


def _fit(
    inputs: Float32[np.ndarray, "n f"],
    wanted: Float32[np.ndarray, "n o"],
    taught: Sequence[Int[np.ndarray, " _"]],
    random: torch.Generator,
    progress: Callable[[float], None],
    steps: int,
) -> list[tuple[torch.Tensor, torch.Tensor]]:
    x, y = torch.from_numpy(inputs), torch.from_numpy(wanted)
    own = [torch.from_numpy(chosen) for chosen in taught]
    count = len(own)
    layers = [
        (_uniform((count, i, o), i, random), _uniform((count, 1, o), i, random))
        for i, o in pairwise((x.shape[1], *HIDDEN, y.shape[1]))
    ]
    optimizer = torch.optim.Adam([part for layer in layers for part in layer])
    schedule = torch.optim.lr_scheduler.OneCycleLR(optimizer, PEAK_LEARNING_RATE, total_steps=steps)
    for step in range(steps):
        rows = torch.stack(
            [pixels[torch.randint(len(pixels), (BATCH,), generator=random)] for pixels in own]
        )
        values = x[rows]  # (member, batch, feature)
        for weight, bias in layers[:-1]:
            values = torch.relu(torch.baddbmm(bias, values, weight))
        weight, bias = layers[-1]
        optimizer.zero_grad()
        ((torch.baddbmm(bias, values, weight) - y[rows]) ** 2).mean((1, 2)).sum().backward()
        optimizer.step()
        schedule.step()
        if (step + 1) % REPORT_EVERY == 0 or step + 1 == steps:
            progress((step + 1) / steps)
    return layers


def _uniform(shape: tuple[int, ...], fan_in: int, random: torch.Generator) -> torch.Tensor:
    """First weights within 1 / sqrt(fan in), as torch draws them for one layer."""
    bound = fan_in**-0.5
    return torch.empty(shape).uniform_(-bound, bound, generator=random).requires_grad_()
