# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""The U-Net that infers a missing gradient axis, in numpy: running it needs no torch.

After Ronneberger, Fischer and Brox, MICCAI 2015 (https://arxiv.org/abs/1505.04597), made small:
six levels let a pixel see the whole contact, few channels keep it quick. Halving is by the mean
and not by the maximum, since the mean of noisy slopes is what an integral needs.
``unet_training`` holds the same network in torch.
"""

from collections.abc import Mapping
from itertools import pairwise

import numpy as np
from jaxtyping import Float32

CHANNELS = (8, 16, 24, 32, 32, 32)
"""Feature maps on each level, from full resolution down; every level halves both sides."""
STRIDE = 2 ** (len(CHANNELS) - 1)
"""Frame sides must be multiples of this."""

INPUTS = 2
"""Maps that the network sees: the known gradient and its integral."""
INTEGRAL_UNIT_PX = 8.0  # brings depths to about the size of slopes

Weights = Mapping[str, Float32[np.ndarray, "..."]]
Features = Float32[np.ndarray, "channels h w"]


def layer_shapes() -> dict[str, tuple[int, int, int]]:
    """Name → (channels out, channels in, kernel side) of every convolution."""
    shapes: dict[str, tuple[int, int, int]] = {}
    for level, (above, here) in enumerate(pairwise((INPUTS, *CHANNELS))):
        shapes[f"down{level}a"] = (here, above, 3)
        shapes[f"down{level}b"] = (here, here, 3)
    for level, (here, below) in enumerate(pairwise(CHANNELS)):
        shapes[f"lift{level}"] = (here, below, 1)
        shapes[f"up{level}a"] = (here, 2 * here, 3)
        shapes[f"up{level}b"] = (here, here, 3)
    shapes["out"] = (1, CHANNELS[0], 1)
    return shapes


def network_input(known: Float32[np.ndarray, "h w"]) -> Float32[np.ndarray, "2 h w"]:
    """The known y gradient and, from it, each column's depth with zero at both ends.

    The depth carries a slope as far as it reaches; convolutions alone would need many levels for
    large contacts. Its noise grows along the column, which is left for the network to clean.
    """
    depth_px = np.cumsum(known, axis=0) - known / 2
    end_px = depth_px[-1] + known[-1] / 2
    share = (np.arange(len(known), dtype=np.float32) + np.float32(0.5)) / len(known)
    depth_px -= share[:, None] * end_px
    return np.stack([known, depth_px / INTEGRAL_UNIT_PX])


def forward(weights: Weights, maps: Features) -> Float32[np.ndarray, "h w"]:
    """The missing x gradient from ``network_input``; sides are multiples of ``STRIDE``."""
    last = len(CHANNELS) - 1
    features = maps  # (2, h, w)
    skips: list[Features] = []
    for level in range(last + 1):
        if level > 0:
            features = _halve(features)
        features = _relu(_convolve(weights, f"down{level}a", features))
        features = _relu(_convolve(weights, f"down{level}b", features))  # (c, h / 2^l, w / 2^l)
        skips.append(features)
    for level in reversed(range(last)):
        lifted = _double(_convolve(weights, f"lift{level}", features))  # (c, h / 2^l, w / 2^l)
        features = np.concatenate([skips[level], lifted])  # (2 c, h / 2^l, w / 2^l)
        features = _relu(_convolve(weights, f"up{level}a", features))
        features = _relu(_convolve(weights, f"up{level}b", features))
    return _convolve(weights, "out", features)[0]


def _convolve(
    weights: Weights, layer: str, features: Features
) -> Float32[np.ndarray, "channels_out h w"]:
    """Zero-padded convolution as one matrix product per tap, without copying shifted frames.

    Rows are laid end to end with one zero between them. A shift of the frame is then a shift of
    the line, and what the shift carries over an edge is the zero.
    """
    kernel = weights[f"{layer}.weight"]  # (out, in, k, k)
    side = kernel.shape[-1]
    reach = side // 2
    channels, h, w = features.shape
    pitch = w + reach
    length = h * pitch
    line = np.zeros((channels, length + 2 * reach * (pitch + 1)), np.float32)
    first = reach * (pitch + 1)
    line[:, first : first + length].reshape(channels, h, pitch)[..., :w] = features
    total = np.broadcast_to(weights[f"{layer}.bias"][:, None], (len(kernel), length)).copy()
    for row in range(side):
        for column in range(side):
            start = row * pitch + column
            total += kernel[:, :, row, column] @ line[:, start : start + length]
    return total.reshape(-1, h, pitch)[..., :w]


def _relu(features: Features) -> Features:
    return np.maximum(features, 0.0)


def _halve(features: Features) -> Float32[np.ndarray, "channels h//2 w//2"]:
    channels, h, w = features.shape
    return features.reshape(channels, h // 2, 2, w // 2, 2).mean(axis=(2, 4))


def _double(features: Features) -> Float32[np.ndarray, "channels 2*h 2*w"]:
    return features.repeat(2, axis=1).repeat(2, axis=2)
