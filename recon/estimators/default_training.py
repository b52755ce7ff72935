# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Training of the default estimator: all its networks side by side, with torch on one thread."""

from collections.abc import Callable, Iterator, Sequence
from itertools import pairwise

import numpy as np
import torch
from jaxtyping import Float32, Int

from recon.estimators.descent import (
    RECTIFIER,
    Batch,
    decaying,
    descend,
    one_thread,
    soap_rule,
    uniform,
)
from recon.estimators.networks import HIDDEN, Layer

STEPS = 3000
BATCH = 1024
DECAY = 0.1
"""Of weights, against labels that are learnt by heart (docs/tried/estimators.md)."""


def train(
    inputs: Float32[np.ndarray, "n f"],
    wanted: Float32[np.ndarray, "n o"],
    taught: Sequence[Int[np.ndarray, " _"]],
    fitted: int,
    seed: int,
    progress: Callable[[float], None],
    share: float = 1.0,
) -> tuple[Layer, ...]:
    """Fit a network to each choice of pixels, by mean squared error.

    The mean and not the median, as a median is biased where noise is skewed, and a bias of slopes
    adds up to depth. The same seed gives the same layers.

    Args:
        inputs: of every pixel.
        wanted: of every pixel.
        taught: which pixels each network learns from.
        fitted: so many of the networks. The others are only drawn for, so that these become what
            they would be beside them.
        seed: of first weights and batches.
        progress: called with the share that is done.
        share: of the steps.
    """
    random = torch.Generator().manual_seed(seed)
    x, y = torch.from_numpy(inputs), torch.from_numpy(wanted)
    own, steps = [torch.from_numpy(chosen) for chosen in taught], round(share * STEPS)
    drawn = [
        (uniform((len(own), i, o), i, random), uniform((len(own), 1, o), i, random))
        for i, o in pairwise((x.shape[1], *HIDDEN, y.shape[1]))
    ]
    first = [(weight[:fitted], bias[:fitted]) for weight, bias in drawn]
    with one_thread():
        every = _batches(x, y, own, fitted, steps, random)
        layers = descend(first, RECTIFIER, every, steps, progress, decaying(soap_rule, DECAY))
    return tuple((weight.numpy().copy(), bias[:, 0].numpy().copy()) for weight, bias in layers)


def _batches(
    x: torch.Tensor,
    y: torch.Tensor,
    own: Sequence[torch.Tensor],
    fitted: int,
    steps: int,
    random: torch.Generator,
) -> Iterator[Batch]:
    """Pixels drawn for each network from its own, those of the first to be fitted."""
    every, counts = torch.cat(list(own)), [len(chosen) for chosen in own]
    pixels = torch.cat([x, y], 1)  # side by side, as memory takes its time for each
    begins = torch.tensor([0, *counts[:-1]]).cumsum(0)[:, None]
    for _ in range(steps):
        drawn = [torch.randint(count, (BATCH,), generator=random) for count in counts]
        rows = every.index_select(0, (torch.stack(drawn) + begins)[:fitted].view(-1))
        batch = pixels.index_select(0, rows).view(fitted, BATCH, -1)
        yield batch[..., : x.shape[1]], batch[..., x.shape[1] :]
