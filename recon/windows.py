# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Windows about what a map holds."""

import numpy as np
from jaxtyping import Bool


def window_about(some: Bool[np.ndarray, "h w"], margin_px: int) -> tuple[slice, slice]:
    """Rows and columns from the first that hold some to the last, and a margin, within the map.

    Raises:
        IndexError: there is none.
    """
    rows, columns = (_reach(np.asarray(some.any(axis)), margin_px) for axis in (1, 0))
    return rows, columns


def _reach(some: Bool[np.ndarray, " n"], margin_px: int) -> slice:
    places = np.flatnonzero(some)
    first, last = int(places[0]) - margin_px, int(places[-1]) + margin_px + 1
    return slice(max(0, first), min(len(some), last))
