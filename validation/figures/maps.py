# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Maps of the gel plane, placed in inches: pixels square in mm, scale bar, colour bar."""

from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.image import AxesImage
from matplotlib.patches import Rectangle
from matplotlib.patheffects import AbstractPathEffect, withStroke

from recon.arrays import ContactMask, Difference
from sensor.toml import Pair
from validation.figures.style import FAINT

DEPTH_COLORS = "viridis"
SIGNED_COLORS = "PuOr"
"""Diverging: orange below zero, purple above, white at zero."""
AMPLIFIED = 3.0
AMPLIFIED_TITLE = f"difference × {AMPLIFIED:g}"

BAR_GAP_IN, BAR_WIDTH_IN = 0.08, 0.11
BAR_LABELS_IN = 0.62
"""Width of a colour bar's numbers and unit."""
BAR_ROOM_IN = BAR_GAP_IN + BAR_WIDTH_IN + BAR_LABELS_IN
"""Beside a map that has a colour bar."""
TITLE_IN = 0.22
"""Height of the title above a map."""


@dataclass(frozen=True, kw_only=True)
class Box:
    """A place in a figure, in inches from its top left corner."""

    left: float
    top: float
    width: float
    height: float

    def axes(self, figure: Figure) -> Axes:
        """Empty axes in this place."""
        width_in, height_in = figure.get_size_inches()
        bottom = height_in - self.top - self.height
        return figure.add_axes(
            (
                self.left / width_in,
                bottom / height_in,
                self.width / width_in,
                self.height / height_in,
            )
        )


def window_around(mask: ContactMask, around: float) -> tuple[slice, slice]:
    """Rows and columns of a square inside the frame, so many times as wide as what it is about."""
    places = np.nonzero(mask)
    wanted = around * max(np.ptp(along) for along in places) / 2 + 3
    half = int(min(wanted, *(count / 2 for count in mask.shape)))
    spans = []
    for along, count in zip(places, mask.shape, strict=True):
        low = int(np.clip((along.min() + along.max()) / 2 - half, 0, count - 2 * half))
        spans.append(slice(low, low + 2 * half))
    return spans[0], spans[1]


def amplified(difference: Difference) -> Difference:
    """A difference image as it is shown, ``AMPLIFIED`` times as large around mid grey."""
    return np.clip(0.5 + AMPLIFIED * difference, 0, 1)


def blank(width_in: float, height_in: float) -> Figure:
    """An empty white figure for things that are placed in inches."""
    return Figure(figsize=(width_in, height_in), facecolor="white")


def fit_box(left: float, top: float, width: float, height: float, size_mm: Pair) -> Box:
    """The largest box of a map's shape inside another, at its top left."""
    scale = min(width / size_mm[0], height / size_mm[1])
    return Box(left=left, top=top, width=scale * size_mm[0], height=scale * size_mm[1])


def size_mm(values: np.ndarray, mm_per_px: Pair) -> Pair:
    """Width and height of a map."""
    rows, columns = values.shape[:2]
    return columns * mm_per_px[0], rows * mm_per_px[1]


def show_map(
    figure: Figure,
    box: Box,
    values: np.ndarray,
    mm_per_px: Pair,
    title: str,
    *,
    colors: str = DEPTH_COLORS,
    limits: Pair | None = None,
) -> AxesImage:
    """A map (h, w), or an RGB picture (h, w, 3), y down as in the frame; NaN is grey."""
    low, high = limits if limits else (None, None)
    width_mm, height_mm = size_mm(values, mm_per_px)
    axes = box.axes(figure)
    axes.set_facecolor(FAINT)
    image = axes.imshow(
        values,
        cmap=colors,
        vmin=low,
        vmax=high,
        extent=(0.0, width_mm, height_mm, 0.0),
        aspect="auto",
        interpolation="auto",
    )
    axes.spines[:].set_visible(True)
    axes.set(xticks=[], yticks=[], title=title)
    return image


def color_bar(figure: Figure, image: AxesImage, label: str = "") -> None:
    """A colour bar to the right of a map, as high as the map."""
    axes = image.axes
    assert isinstance(axes, Axes)
    left, bottom, width, height = axes.get_position().bounds
    inch = 1 / figure.get_size_inches()[0]
    place = (left + width + BAR_GAP_IN * inch, bottom, BAR_WIDTH_IN * inch, height)
    bar = figure.colorbar(image, cax=figure.add_axes(place), label=label)
    bar.outline.set_visible(False)


def scale_bar(image: AxesImage, *, color: str = "white", halo_color: str = "#000000a0") -> None:
    """A bar of a round length, up to a fifth of the map's width; dark ones suit light maps."""
    axes = image.axes
    assert isinstance(axes, Axes)
    width_mm = axes.get_xlim()[1]
    length_mm = round_length_mm(width_mm / 5)
    halo: list[AbstractPathEffect] = [withStroke(linewidth=2.2, foreground=halo_color)]
    left, bottom, thick = 0.04, 0.05, 0.016
    bar = Rectangle(
        (left, bottom), length_mm / width_mm, thick, transform=axes.transAxes, fc=color, ec="none"
    )
    bar.set_path_effects(halo)
    axes.add_patch(bar)
    axes.text(
        left,
        bottom + 2 * thick,
        f"{length_mm:g} mm",
        transform=axes.transAxes,
        va="bottom",
        color=color,
        fontsize=8.5,
        path_effects=halo,
    )


def round_length_mm(longest_mm: float) -> float:
    """The largest of 1, 2 and 5 times a power of ten that is not longer."""
    power = 10.0 ** np.floor(np.log10(longest_mm) + 1e-9)
    return float(max(step for step in (1, 2, 5) if step * power <= longest_mm * (1 + 1e-9)) * power)


def outline(image: AxesImage, mask: np.ndarray, mm_per_px: Pair, *, color: str = "white") -> None:
    """The edge of a mask as a line; nothing where it has none."""
    if mask.all() or not mask.any() or min(mask.shape) < 2:
        return
    rows, columns = mask.shape
    x_mm = (np.arange(columns) + 0.5) * mm_per_px[0]
    y_mm = (np.arange(rows) + 0.5) * mm_per_px[1]
    image.axes.contour(x_mm, y_mm, mask, levels=[0.5], colors=color, linewidths=1.2)
