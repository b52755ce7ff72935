# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""One ball press from frame to depth, beside the truth."""

import numpy as np
from jaxtyping import Float
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from validation.examples import PressPicture
from validation.figures import maps
from validation.figures.style import BLUE, FULL_IN, INK, ORANGE, SOFT, fitted, styled

AROUND = 1.6
"""Contact radii that gradients and cuts show to each side of the centre."""

MARGIN, GAP = 0.08, 0.22
HIGHEST_FRAME = 2.7
SHALLOWEST_MM, FLATTEST = 1e-3, 1e-3
"""Ends of scales of depths and of slopes."""
AXIS_ROOM = 0.55
"""Of the numbers and the name beside or below a plot's axis."""


@styled
def press_figure(press: PressPicture) -> Figure:
    """Frame, difference and depth; gradients beside the truth; depth error and cross-sections."""
    pitch = press.mm_per_px
    window = press_window(press)
    window_mm = maps.size_mm(press.depth_mm[window], pitch)
    quarter = (FULL_IN - 2 * MARGIN - maps.BAR_ROOM_IN - 3 * GAP) / 4
    top = MARGIN + 2 * maps.TITLE_IN + 0.06
    frames = _frame_boxes(press, top)
    below = top + frames[0].height + maps.TITLE_IN + 0.14
    fields = [
        maps.fit_box(MARGIN + i * (quarter + GAP), below, quarter, quarter, window_mm)
        for i in range(4)
    ]
    last = below + fields[0].height + maps.TITLE_IN + 0.14
    error_box = maps.fit_box(MARGIN, last, quarter, quarter, window_mm)
    figure = maps.blank(FULL_IN, last + quarter + AXIS_ROOM)
    figure.text(
        MARGIN / FULL_IN,
        1 - MARGIN / figure.get_size_inches()[1],
        fitted(press.title, 0.9 * FULL_IN),
        va="top",
        fontsize=10.5,
        fontweight="bold",
    )
    _frames(figure, frames, press)
    _fields(figure, fields, press, window)

    error = (press.depth_mm - press.depth_truth_mm)[window]
    worst_mm = max(float(np.nanmax(np.abs(error))), SHALLOWEST_MM)
    image = maps.show_map(
        figure,
        error_box,
        error,
        pitch,
        "depth error in the contact [mm]",
        colors=maps.SIGNED_COLORS,
        limits=(-worst_mm, worst_mm),
    )
    maps.color_bar(figure, image)

    left = MARGIN + quarter + maps.BAR_ROOM_IN + AXIS_ROOM
    width = (FULL_IN - left - MARGIN - GAP) / 2
    row, column = _nearest(press)
    for index, (depth_mm, truth_mm) in enumerate(
        (
            (press.depth_mm[row], press.depth_truth_mm[row]),
            (press.depth_mm[:, column], press.depth_truth_mm[:, column]),
        )
    ):
        box = maps.Box(left=left + index * (width + GAP), top=last, width=width, height=quarter)
        axes = box.axes(figure)
        _cut(axes, press, depth_mm, truth_mm, index)
        axes.set_ylim(-0.12 * deepest_mm(press), 1.3 * deepest_mm(press))
        if index == 0:
            axes.set_ylabel("depth [mm]")
            axes.legend(
                loc="upper left",
                ncols=3,
                borderaxespad=0.1,
                columnspacing=0.9,
                handlelength=1.6,
                frameon=True,  # hides the rim's line behind the words
                facecolor="white",
                edgecolor="white",
                framealpha=1,
            )
        else:
            axes.tick_params(labelleft=False)
    return figure


@styled
def strip_figure(press: PressPicture) -> Figure:
    """Frame, difference and depth alone, side by side."""
    boxes = _frame_boxes(press, MARGIN + maps.TITLE_IN)
    figure = maps.blank(FULL_IN, boxes[0].top + boxes[0].height + MARGIN)
    _frames(figure, boxes, press)
    return figure


def _frame_boxes(press: PressPicture, top: float) -> list[maps.Box]:
    size_mm = maps.size_mm(press.depth_mm, press.mm_per_px)
    third = (FULL_IN - 2 * MARGIN - maps.BAR_ROOM_IN - 2 * GAP) / 3
    lefts = [MARGIN + index * (third + GAP) for index in range(3)]
    return [maps.fit_box(left, top, third, HIGHEST_FRAME, size_mm) for left in lefts]


