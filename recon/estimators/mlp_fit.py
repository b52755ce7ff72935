# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Fitting the paper's network to labelled pixels. The training itself needs torch."""

from collections.abc import Callable

import numpy as np

from recon.estimators.effort import Effort
from recon.estimators.mlp import Mlp
from recon.lights import channel_indices
from recon.pixels import Pixels


def fit_mlp(
    pixels: Pixels,
    channels: str,
    seed: int,
    progress: Callable[[float], None],
    effort: Effort,
) -> Mlp:
    """Fit the network to labelled pixels."""
    from recon.estimators.mlp_training import train

    spread = pixels.color[:, channel_indices(channels)].std(0)
    color_scale = np.maximum(spread, 1 / 255).astype(np.float32)
    blank = Mlp(channels=channels, color_scale=color_scale, layers=())
    layers = train(blank.inputs(pixels.color, pixels.position), pixels.gradient, seed, progress)
    return Mlp(channels=channels, color_scale=color_scale, layers=layers)
