# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Maps of one frame with a scale bar: depth in mm, and the uncertainty of an inferred slope."""

import numpy as np
from jaxtyping import Float32
from matplotlib.figure import Figure
from matplotlib.image import AxesImage

from recon.arrays import DepthMap
from sensor.toml import Pair
from validation.figures import maps
from validation.figures.style import fitted, styled

LONGER_SIDE_IN = 4.0
SHORTER_SIDE_IN = 1.4
"""At least, so that the colour bar of a thin strip can be read."""
FLATTEST_MM = 0.01
"""The colour bar never spans less, so that the noise of untouched gel stays dark."""
MARGIN_IN = 0.08
DOUBT_COLORS = "magma"
LEAST_DOUBT = 0.05
"""mm/mm; the colour bar of the uncertainty never spans less."""


@styled
def depth_figure(depth_mm: DepthMap, mm_per_px: Pair, *, title: str = "") -> Figure:
    """Depth as colour, dark at zero and below, with scale bar and colour bar.

    Args:
        depth_mm: (h, w).
        mm_per_px: pixel pitch along x and y.
        title: above the map.
    """
    deepest_mm = float(np.nanmax(depth_mm, initial=0.0))
    limits = (0.0, max(deepest_mm, FLATTEST_MM))
    figure, image = _map(depth_mm, mm_per_px, title, maps.DEPTH_COLORS, limits)
    maps.color_bar(figure, image, "depth [mm]")
    return figure


@styled
def doubt_figure(doubt: Float32[np.ndarray, "h w"], mm_per_px: Pair, *, title: str = "") -> Figure:
    """How far off an inferred slope is expected to be, bright where it is a guess.

    Args:
        doubt: (h, w), mm/mm.
        mm_per_px: pixel pitch along x and y.
        title: above the map.
    """
    limits = (0.0, max(float(doubt.max(initial=0.0)), LEAST_DOUBT))
    figure, image = _map(doubt, mm_per_px, title, DOUBT_COLORS, limits)
    maps.color_bar(figure, image, "uncertainty [mm/mm]")
    return figure


def _map(
    values: np.ndarray, mm_per_px: Pair, title: str, colors: str, limits: Pair
) -> tuple[Figure, AxesImage]:
    size_mm = maps.size_mm(values, mm_per_px)
    scale = LONGER_SIDE_IN / max(size_mm)
    width, height = (max(SHORTER_SIDE_IN, scale * side) for side in size_mm)
    top = MARGIN_IN + (maps.TITLE_IN if title else 0)
    figure = maps.blank(
        width + MARGIN_IN + maps.BAR_GAP_IN + maps.BAR_WIDTH_IN + maps.BAR_LABELS_IN,
        top + height + MARGIN_IN,
    )
    image = maps.show_map(
        figure,
        maps.Box(left=MARGIN_IN, top=top, width=width, height=height),
        values,
        mm_per_px,
        fitted(title, width + maps.BAR_LABELS_IN),
        colors=colors,
        limits=limits,
    )
    maps.scale_bar(image)
    return figure, image