def deepest_mm(press: PressPicture) -> float:
    """The end of a scale of its depths, from 0: no truth and no reconstruction goes beyond it."""
    deepest = max(float(np.nanmax(press.depth_truth_mm)), float(press.depth_mm.max()))
    return max(deepest, SHALLOWEST_MM)  # of a dent that is read as a hill


def _frames(figure: Figure, boxes: list[maps.Box], press: PressPicture) -> None:
    pitch = press.mm_per_px
    amplified, title = maps.amplified(press.difference), maps.AMPLIFIED_TITLE
    images = [
        maps.show_map(figure, boxes[0], np.clip(press.frame, 0, 1), pitch, "frame, unwarped"),
        maps.show_map(figure, boxes[1], amplified, pitch, f"{title}, grey is no change"),
        maps.show_map(
            figure, boxes[2], press.depth_mm, pitch, "depth", limits=(0.0, deepest_mm(press))
        ),
    ]
    for image in images:
        maps.scale_bar(image)
    maps.color_bar(figure, images[2], "depth [mm]")


def _fields(
    figure: Figure, boxes: list[maps.Box], press: PressPicture, window: tuple[slice, slice]
) -> None:
    found, truth = press.gradient[window], press.gradient_truth[window]
    steepest = max(float(np.abs(truth).max()), FLATTEST)
    pictures = (
        ("Gx estimated", found[..., 0]),
        ("Gx truth", truth[..., 0]),
        ("Gy estimated", found[..., 1]),
        ("Gy truth", truth[..., 1]),
    )
    for box, (title, field) in zip(boxes, pictures, strict=True):
        image = maps.show_map(
            figure,
            box,
            field,
            press.mm_per_px,
            title,
            colors=maps.SIGNED_COLORS,
            limits=(-steepest, steepest),
        )
    maps.color_bar(figure, image, "gradient [mm/mm]")


def _cut(
    axes: Axes,
    press: PressPicture,
    depth_mm: Float[np.ndarray, " n"],
    truth_mm: Float[np.ndarray, " n"],
    index: int,
) -> None:
    """Depth along x (index 0) or y (1), in mm from the centre."""
    place_mm = (np.arange(len(depth_mm)) - press.center_px[index]) * press.mm_per_px[index]
    reach_mm = AROUND * press.contact_radius_mm
    seen = np.abs(place_mm) <= reach_mm
    place_mm, depth_mm, truth_mm = place_mm[seen], depth_mm[seen], truth_mm[seen]
    axes.fill_between(place_mm, truth_mm, depth_mm, color=ORANGE, alpha=0.35, lw=0, label="error")
    axes.plot(place_mm, truth_mm, color=INK, lw=1.3, ls=(0, (4, 2)), label=press.truth)
    axes.plot(place_mm, depth_mm, color=BLUE, label="reconstructed")
    for side in (-1, 1):
        axes.axvline(side * press.contact_radius_mm, color=SOFT, lw=0.8, ls=":")
    axes.set_xlim(-reach_mm, reach_mm)
    axis = "xy"[index]
    axes.set_title(f"cut along {axis} through the centre")
    axes.set_xlabel(f"{axis} from the centre [mm]")


def _nearest(press: PressPicture) -> tuple[int, int]:
    """Row and column of the pixel at the contact's centre."""
    rows, columns = press.depth_mm.shape
    column, row = (round(at) for at in press.center_px)
    return min(max(row, 0), rows - 1), min(max(column, 0), columns - 1)


def press_window(press: PressPicture) -> tuple[slice, slice]:
    """Rows and columns around the contact, cut at the frame's edges."""
    spans = []
    for index, count in ((1, press.depth_mm.shape[0]), (0, press.depth_mm.shape[1])):
        reach_px = AROUND * press.contact_radius_mm / press.mm_per_px[index]
        center_px = press.center_px[index]
        spans.append(
            slice(max(0, int(center_px - reach_px)), min(count, int(center_px + reach_px) + 2))
        )
    return spans[0], spans[1]
