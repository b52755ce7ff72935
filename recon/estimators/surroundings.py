# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""What lies around a pixel: how colours change near it, and how they are on the whole.

One colour has more than one slope: a wall beside it shades skin, a hollow keeps light in. What lies
around tells these apart. It is looked at through averages over ``SIDE_PX`` pixels, and in shares of
the frame's shorter side, so that a frame of any size gives nearly the same: only distances are
rounded. No change of colour is looked at over lengths of a contact: it would tell how large the
balls are that teach.
"""

from collections.abc import Sequence

import cv2
import numpy as np
from jaxtyping import Float32

from recon.arrays import Difference
from recon.quarters import SIDE_PX

SMOOTHING = 1 / 340
"""Of the frame's shorter side, as all below: standard deviation of the Gaussian that takes off
grain, less than a press' collar."""
NEAR, NEAR_SMOOTHING = 1 / 60, 1 / 80
"""How far the nine places are apart by which colours change near a pixel, and their Gaussian."""
WIDE = 1 / 12
"""Of the Gaussian that tells what is usual around."""
AVERAGE = np.array([[0, 1, 0], [1, 0, 1], [0, 1, 0]], np.float32) / 4
ALONG_X = np.array([[0, 0, 0], [-1, 0, 1], [0, 0, 0]], np.float32) / 2
MORE_ALONG_X = np.array([[0, -1, 0], [1, 0, 1], [0, -1, 0]], np.float32)
TWISTED = np.array([[1, 0, -1], [0, 0, 0], [-1, 0, 1]], np.float32) / 2
STEPS, BENDS = (ALONG_X, ALONG_X.T), (MORE_ALONG_X, TWISTED)
"""First and second differences between the nine places, rows downward."""
LEVELS = 2
"""Aspects that are colours, near and wide, less the pixel's own; the others are differences."""
ASPECTS = LEVELS + len(STEPS) + len(BENDS)
"""Of each colour."""
ORDERS = (2, 1.5) + (1,) * len(STEPS) + (2,) * len(BENDS)
"""Aspects fall by these powers of an object's size: steps are first differences, bends second ones,
and a level less a pixel's own is a second one as far as it is of nearby. A wide one is of less."""

Quarter = Float32[np.ndarray, "qh qw 3"]


def quartered(settled: Difference) -> Quarter:
    """Averages over ``SIDE_PX`` pixels along each axis."""
    height, width = settled.shape[:2]
    size = -(-width // SIDE_PX), -(-height // SIDE_PX)
    return cv2.resize(settled, size, interpolation=cv2.INTER_AREA)


def surroundings(quarter: Quarter) -> Float32[np.ndarray, "qh qw a"]:
    """All aspects of what lies around, R, G and B of each, at the resolution of ``quartered``.

    The levels are as they are: ``full_size`` takes the pixels' own colours off.
    """
    near = _blurred(quarter, NEAR_SMOOTHING)
    aspects = [
        *_differences(near, NEAR, (AVERAGE,), 0),
        _blurred(quarter, WIDE),
        *_differences(near, NEAR, STEPS, 1),
        *_differences(near, NEAR, BENDS, 2),
    ]
    return np.concatenate(aspects, -1)


def full_size(
    around: Float32[np.ndarray, "qh qw a"], settled: Difference
) -> Float32[np.ndarray, "h w a"]:
    """The surroundings of every pixel."""
    every = cv2.resize(around, settled.shape[1::-1])
    every[..., : 3 * LEVELS] -= np.tile(settled, LEVELS)
    return every


def of_other_sizes(
    around: Float32[np.ndarray, "n a"], sizes: Float32[np.ndarray, " n"]
) -> Float32[np.ndarray, "n a"]:
    """The surroundings of pixels as if what is pressed in were larger by some factors.

    Its slopes and their colours stay, what lies around a pixel is farther away.

    Args:
        around: of some colours, pixel by pixel.
        sizes: for each pixel, how many times as large.
    """
    orders = np.repeat(np.array(ORDERS, np.float32), around.shape[1] // ASPECTS)
    return around * sizes[:, None] ** -orders


def columns_around(lit: Sequence[int]) -> list[int]:
    """Where, behind R, G and B themselves, the surroundings of some of them are."""
    return [3 * (1 + aspect) + channel for aspect in range(ASPECTS) for channel in lit]


def _differences(
    seen: Quarter, apart: float, stencils: Sequence[np.ndarray], order: int
) -> list[Quarter]:
    """Differences of an order between nine places as far apart as that share of the frame."""
    side = apart * min(seen.shape[:2])
    step = max(1, round(side))
    found = []
    for stencil in stencils:
        spaced = np.zeros((2 * step + 1,) * 2, np.float32)
        spaced[::step, ::step] = stencil * (side / step) ** order
        found.append(cv2.filter2D(seen, -1, spaced, borderType=cv2.BORDER_REPLICATE))
    return found


def _blurred(quarter: Quarter, share: float) -> Quarter:
    """As a Gaussian of that share of the frame's shorter side would leave the frame."""
    side_px = SIDE_PX * min(quarter.shape[:2])
    left = (share**2 - SMOOTHING**2) * side_px**2 - (SIDE_PX**2 - 1) / 12  # variances add
    return cv2.GaussianBlur(quarter, (0, 0), np.sqrt(max(left, 0.01)) / SIDE_PX)
