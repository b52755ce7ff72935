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

Planes = Float32[np.ndarray, "3 h w"]


def in_same_light(difference: Difference, blank: Unwarped) -> Difference:
    """A difference image as the blank frame's light would have given it.

    Args:
        difference: unwarped frame minus unwarped blank frame.
        blank: that one.
    """
    factors = brightness(np.moveaxis(difference, -1, 0), np.moveaxis(blank, -1, 0))
    if (factors == 1).all():
        return difference
    return np.asarray((difference + blank) / factors - blank)


def brightness(difference: Planes, blank: Planes) -> Float32[np.ndarray, "3"]:
    """How many times as bright as on the blank frame each colour is; ones unless all of it is.

    Where one colour tells a change of light, all of them are told; so a change that some of them
    hardly reach does not tint the frame.
    """
    medians = cell_medians(difference, blank)
    factors, told = np.ones(3, np.float32), False
    for color, cells in enumerate(medians):
        known = cells[np.isfinite(cells)]
        if len(known) < MOST * len(cells):
            continue
        change = float(np.median(known)) - 1
        agree = np.abs(known - 1 - change) < ALIKE * abs(change)
        told |= LEAST_CHANGE < abs(change) < LARGEST_CHANGE and agree.mean() >= MOST
        factors[color] = 1 + change
    return factors if told else np.ones(3, np.float32)


def cell_medians(difference: Planes, blank: Planes) -> Float32[np.ndarray, "3 cells"]:
    """The median factor of each cell; NaN where less than half of it can tell one."""
    rows, columns = (
        ((np.arange(cells * SAMPLES) + 0.5) * length / (cells * SAMPLES)).astype(int)
        for cells, length in zip(CELLS, blank.shape[1:], strict=True)
    )
    before = blank[:, rows[:, None], columns]
    factor = 1 + difference[:, rows[:, None], columns] / np.maximum(before, DARK)
    factor[(before < DARK) | (before > BRIGHT)] = np.nan
    down, across = CELLS
    cells = factor.reshape(3, down, SAMPLES, across, SAMPLES).swapaxes(2, 3)
    ordered = np.sort(cells.reshape(3, down * across, -1), axis=-1)  # NaN come last
    known = np.isfinite(ordered).sum(-1)
    middle = np.take_along_axis(ordered, (known // 2)[..., None] % SAMPLES**2, -1)[..., 0]
    return np.where(2 * known >= SAMPLES**2, middle, np.float32(np.nan))
