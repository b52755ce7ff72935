# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Shapes in rows: what the camera sees, the difference, the depth found, the true depth, a cut."""

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure

from validation.figures import maps
from validation.figures.style import BLUE, FULL_IN, INK, ORANGE, styled
from validation.shapes import Shape, name_in_words

AROUND = 1.15
"""The window, relative to the pressed part."""
MARGIN, GAP, ROW_GAP, AXIS_IN = 0.08, 0.12, 0.3, 0.5


@styled
def shape_figure(shapes: Sequence[Shape]) -> Figure:
    """One row a shape, cropped to what is pressed."""
    side = (FULL_IN - 2 * MARGIN - 4 * GAP - maps.BAR_ROOM_IN - AXIS_IN) / 5
    height = len(shapes) * (side + ROW_GAP) + MARGIN + AXIS_IN
    figure = maps.blank(FULL_IN, height)
    for index, shape in enumerate(shapes):
        _row(figure, shape, MARGIN + ROW_GAP * 0.8 + index * (side + ROW_GAP), side, index)
    return figure


def _row(figure: Figure, shape: Shape, top: float, side: float, index: int) -> None:
    window, pitch = maps.window_around(shape.touched, AROUND), shape.mm_per_px
    deepest = float(shape.truth_mm.max())
    columns = (
        (shape.frame[window], name_in_words(shape.name), None),
        (maps.amplified(shape.difference[window]), maps.AMPLIFIED_TITLE, None),
        (shape.depth_mm[window], "depth", (0.0, deepest)),
        (shape.truth_mm[window], "true depth", (0.0, deepest)),
    )
    for place, (values, title, limits) in enumerate(columns):
        box = maps.Box(left=MARGIN + place * (side + GAP), top=top, width=side, height=side)
        shown = title if index == 0 or place == 0 else ""
        image = maps.show_map(figure, box, values, pitch, shown, limits=limits)
        if place == 0:
            maps.scale_bar(image)
    maps.color_bar(figure, image, "[mm]")
    left = MARGIN + 4 * (side + GAP) + maps.BAR_ROOM_IN + AXIS_IN - 0.1
    axes = maps.Box(left=left, top=top, width=side - 0.05, height=side).axes(figure)
    row = int(np.unravel_index(shape.truth_mm.argmax(), shape.truth_mm.shape)[0])
    found, truth = shape.depth_mm[row, window[1]], shape.truth_mm[row, window[1]]
    x_mm = (np.arange(len(found)) - len(found) / 2) * pitch[0]
    axes.fill_between(x_mm, truth, found, color=ORANGE, alpha=0.35, lw=0)
    axes.plot(x_mm, truth, color=INK, lw=1.2, ls=(0, (4, 2)))
    axes.plot(x_mm, found, color=BLUE, lw=1.2)
    axes.set_title("cut along x [mm]" if index == 0 else "")
