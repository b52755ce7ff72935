# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""The median of many numbers, in a fraction of ``numpy.median``'s time.

A sample brackets it (Floyd and Rivest, Comm. ACM 18(3), 1975), so that only what lies within the
bracket is put in order.
"""

import numpy as np
from jaxtyping import Float32

SAMPLE = 4000
FEW = 2 * SAMPLE
"""Fewer than these are put in order as they are."""
BRACKET = 0.03
"""Of the sample, either side of its middle: four standard deviations of where the median lies."""


def median(values: np.ndarray) -> float:
    """Of all numbers, none of them NaN, as ``numpy.median``; of none at all it is 0."""
    every = values.ravel()
    if every.size < FEW:
        return _middle(every, every.size // 2, every.size) if every.size else 0.0
    sample = np.sort(every[:: every.size // SAMPLE])
    low, high = (sample[int(sample.size * (0.5 + side))] for side in (-BRACKET, BRACKET))
    rank = every.size // 2 - int(np.count_nonzero(every < low))
    if low == high and 0 < rank < np.count_nonzero(every == low):
        return float(low)
    within = every[(every >= low) & (every <= high)]
    if not 0 < rank < within.size:
        within, rank = every, every.size // 2
    return _middle(within, rank, every.size)


def _middle(some: np.ndarray, rank: int, count: int) -> float:
    """The number of that rank; of an even count, its mean with the one before."""
    parted = np.partition(some, rank)
    upper = float(parted[rank])
    return upper if count % 2 == 1 else (upper + float(parted[:rank].max())) / 2


def channel_medians(image: Float32[np.ndarray, "h w 3"]) -> Float32[np.ndarray, "3"]:
    """Of each colour of an image."""
    return np.array([median(plane) for plane in np.moveaxis(image, -1, 0)], np.float32)
