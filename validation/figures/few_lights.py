# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Touches in rows, lights in columns: true depth, what each way finds, and the uncertainty."""

from collections.abc import Sequence

from matplotlib.figure import Figure

from validation.few_lights import WAYS, Touch
from validation.figures import maps
from validation.figures.style import FULL_IN, INK, styled
from validation.shapes import TOUCHED, name_in_words

TITLES = {
    "two lights, zero": "RB, Gx zero",
    "two lights, network": "RB, network",
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
    touched = touch.truth_mm > TOUCHED * touch.truth_mm.max()
    window, pitch = maps.window_around(touched, AROUND), touch.mm_per_px
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
        "RB, uncertainty" if titled else "",
        colors=DOUBT_COLORS,
        limits=(0.0, MOST_DOUBT),
    )
    maps.color_bar(figure, image, "[mm/mm]")
