# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Windows about what a map holds."""

import numpy as np
from jaxtyping import Bool


def window_about(
    some: Bool[np.ndarray, "h w"], margin_px: int | tuple[int, int]
) -> tuple[slice, slice]:
    """Rows and columns from the first that hold some to the last, and a margin, within the map.

    Args:
        some: the map.
        margin_px: along x and y, where it is not the same.

    Raises:
        IndexError: there is none.
    """
    along_x, along_y = (margin_px, margin_px) if isinstance(margin_px, int) else margin_px
    rows, columns = np.asarray(some.any(1)), np.asarray(some.any(0))
    return _reach(rows, along_y), _reach(columns, along_x)


def _reach(some: Bool[np.ndarray, " n"], margin_px: int) -> slice:
    places = np.flatnonzero(some)
    first, last = int(places[0]) - margin_px, int(places[-1]) + margin_px + 1
    return slice(max(0, first), min(len(some), last))
