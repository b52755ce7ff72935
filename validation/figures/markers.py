# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Dots and how they moved, drawn over the frame."""

import numpy as np
from matplotlib.figure import Figure
from matplotlib.patheffects import AbstractPathEffect, withStroke

from recon.arrays import Unwarped
from recon.markers.tracking import Tracked
from sensor.toml import Pair
from validation.figures import maps
from validation.figures.style import ORANGE, fitted, styled

LONGER_SIDE_IN = 5.6
MARGIN_IN = 0.08
EXAGGERATED = 3.0


@styled
def displacement_figure(
    image: Unwarped, tracked: Tracked, mm_per_px: Pair, *, title: str = ""
) -> Figure:
    """Arrows from where each dot rests, three times as long as it moved; a ring where it is lost.

    Args:
        image: the unwarped frame.
        tracked: its dots.
        mm_per_px: of both.
        title: above the picture.
    """
    size = maps.size_mm(image, mm_per_px)
    scale = LONGER_SIDE_IN / max(size)
    width, height = scale * size[0], scale * size[1]
    top = MARGIN_IN + (maps.TITLE_IN if title else 0)
    figure = maps.blank(width + 2 * MARGIN_IN, top + height + MARGIN_IN)
    box = maps.Box(left=MARGIN_IN, top=top, width=width, height=height)
    shown = maps.show_map(figure, box, np.clip(image, 0, 1), mm_per_px, fitted(title, width))
    axes = shown.axes
    assert axes is not None
    rest = (tracked.markers.position_px + 0.5) * mm_per_px
    moved = tracked.displacement_mm(mm_per_px)
    halo: list[AbstractPathEffect] = [withStroke(linewidth=2.0, foreground="#000000b0")]
    seen = tracked.seen
    arrows = axes.quiver(
        *rest[seen].T,
        *(EXAGGERATED * moved[seen]).T,
        angles="xy",
        scale_units="xy",
        scale=1,
        width=0.003,
        headwidth=3.5,
        minlength=0.5,
        color="white",
    )
    arrows.set_path_effects(halo)
    lost = (rest + moved)[~seen]
    axes.plot(*lost.T, "o", mfc="none", mec=ORANGE, ms=9, mew=1.8, ls="none")
    axes.set_xlim(0, size[0])
    axes.set_ylim(size[1], 0)
    maps.scale_bar(shown)
    return figure
