# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Windows about what a map holds."""

import cv2
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
    left, top, width, height = cv2.boundingRect(some.view(np.uint8))
    if width == 0:
        raise IndexError("a window is about something, and the map holds nothing")
    rows, columns = some.shape
    return (
        slice(max(0, top - along_y), min(rows, top + height + along_y)),
        slice(max(0, left - along_x), min(columns, left + width + along_x)),
    )
