# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""How the page of `wedge label` draws a contact circle, describes it and edits it."""

import math
from dataclasses import replace

from app.pages.canvas import STROKES
from recon.labels.label_book import CERTAIN
from sensor.dataset import BallLabel
from sensor.toml import Pair

SMALLEST_PX = 2.0
ARM_PX = 5
"""Length of the cross's arms, in pixels of the screen."""


def drawn(label: BallLabel) -> str:
    """The circle and a cross in its middle, as SVG over the frame's pixels.

    Lines are as wide, and the cross as large, on every screen and in every frame: of its arms, half
    as long as the radius, a dash shows what is near the middle.
    """
    x, y, radius = label.center_x_px + 0.5, label.center_y_px + 0.5, label.contact_radius_px
    ring = f'cx="{x}" cy="{y}" r="{radius}"'
    arms = " ".join(f"M {x} {y} {way}{radius / 2}" for way in ("h ", "h -", "v ", "v -"))
    lines = "".join(
        f'<g stroke="{color}" stroke-width="{width}">'
        f'<circle {ring} vector-effect="non-scaling-stroke"/>'
        f'<path d="{arms}" stroke-dasharray="{ARM_PX} 9999" vector-effect="non-scaling-stroke"/>'
        "</g>"
        for color, width in STROKES
    )
    return f'<g fill="none">{lines}</g>'


def words(label: BallLabel, mm_per_px: Pair) -> str:
    """The circle's centre and radius in words."""
    radius_px = label.contact_radius_px
    return (
        f"centre ({label.center_x_px:.2f}, {label.center_y_px:.2f}) px, radius {radius_px:.2f} px"
        f" = {radius_px * math.sqrt(math.prod(mm_per_px)):.2f} mm"
    )


def new_circle(
    file: str, x_px: float, y_px: float, radius_px: float, ball_radius_mm: float | None
) -> BallLabel:
    """A circle that somebody draws in a frame without one."""
    return BallLabel(
        file=file,
        center_x_px=x_px,
        center_y_px=y_px,
        contact_radius_px=round(radius_px, 2),
        ball_radius_mm=ball_radius_mm,
        quality=CERTAIN,
    )


def moved(label: BallLabel, x_px: float, y_px: float, size_px: tuple[int, int]) -> BallLabel:
    """The circle at another place, its centre kept inside a frame of this width and height."""
    width, height = size_px
    return replace(
        label,
        center_x_px=round(min(max(x_px, 0.0), width - 1.0), 2),
        center_y_px=round(min(max(y_px, 0.0), height - 1.0), 2),
        quality=CERTAIN,
    )


def grown(label: BallLabel, factor: float, largest_px: float) -> BallLabel:
    """The circle larger or smaller, within what its ball allows."""
    radius_px = min(max(label.contact_radius_px * factor, SMALLEST_PX), largest_px)
    return replace(label, contact_radius_px=round(radius_px, 2), quality=CERTAIN)
