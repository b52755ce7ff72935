# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Frames whose light is brighter or darker than the blank frame's, brought back to its light.

LEDs fade as they warm up, and an exposure may change. Each colour is then multiplied by one number,
which would be read as slopes all over. A touch changes colours here and there, and both ways; so
the number is told from twelve cells of the frame, most of which must agree on it. Cameras encode
light by a power of it, in which brighter light is a factor, too.
"""

import numpy as np
from jaxtyping import Float32

from recon.arrays import Difference, Unwarped

CELLS, SAMPLES = (3, 4), 8
"""Down and across the frame; pixels looked at along each side of a cell."""
DARK, BRIGHT = 0.08, 0.97
"""Of full scale: a blank gel darker or brighter than that tells no factor."""
LEAST_CHANGE = 0.05
"""From which on a factor counts: presses and grips light the rest of a gel, too. Of 518 frames of
fifteen sets and clips none tells such a change."""
LARGEST_CHANGE = 0.5
"""A larger one is another exposure or another sensor, for others to doubt."""
MOST = 0.75
"""So many of the cells must agree..."""
ALIKE = 0.4
"""...within this share of the change."""
CLEARLY, NOISE = 2.0, 0.05
"""Where cells' levels agree so many times better than their shares, light was added: a black level
or the room's. That is no factor. The noise keeps two that agree from being compared."""

Planes = Float32[np.ndarray, "3 h w"]


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
    """How many times as bright as on the blank frame each colour is; ones unless all of it is.

    Where one colour tells a change of light, all of them are told; so a change that some of them
    hardly reach does not tint the frame.
    """
    before, change = sampled(blank).copy(), sampled(difference)
    before[(before < DARK) | (before > BRIGHT)] = np.nan
    shares = cell_medians(change / before)
    known = np.isfinite(shares)
    factors = np.ones(3, np.float32)
    for color in np.flatnonzero(known.mean(1) >= MOST):
        factors[color] += np.median(shares[color, known[color]])
    off = np.abs(factors - 1)
    if not (told := (off > LEAST_CHANGE) & (off < LARGEST_CHANGE)).any():
        return np.ones(3, np.float32)
    levels, multiplied = cell_medians(change), False
    for color in np.flatnonzero(told):
        of_share = scatter(shares[color, known[color]])
        if CLEARLY * scatter(levels[color, known[color]]) < of_share:
            return np.ones(3, np.float32)
        alike = np.abs(shares[color, known[color]] + 1 - factors[color]) < ALIKE * off[color]
        multiplied |= bool(alike.mean() >= MOST)
    return factors if multiplied else np.ones(3, np.float32)


def sampled(image: Planes) -> Float32[np.ndarray, "3 cells pixels"]:
    """Some pixels of each cell."""
    down, across = CELLS
    rows, columns = (
        ((np.arange(cells * SAMPLES) + 0.5) * length / (cells * SAMPLES)).astype(int)
        for cells, length in zip(CELLS, image.shape[1:], strict=True)
    )
    some = image[:, rows[:, None], columns].reshape(3, down, SAMPLES, across, SAMPLES)
    return some.swapaxes(2, 3).reshape(3, down * across, SAMPLES**2)


def cell_medians(values: Float32[np.ndarray, "3 cells pixels"]) -> Float32[np.ndarray, "3 cells"]:
    """Of each cell; NaN where more than half of it is."""
    ordered = np.sort(values, axis=-1)  # NaN come last
    known = np.isfinite(ordered).sum(-1)
    middle = np.take_along_axis(ordered, np.minimum(known // 2, SAMPLES**2 - 1)[..., None], -1)
    return np.where(2 * known >= SAMPLES**2, middle[..., 0], np.float32(np.nan))


def scatter(values: Float32[np.ndarray, " n"]) -> float:
    """How far values are from their median on the whole, in shares of it; never nothing."""
    middle = float(np.median(values))
    return NOISE + float(np.median(np.abs(values - middle))) / max(abs(middle), 1e-6)
