# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Which slopes some colours show, as labelled pixels have it.

Lights on one line leave the slope across that line unseen (``recon.lights`` tells it from where
they sit). What is fitted to that slope nonetheless is what the labels happen to have in common.
"""

import numpy as np

from recon.pixels import Pixels

LEAST = 0.25
"""Of the change of colour with the slope that is shown best: what changes it less is not shown."""
ALIGNED = np.cos(np.radians(30.0))
"""A direction this close to an axis counts as that axis."""


def shown_axes(pixels: Pixels, columns: list[int]) -> list[int]:
    """The axes, of 0 for x and 1 for y, whose slopes change the colours; both where it is unclear.

    Args:
        pixels: labelled.
        columns: of the colours that are looked at.
    """
    color = pixels.color[:, columns].astype(np.float64)
    level = np.concatenate([np.ones((len(pixels), 1)), pixels.gradient], 1)
    change = np.linalg.lstsq(level, color / np.maximum(color.std(0), 1e-6), rcond=None)[0][1:]
    directions, strengths, _ = np.linalg.svd(change)
    strongest, other = np.pad(strengths, (0, 2))[:2]
    hidden = np.abs(directions[:, 1])
    if other >= LEAST * strongest or hidden.max() < ALIGNED:
        return [0, 1]
    return [int(hidden.argmin())]
