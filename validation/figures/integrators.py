# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""The integrators on surfaces whose depth is known in closed form."""

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.figure import Figure

from recon.arrays import DepthMap
from sensor.toml import Pair
from validation.figures import maps
from validation.figures.style import (
    FULL_IN,
    HALF_IN,
    SERIES,
    SOFT,
    card,
    fitted,
    name_decades,
    styled,
)

MARGIN, GAP = 0.08, 0.22


@styled
def cap_error_figure(
    depth_mm: DepthMap, found_mm: Mapping[str, DepthMap], mm_per_px: Pair
) -> Figure:
    """True depth, and the error of each integrator as a share of the height."""
    room = maps.BAR_ROOM_IN
    count = 1 + len(found_mm)
    width = (FULL_IN - 2 * MARGIN - count * room - (count - 1) * GAP) / count
    top = MARGIN + maps.TITLE_IN
    size_mm = maps.size_mm(depth_mm, mm_per_px)
    boxes = [
        maps.fit_box(MARGIN + i * (width + room + GAP), top, width, width, size_mm)
        for i in range(count)
    ]
    figure = maps.blank(FULL_IN, top + boxes[0].height + MARGIN)
    height_mm = float(depth_mm.max())
    image = maps.show_map(figure, boxes[0], depth_mm, mm_per_px, "truth", limits=(0.0, height_mm))
    maps.scale_bar(image)
    maps.color_bar(figure, image, "depth [mm]")
    for box, (name, found) in zip(boxes[1:], found_mm.items(), strict=True):
        error = 100 * (found - depth_mm) / height_mm
        worst = max(float(np.abs(error).max()), 1e-6)
        image = maps.show_map(
            figure,
            box,
            error,
            mm_per_px,
            fitted(f"error, {name}", width + room),
            colors=maps.SIGNED_COLORS,
            limits=(-worst, worst),
        )
        maps.color_bar(figure, image, "% of the height")
    return figure


@styled
def convergence_figure(samples: Sequence[int], errors: Mapping[str, Sequence[float]]) -> Figure:
    """Largest error on a smooth surface against samples per side; a line of order two beside it."""
    figure = card(HALF_IN, 3.2)
    axes = figure.add_subplot()
    counts = np.array(samples, dtype=float)
    for number, (name, values) in enumerate(errors.items()):
        axes.loglog(counts, values, marker="os"[number % 2], ms=5, color=SERIES[number], label=name)
    highest = max(values[0] for values in errors.values())
    axes.loglog(
        counts,
        1.6 * highest * (counts[0] / counts) ** 2,
        color=SOFT,
        ls=(0, (4, 2)),
        label="order 2",
    )
    axes.set_xticks(counts, [f"{count:g}" for count in counts])
    name_decades(axes.yaxis)
    axes.minorticks_off()
    axes.set_xlabel("samples per side")
    axes.set_ylabel("largest error / height")
    axes.grid()
    axes.legend(loc="upper right")
    return figure
