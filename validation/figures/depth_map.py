# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""A depth map in mm with its scale bar."""

import numpy as np
from matplotlib.figure import Figure

from recon.arrays import ContactMask, DepthMap
from sensor.toml import Pair
from validation.figures import maps
from validation.figures.style import fitted, styled

LONGER_SIDE_IN = 4.0
SHORTER_SIDE_IN = 1.4
"""At least, so that the colour bar of a thin strip can be read."""
FLATTEST_MM = 0.01
"""The colour bar never spans less, so that the noise of untouched gel stays dark."""
MARGIN_IN = 0.08


@styled
def depth_figure(
    depth_mm: DepthMap,
    mm_per_px: Pair,
    *,
    title: str = "",
    contact: ContactMask | None = None,
) -> Figure:
    """Depth as colour, dark at zero and below, with scale bar and colour bar.

    Args:
        depth_mm: (h, w).
        mm_per_px: pixel pitch along x and y.
        title: above the map.
        contact: outlined where given.
    """
    size_mm = maps.size_mm(depth_mm, mm_per_px)
    scale = LONGER_SIDE_IN / max(size_mm)
    width, height = (max(SHORTER_SIDE_IN, scale * side) for side in size_mm)
    top = MARGIN_IN + (maps.TITLE_IN if title else 0)
    figure = maps.blank(
        width + MARGIN_IN + maps.BAR_GAP_IN + maps.BAR_WIDTH_IN + maps.BAR_LABELS_IN,
        top + height + MARGIN_IN,
    )
    deepest_mm = float(np.nanmax(depth_mm, initial=0.0))
    image = maps.show_map(
        figure,
        maps.Box(left=MARGIN_IN, top=top, width=width, height=height),
        depth_mm,
        mm_per_px,
        fitted(title, width + maps.BAR_LABELS_IN),
        limits=(0.0, max(deepest_mm, FLATTEST_MM)),
    )
    if contact is not None:
        maps.outline(image, contact, mm_per_px)
    maps.scale_bar(image)
    maps.color_bar(figure, image, "depth [mm]")
    return figure
