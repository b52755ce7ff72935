# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Touches in rows, lights in columns: true depth, what each way finds, and the uncertainty."""

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure

from recon.arrays import DepthMap
from validation.few_lights import WAYS, Touch
from validation.figures import maps
from validation.figures.style import FULL_IN, INK, styled
from validation.shapes import name_in_words

TITLES = {
    "two lights, zero": "R+B, Gx zero",
    "two lights, network": "R+B, network",
    "one light, network": "R, network",
    "three lights": "three lights",
}
DOUBT_COLORS = "magma_r"
MOST_DOUBT = 0.5
"""mm/mm; the colour bar's end."""
AROUND = 1.25
"""The window, relative to the pressed part."""
MARGIN, GAP, ROW_GAP = 0.08, 0.08, 0.14
NAME_IN, TITLES_IN = 0.24, 0.26
"""For a touch's name, left of its row, and for the ways above the first."""
ROOM = 0.74
"""For the numbers beside a colour bar, in inches."""


@styled
def few_lights_figure(touches: Sequence[Touch]) -> Figure:
    """One named row a touch, cropped to what is pressed; orange is depth below zero."""
    columns = len(WAYS) + 2
    bars = 2 * (maps.BAR_GAP_IN + maps.BAR_WIDTH_IN + ROOM)
    side = (FULL_IN - 2 * MARGIN - NAME_IN - (columns - 2) * GAP - bars) / columns
    figure = maps.blank(FULL_IN, TITLES_IN + len(touches) * (side + ROW_GAP))
    for index, touch in enumerate(touches):
        _row(figure, touch, TITLES_IN + index * (side + ROW_GAP), side, index == 0)
    return figure


def _row(figure: Figure, touch: Touch, top: float, side: float, titled: bool) -> None:
    window, pitch = _window(touch.truth_mm), touch.mm_per_px
    deepest = max(float(depth.max()) for depth in (touch.truth_mm, *touch.depth_mm.values()))
    left = MARGIN + NAME_IN
    shown = [("truth", touch.truth_mm)]
    shown += [(TITLES[way], touch.depth_mm[way]) for way, _, _ in WAYS]
    for place, (title, depth) in enumerate(shown):
        box = maps.Box(left=left, top=top, width=side, height=side)
        image = maps.show_map(
            figure,
            box,
            depth[window],
            pitch,
            title if titled else "",
            colors=maps.SIGNED_COLORS,
            limits=(-deepest, deepest),
        )
        if place == 0:
            image.axes.set_ylabel(name_in_words(touch.name))
            maps.scale_bar(image, color=INK, halo_color="white")
        left += side + GAP
    maps.color_bar(figure, image, "[mm]")
    left += maps.BAR_GAP_IN + maps.BAR_WIDTH_IN + ROOM - GAP
    image = maps.show_map(
        figure,
        maps.Box(left=left, top=top, width=side, height=side),
        touch.doubt[window],
        pitch,
        "R+B, uncertainty" if titled else "",
        colors=DOUBT_COLORS,
        limits=(0.0, MOST_DOUBT),
    )
    maps.color_bar(figure, image, "[mm/mm]")


def _window(truth_mm: DepthMap) -> tuple[slice, slice]:
    """Rows and columns of a square around the pressed part, inside the frame."""
    rows, columns = np.nonzero(truth_mm > 0.05 * truth_mm.max())
    wanted = AROUND * max(np.ptp(rows), np.ptp(columns)) / 2 + 3
    half = int(min(wanted, *(count / 2 for count in truth_mm.shape)))
    spans = []
    for places, count in zip((rows, columns), truth_mm.shape, strict=True):
        low = int(np.clip((places.min() + places.max()) / 2 - half, 0, count - 2 * half))
        spans.append(slice(low, low + 2 * half))
    return spans[0], spans[1]
