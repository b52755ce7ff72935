# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Training of the paper's network, with torch on one thread."""

from collections.abc import Callable, Iterator
from itertools import pairwise

import numpy as np
import torch
from jaxtyping import Float32

from recon.estimators.descent import TANH, Batch, adam_rule, descend, one_thread, uniform
from recon.estimators.mlp import HIDDEN, Layer

PIXELS = 150_000
"""Drawn from all that are labelled: neighbours say nearly the same."""
EPOCHS = 30
BATCH = 1024


def train(
    inputs: Float32[np.ndarray, "n f"],
    gradient: Float32[np.ndarray, "n 2"],
    seed: int,
    progress: Callable[[float], None],
) -> tuple[Layer, ...]:
    """Fit the network by mean squared error; the same seed gives the same layers."""
    random = torch.Generator().manual_seed(seed)
    drawn = torch.randperm(len(inputs), generator=random)[:PIXELS].numpy()
    x, y = torch.from_numpy(inputs[drawn]), torch.from_numpy(gradient[drawn])
    first = [
        (uniform((o, i), i, random).T[None], uniform((1, 1, o), i, random))
        for i, o in pairwise((x.shape[1], *HIDDEN, 2))
    ]
    batches = max(1, len(x) // BATCH)
    with one_thread():
        every = _batches(x, y, batches, random)
        layers = descend(first, TANH, every, EPOCHS * batches, progress, adam_rule)
    return tuple((weight[0].numpy().copy(), bias[0, 0].numpy().copy()) for weight, bias in layers)


def _batches(
    x: torch.Tensor, y: torch.Tensor, count: int, random: torch.Generator
) -> Iterator[Batch]:
    """Every pixel once an epoch, in an order that is drawn anew."""
    for _ in range(EPOCHS):
        order = torch.randperm(len(x), generator=random)
        yield from zip(x[None, order].chunk(count, 1), y[None, order].chunk(count, 1), strict=True)
