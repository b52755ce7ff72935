# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""The U-Nets that complete gradient fields and find held gel, in numpy: they run without torch.

After Ronneberger, Fischer and Brox, MICCAI 2015 (https://arxiv.org/abs/1505.04597), made small.
Four neighbouring pixels enter as one, each with its own maps, and leave again as four: nothing of
the picture is lost, and the costly finest level has a quarter of the places. Where single pixels
decide, as at a contact's edge, a few layers can follow at full resolution. A last map that tells
how far off the others are can have layers of its own: the features were learnt to tell slopes, and
no sum of them tells their error well. The network that completes gradient fields need not find the
depth of a large contact by itself: that comes in from a convex fit, which it corrects. Halving is
by the mean and not by the maximum, since the mean of noisy slopes is what an integral needs.
``recon.training.torch_layers`` holds the same layers in torch.
"""

from collections.abc import Mapping, Sequence
from itertools import pairwise

import numpy as np
from jaxtyping import Float32

from recon.integration.pressed import Support, pressed_depth

CHANNELS = (12, 16, 24, 32)
"""Feature maps on each level of the network that completes gradient fields; each level halves both
sides. What follows is of that network too."""

INPUTS = 3
"""Maps in: x and y gradient, and a depth that explains what was measured."""
OUTPUTS = 3
"""Maps out: x and y gradient, and the logarithm of the x gradient's expected error."""
DEPTH_UNIT_PX = 8.0  # brings depths to about the size of slopes
COARSENESS = 4  # of the depth that the network is given

STRIP_ROWS = 12
"""Of a level that are convolved at a time."""

Weights = Mapping[str, Float32[np.ndarray, "..."]]
Features = Float32[np.ndarray, "channels h w"]


class Layers(dict[str, Float32[np.ndarray, "..."]]):
    """Weights by their names, and what is done with them, by numpy."""

    def pointwise(self, layer: str, features: Features) -> Float32[np.ndarray, "channels_out h w"]:
        """Convolution with a kernel of one pixel."""
        kernel, bias = self[f"{layer}.weight"], self[f"{layer}.bias"]  # (out, in, 1, 1), (out)
        _, h, w = features.shape
        flat = kernel[..., 0, 0] @ features.reshape(-1, h * w)
        flat += bias[:, None]
        return flat.reshape(-1, h, w)

    def rectified(
        self, layer: str, *parts: Float32[np.ndarray, "_ h w"]
    ) -> Float32[np.ndarray, "channels_out h w"]:
        """Zero-padded 3 x 3 convolution of the parts' channels, rectified.

        One matrix product per row of the kernel. The frame, shifted left and right by a pixel, is
        stacked three high; a shift by a row is then a shift along memory. A strip at a time, so
        that all that is done to it happens in the cache.
        """
        kernel, bias = self[f"{layer}.weight"], self[f"{layer}.bias"]  # (out, in, 3, 3), (out)
        wide_out, wide_in, _, _ = kernel.shape
        _, h, w = parts[0].shape
        taps = kernel.transpose(2, 0, 3, 1).reshape(3, wide_out, 3 * wide_in)
        total = np.empty((wide_out, h, w), np.float32)
        stack = np.empty((3, wide_in, STRIP_ROWS + 2, w), np.float32)
        stack[0, :, :, 0] = stack[2, :, :, -1] = stack[:, :, 0] = 0
        line = stack.reshape(3 * wide_in, (STRIP_ROWS + 2) * w)
        for top in range(0, h, STRIP_ROWS):
            count = min(STRIP_ROWS, h - top)
            first, last = max(top - 1, 0), min(top + count + 1, h)
            rows = slice(first - top + 1, last - top + 1)
            stack[:, :, rows.stop :] = 0
            channel = 0
            for part in parts:
                places = slice(channel, channel := channel + len(part))
                seen = part[:, first:last]
                stack[0, places, rows, 1:] = seen[..., :-1]
                stack[1, places, rows] = seen
                stack[2, places, rows, :-1] = seen[..., 1:]
            strip = taps[0] @ line[:, : count * w]
            strip += bias[:, None]
            for row in (1, 2):
                strip += taps[row] @ line[:, row * w : (row + count) * w]
            np.maximum(strip.reshape(wide_out, count, w), 0, out=total[:, top : top + count])
        return total


def layer_shapes(
    channels: Sequence[int],
    inputs: int = INPUTS,
    outputs: int = OUTPUTS,
    fine: Sequence[int] = (),
    doubt: int = 0,
) -> dict[str, tuple[int, int, int]]:
    """Name → (channels out, channels in, kernel side) of every convolution.

    Args:
        channels: feature maps on each level.
        inputs: maps in.
        outputs: maps out.
        fine: feature maps of the layers at full resolution behind the U-Net, if there are any; the
            first of them sees its maps and what went in.
        doubt: feature maps behind a correction of the last map out, if there is any. They see the
            second level as the network has it on its way down, halved, and on its way up.
    """
    shapes: dict[str, tuple[int, int, int]] = {}
    for level, (above, here) in enumerate(pairwise((4 * inputs, *channels))):
        shapes[f"down{level}a"] = (here, above, 3)
        shapes[f"down{level}b"] = (here, here, 3)
    for level, (here, below) in enumerate(pairwise(channels)):
        shapes[f"lift{level}"] = (here, below, 1)
        shapes[f"up{level}a"] = (here, 2 * here, 3)
        shapes[f"up{level}b"] = (here, here, 3)
    shapes["out"] = (4 * (fine[0] if fine else outputs), channels[0], 1)
    for layer, (above, here) in enumerate(pairwise((inputs + fine[0], *fine) if fine else ())):
        shapes[f"fine{layer}"] = (here, above, 3)
    if fine:
        shapes["last"] = (outputs, fine[-1], 1)
    if doubt:
        shapes["doubt0"] = (doubt, channels[0] + channels[1], 3)
        shapes["doubt1"] = (1, doubt, 1)
    return shapes


def channels_of(weights: Weights) -> tuple[int, ...]:
    """Feature maps on each level of the network of these weights."""
    count = sum(name.startswith("down") and name.endswith("a.bias") for name in weights)
    return tuple(int(np.size(weights.get(f"down{level}a.bias", ()))) for level in range(count))


def doubt_of(weights: Weights) -> int:
    """Feature maps of the doubt's own in the network of these weights; 0 where it has none."""
    return int(np.size(weights.get("doubt0.bias", ())))


def stride(weights: Weights) -> int:
    """Frame sides must be multiples of this."""
    return int(2 ** len(channels_of(weights)))


def padded(weights: Weights, maps: Features) -> Float32[np.ndarray, "maps _ _"]:
    """Maps with flat gel below them and to their right, up to multiples of ``stride(weights)``."""
    rows, columns = (-side % stride(weights) for side in maps.shape[1:])
    return np.pad(maps, ((0, 0), (0, rows), (0, columns)))


def network_input(
    measured: Float32[np.ndarray, "h w 2"], support: Support, *, both: bool
) -> Float32[np.ndarray, "3 h w"]:
    """Both gradients, and the depth that fits what was measured and is pressed in only.

    The depth carries a slope as far as it reaches; convolutions alone would need many levels for
    large contacts. Where the x gradient was not measured, the depth's stands in for it.

    Args:
        measured: gradient field in px/px of square pixels.
        support: where the gel may have moved.
        both: whether the x gradient was measured too; else it is not looked at.
    """
    seen = measured * support[..., None]
    depth_px = pressed_depth(seen, support, both=both, coarseness=COARSENESS)
    along_x = seen[..., 0]
    if not both and depth_px.shape[1] > 1:
        along_x = np.gradient(depth_px, axis=1) * support
    return np.stack([along_x, seen[..., 1], depth_px / DEPTH_UNIT_PX])


def forward(weights: Weights, maps: Features) -> Float32[np.ndarray, "3 h w"]:
    """The network's maps from ``network_input``; sides are multiples of ``stride(weights)``.

    The gradients that come out are those that went in, corrected.
    """
    found = through_layers(weights, maps)
    found[:2] += maps[:2]
    return found


def through_layers(weights: Weights, maps: Features) -> Float32[np.ndarray, "outputs h w"]:
    """What the layers make of any maps; sides are multiples of ``stride(weights)``."""
    layers = weights if isinstance(weights, Layers) else Layers(weights)
    last = len(channels_of(weights)) - 1
    features = _fold(maps)  # (12, h / 2, w / 2)
    skips: list[Features] = []
    coarse: list[Features] = []  # both (c, h / 4, w / 4)
    for level in range(last + 1):
        if level > 0:
            features = _halve(features)
        if level == 1:
            coarse.append(features)
        features = layers.rectified(f"down{level}a", features)
        features = layers.rectified(f"down{level}b", features)  # (c, h / 2^(l+1), ...)
        skips.append(features)
    for level in reversed(range(last)):
        if level == 0:
            coarse.append(features)
        lifted = _double(layers.pointwise(f"lift{level}", features))
        features = layers.rectified(f"up{level}a", skips[level], lifted)
        features = layers.rectified(f"up{level}b", features)
    found = layers.pointwise("out", features)
    if doubt_of(weights):
        seen = layers.rectified("doubt0", *coarse)
        found[-4:] += _double(layers.pointwise("doubt1", seen))
    found = _unfold(found)
    if "last.weight" not in weights:
        return found
    features = layers.rectified("fine0", maps, np.maximum(found, 0, out=found))
    layer = 1
    while f"fine{layer}.weight" in weights:
        features = layers.rectified(f"fine{layer}", features)
        layer += 1
    return layers.pointwise("last", features)


def _fold(maps: Features) -> Float32[np.ndarray, "channels*4 h//2 w//2"]:
    channels, h, w = maps.shape
    blocks = maps.reshape(channels, h // 2, 2, w // 2, 2).transpose(0, 2, 4, 1, 3)
    return blocks.reshape(4 * channels, h // 2, w // 2)


def _unfold(maps: Features) -> Float32[np.ndarray, "channels//4 h*2 w*2"]:
    channels, h, w = maps.shape
    blocks = maps.reshape(channels // 4, 2, 2, h, w)
    found = np.empty((channels // 4, h, 2, w, 2), np.float32)
    for row, column in np.ndindex(2, 2):  # four plain copies are quicker than one of all axes
        found[:, :, row, :, column] = blocks[:, row, column]
    return found.reshape(channels // 4, 2 * h, 2 * w)


def _halve(features: Features) -> Float32[np.ndarray, "channels h//2 w//2"]:
    pairs = features[:, ::2] + features[:, 1::2]
    return (pairs[..., ::2] + pairs[..., 1::2]) / 4


def _double(features: Features) -> Float32[np.ndarray, "channels 2*h 2*w"]:
    return features.repeat(2, axis=2).repeat(2, axis=1)
