# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Dots and how they moved, drawn over the frame."""

import cv2
import numpy as np
from matplotlib.figure import Figure
from matplotlib.patheffects import AbstractPathEffect, withStroke

from recon.arrays import Unwarped
from recon.markers.tracking import Tracked
from sensor.toml import Pair
from validation.figures import maps
from validation.figures.overlay import Color, Picture, enlarged, with_words
from validation.figures.style import ORANGE, fitted, styled

LONGER_SIDE_IN = 5.6
MARGIN_IN = 0.08
EXAGGERATED = 3.0
"""Length of the arrows, of the way that a dot moved."""
LEAST_ARROW_PX = 5.0
"""Of the picture: shorter ones would be heads alone."""
SHAFT, HALO, CARRIED = (255, 255, 255), (0, 0, 0), (240, 150, 40)
WORDS: dict[str, Color] = {"tracked": (90, 200, 120), "jumped": (240, 190, 70)}
"""RGB of a word; red for the rest."""
LOST = (255, 110, 90)


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


def marker_overlay(image: Unwarped, tracked: Tracked, mm_per_px: Pair) -> Picture:
    """A frame with arrows from where each dot rests, and how far they moved in words.

    Args:
        image: the gel plane.
        tracked: its dots.
        mm_per_px: of both.
    """
    picture = enlarged(image)
    draw_arrows(picture, tracked, picture.shape[1] / image.shape[1])
    return with_words(
        picture,
        f"{tracked.word}, arrows x{EXAGGERATED:g}",
        WORDS.get(tracked.word, LOST),
        marker_words(tracked, mm_per_px),
    )


def marker_words(tracked: Tracked, mm_per_px: Pair) -> str:
    """How many dots are seen and how far they have moved."""
    seen = tracked.seen
    count = f"{int(seen.sum())} of {len(seen)} dots seen"
    if tracked.word == "lost":
        return f"{count}: lost"
    moved_mm = np.hypot(*tracked.displacement_mm(mm_per_px)[seen].T)
    return (
        f"{count}, moved {moved_mm.mean():.2f} mm on average, {moved_mm.max():.2f} mm at most"
        + (": jumped" if tracked.jumped else "")
    )


def draw_arrows(picture: Picture, tracked: Tracked, scale: float) -> None:
    """From where each dot rests, longer than it moved; a ring where it is carried along.

    Args:
        picture: drawn into.
        tracked: nothing is drawn where its dots are lost.
        scale: pixels of the picture in one of the frame's.
    """
    if tracked.word == "lost":
        return
    rest = (tracked.markers.position_px + 0.5) * scale
    moved = scale * tracked.displacement_px
    ends = rest + EXAGGERATED * moved
    drawn = tracked.seen & (np.hypot(*(ends - rest).T) >= LEAST_ARROW_PX)
    for place, goal in zip(rest[drawn], ends[drawn], strict=True):
        start, end = ([round(float(along)) for along in point] for point in (place, goal))
        for color, thickness in ((HALO, 3), (SHAFT, 1)):
            cv2.arrowedLine(picture, start, end, color, thickness, cv2.LINE_AA, tipLength=0.3)
    for place in (rest + moved)[~tracked.seen]:
        center = [round(float(along)) for along in place]
        radius_px = round(0.2 * scale * tracked.markers.spacing_px)
        cv2.circle(picture, center, radius_px, CARRIED, 2, cv2.LINE_AA)
