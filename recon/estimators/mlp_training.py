# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Training of the paper's network, with torch on one thread: small batches do not pay for two."""

from collections.abc import Callable
from itertools import pairwise

import numpy as np
import torch
from jaxtyping import Float32
from torch import nn

from recon.estimators.mlp import HIDDEN, Layer

PIXELS = 150_000
"""Drawn from all that are labelled: neighbours say nearly the same."""
EPOCHS = 30
BATCH = 1024
PEAK_LEARNING_RATE = 1e-2
"""Of a one-cycle schedule (Smith and Topin, 2018)."""


def train(
    inputs: Float32[np.ndarray, "n f"],
    gradient: Float32[np.ndarray, "n 2"],
    seed: int,
    progress: Callable[[float], None],
) -> tuple[Layer, ...]:
    """Fit the network by mean squared error; the same seed gives the same layers."""
    threads = torch.get_num_threads()
    torch.set_num_threads(1)
    try:
        network = _fit(inputs, gradient, torch.Generator().manual_seed(seed), progress)
    finally:
        torch.set_num_threads(threads)
    return tuple(
        (layer.weight.detach().numpy().T.copy(), layer.bias.detach().numpy().copy())
        for layer in network
        if isinstance(layer, nn.Linear)
    )


def _fit(
    inputs: Float32[np.ndarray, "n f"],
    gradient: Float32[np.ndarray, "n 2"],
    random: torch.Generator,
    progress: Callable[[float], None],
) -> nn.Sequential:
    drawn = torch.randperm(len(inputs), generator=random)[:PIXELS].numpy()
    x, y = torch.from_numpy(inputs[drawn]), torch.from_numpy(gradient[drawn])
    sizes = (x.shape[1], *HIDDEN)
    hidden = [
        layer
        for fan_in, fan_out in pairwise(sizes)
        for layer in (_linear(fan_in, fan_out, random), nn.Tanh())
    ]
    network = nn.Sequential(*hidden, _linear(sizes[-1], 2, random))
    optimizer = torch.optim.Adam(network.parameters())
    batches = max(1, len(x) // BATCH)
    schedule = torch.optim.lr_scheduler.OneCycleLR(
        optimizer, PEAK_LEARNING_RATE, total_steps=EPOCHS * batches
    )
    for epoch in range(EPOCHS):
        for rows in torch.randperm(len(x), generator=random).chunk(batches):
            optimizer.zero_grad()
            nn.functional.mse_loss(network(x[rows]), y[rows]).backward()
            optimizer.step()
            schedule.step()
        progress((epoch + 1) / EPOCHS)
    return network


def _linear(fan_in: int, fan_out: int, random: torch.Generator) -> nn.Linear:
    """A layer with torch's own first weights, drawn without its global state."""
    layer = nn.Linear(fan_in, fan_out)
    bound = fan_in**-0.5
    with torch.no_grad():
        layer.weight.uniform_(-bound, bound, generator=random)
        layer.bias.uniform_(-bound, bound, generator=random)
    return layer
