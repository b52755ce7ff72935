# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Where gel is held, by a network that knows how the standard design is lit.

Slopes say less than the colours that they were read from: an estimator that serves every sensor
reads ridges of some pixels too gentle or too steep. This network sees the colours as well. It
learnt from random objects pressed into the twin of the standard
(``recon.training.contact_in_light``), and is asked of sensors alone whose balls have the colours
that they would have there (``Default.unlike``).
"""

import math
from collections.abc import Callable
from typing import Final

import numpy as np
from jaxtyping import Bool, Float32

from recon import unet
from recon.arrays import ContactMask, DepthMap, GradientField
from recon.contact.network import network_input, resized
from recon.pixels import positions
from recon.unet.weights import Purpose, shipped_weights
from recon.windows import window_about
from sensor.toml import Pair

CONTACT_IN_LIGHT = Purpose(
    name="contact_standard",
    version="1",
    inputs=9,
    outputs=1,
    training="recon.training.contact_in_light",
    fine=(16, 16),
)
PAD_MM: Final = (34.0, 25.5)
"""Of the standard, along x and y: a place has its light only where the frame spans the same pad."""
PAD_TOLERANCE: Final = 0.02
MOST_UNLIKE: Final = 0.1
"""Of the balls' squared change of colour. The twin's standard has 0.03, its finger 0.19, the three
real sensors at hand 1.1 to 3.3."""
PITCH_MM: Final = PAD_MM[0] / 320
"""Of the pixels that it learnt from; other frames are looked at in such."""
MARGIN_PX: Final = 24
"""Looked at beside the gel that may be held."""
DARK: Final = 0.05
"""Of full scale, added to the blank gel's colour where changes are divided by it."""
CHANGE_UNIT: Final = 0.5


def is_known(unlike: float | None, size_px: tuple[int, int], mm_per_px: Pair) -> bool:
    """Whether a sensor is lit as the standard is, and its frames show as much of the pad.

    Args:
        unlike: as ``Default.unlike``.
        size_px: (width, height) of its frames.
        mm_per_px: pixel pitch along x and y.
    """
    if unlike is None or unlike > MOST_UNLIKE:
        return False
    sides_mm = np.multiply(size_px, mm_per_px)
    return bool(np.all(np.abs(sides_mm / PAD_MM - 1) < PAD_TOLERANCE))


def light_input(
    difference: Float32[np.ndarray, "h w 3"],
    blank: Float32[np.ndarray, "h w 3"],
    position: Float32[np.ndarray, "h w 2"],
    depth_px: Float32[np.ndarray, "h w"],
    gradient: Float32[np.ndarray, "h w 2"],
) -> Float32[np.ndarray, "9 h w"]:
    """What the network for all sensors sees, the colours' changes by share, and the place.

    Args:
        difference: to the blank gel, in shares of full scale.
        blank: colours of the blank gel.
        position: -1 to 1 from edge to edge of the pad, along x and y.
        depth_px: of the skin, in pixels.
        gradient: mm/mm.
    """
    change = difference / (blank + np.float32(DARK)) / np.float32(CHANGE_UNIT)
    seen = [network_input(depth_px, gradient), np.moveaxis(change, -1, 0)]
    return np.concatenate([*seen, np.moveaxis(position, -1, 0)])


def held_in_light(
    difference: Float32[np.ndarray, "h w 3"],
    blank_at: Callable[[Float32[np.ndarray, "n 2"]], Float32[np.ndarray, "n 3"]],
    depth_mm: DepthMap,
    gradient: GradientField,
    mm_per_px: Pair,
    near: Bool[np.ndarray, "h w"],
) -> ContactMask:
    """Where an object holds the gel of a sensor whose light ``is_known``.

    Args:
        difference: to the blank gel, in shares of full scale.
        blank_at: colours of the blank gel at some positions (-1 to 1).
        depth_mm: of the skin.
        gradient: mm/mm.
        mm_per_px: pixel pitch along x and y.
        near: what is asked for; elsewhere the answer is no.
    """
    found = np.zeros(near.shape, bool)
    if not near.any():
        return found
    weights = shipped_weights(CONTACT_IN_LIGHT)
    share = (mm_per_px[0] * mm_per_px[1]) ** 0.5 / PITCH_MM
    step = unet.stride(weights) / share
    about = window_about(near, math.ceil(MARGIN_PX / share))
    window = tuple(
        _whole(part, step, length) for part, length in zip(about, near.shape, strict=True)
    )
    height, width = (part.stop - part.start for part in window)
    rows, columns = (max(1, round(length * share)) for length in (height, width))
    change, position, depth_px, slopes = (
        resized(np.asarray(maps[window], np.float32), rows, columns)
        for maps in (difference, positions(near.shape[::-1]), depth_mm / PITCH_MM, gradient)
    )
    blank = blank_at(position.reshape(-1, 2)).reshape(rows, columns, 3)
    maps = unet.padded(weights, light_input(change, blank, position, depth_px, slopes))
    score = unet.through_layers(weights, maps)[0, :rows, :columns]
    found[window] = (resized(score, height, width) > 0) & near[window]
    return found


def _whole(part: slice, step: float, length: int) -> slice:
    """The part, widened to whole pixels of the coarsest level: then its extent does not matter.

    Args:
        part: of the frame's rows or columns.
        step: pixels of the frame for one of that level.
        length: of the frame.
    """
    first, last = part.start // step, -(-part.stop // step)
    return slice(int(first * step), min(length, round(last * step)))
