# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Frames whose light is brighter or darker than the blank frame's, brought back to its light.

LEDs fade as they warm up, and an exposure may change. Each colour is then multiplied by one number,
which would be read as slopes all over. A touch changes colours here and there, and both ways; so
the number is told from twelve cells of the frame, most of which must agree on it. Cameras encode
light by a power of it, in which brighter light is a factor, too.
"""

from functools import lru_cache

import numpy as np
from jaxtyping import Float32

from recon.arrays import Difference, Unwarped

CELLS, SAMPLES = (3, 4), 8
"""Down and across the frame; pixels looked at along each side of a cell."""
DARK, BRIGHT = 0.08, 0.97
"""Of full scale: a blank gel darker or brighter than that tells no factor."""
LARGEST_CHANGE = 0.5
"""A larger one is another exposure or another sensor, for others to doubt."""
MOST = 0.75
"""Share of the cells that must agree on the factor..."""
ALIKE, SURE, SMALL = 0.4, 0.65, 0.0125
"""...to within ``ALIKE`` of the change, or ``SURE`` of it less ``SMALL`` if that is less: changes
below 5 % must be clearer, and those below 2 % are never taken off."""
CLEARLY, NOISE = 2.0, 0.05
"""Where cells agree so many times better on a number of grey levels than on a factor, light was
added: a black level, or the room's. ``NOISE`` is added to both scatters, so that two that are
nearly nothing are not compared."""

Planes = Float32[np.ndarray, "3 h w"]
Samples = Float32[np.ndarray, "3 cells pixels"]


def in_same_light(difference: Difference, blank: Unwarped) -> Difference:
    """A difference image as the blank frame's light would have given it.

    Args:
        difference: unwarped frame minus unwarped blank frame.
        blank: that one.
    """
    return divided(difference, blank, light_of(difference, blank))


def divided(difference: Difference, blank: Unwarped, light: Float32[np.ndarray, "3"]) -> Difference:
    """A difference image of a frame that is so many times as bright as the blank one."""
    if (light == 1).all():
        return difference
    return np.asarray((difference + blank) / light - blank)


def light_of(difference: Difference, blank: Unwarped) -> Float32[np.ndarray, "3"]:
    """``brightness`` of images whose last axis is the colour.

    Of another blank frame minus a unit's own, it is what all frames that are compared with the
    other one are divided by: the unit's slopes are read from the light of its calibration.
    """
    return brightness(np.moveaxis(difference, -1, 0), np.moveaxis(blank, -1, 0))


def brightness(difference: Planes, blank: Planes) -> Float32[np.ndarray, "3"]:
    """How many times as bright as on the blank frame each colour is; ones unless all of it is."""
    return brightness_of(sampled(difference), telling(blank))


def telling(blank: Planes) -> Samples:
    """What is sampled of a blank frame; NaN where it is too dark or too bright to tell a factor."""
    samples = sampled(blank)
    samples[(samples < DARK) | (samples > BRIGHT)] = np.nan
    return samples


def brightness_of(change: Samples, before: Samples) -> Float32[np.ndarray, "3"]:
    """``brightness`` of what is sampled of a difference image, by what the blank frame tells.

    Only colours whose own cells agree are told. Where one has changed by more than
    ``LARGEST_CHANGE``, none is.
    """
    shares = cell_medians(change / before)
    known = np.isfinite(shares)
    if (2 * (np.abs(shares) > SMALL / SURE).sum(1) < known.sum(1)).all():
        return np.ones(3, np.float32)  # most cells have not changed enough to tell: nearly always
    factors, told = np.ones(3, np.float32), np.zeros(3, bool)
    for color in np.flatnonzero(known.mean(1) >= MOST):
        cells = shares[color, known[color]]
        middle = float(np.median(cells))
        within = min(ALIKE * abs(middle), SURE * abs(middle) - SMALL)
        told[color] = (np.abs(cells - middle) < within).mean() >= MOST
        factors[color] = 1 + middle
    off = np.abs(factors - 1)
    if not told.any() or (off > LARGEST_CHANGE).any():
        return np.ones(3, np.float32)
    levels = cell_medians(change)
    for color in np.flatnonzero(told):
        of_share = scatter(shares[color, known[color]])
        if CLEARLY * scatter(levels[color, known[color]]) < of_share:
            return np.ones(3, np.float32)
    return np.where(told, factors, np.float32(1))


def sampled(image: Planes) -> Samples:
    """Some pixels of each cell."""
    rows, columns = _looked_at(*image.shape[1:])
    return image[:, rows, columns].reshape(3, CELLS[0] * CELLS[1], SAMPLES**2)


@lru_cache(maxsize=8)
def _looked_at(height: int, width: int) -> tuple[np.ndarray, np.ndarray]:
    """Rows and columns of the pixels of each cell, (down, across, SAMPLES, SAMPLES)."""
    rows, columns = (
        ((np.arange(cells * SAMPLES) + 0.5) * length / (cells * SAMPLES)).astype(int)
        for cells, length in zip(CELLS, (height, width), strict=True)
    )
    return (
        np.broadcast_to(rows.reshape(-1, 1, SAMPLES, 1), (*CELLS, SAMPLES, SAMPLES)),
        np.broadcast_to(columns.reshape(1, -1, 1, SAMPLES), (*CELLS, SAMPLES, SAMPLES)),
    )


def cell_medians(values: Samples) -> Float32[np.ndarray, "3 cells"]:
    """Of each cell; NaN where more than half of it is."""
    ordered = np.sort(values, axis=-1)  # NaN come last
    known = np.isfinite(ordered).sum(-1)
    first = np.arange(0, ordered.size, SAMPLES**2).reshape(known.shape)
    middle = ordered.take(first + np.minimum(known // 2, SAMPLES**2 - 1))
    return np.where(2 * known >= SAMPLES**2, middle, np.float32(np.nan))


def scatter(values: Float32[np.ndarray, " n"]) -> float:
    """How far values are from their median on the whole, in shares of it; never nothing."""
    middle = float(np.median(values))
    return NOISE + float(np.median(np.abs(values - middle))) / max(abs(middle), 1e-6)
