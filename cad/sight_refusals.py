# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Designs whose camera does not see the whole pad are refused."""

import math
from collections.abc import Callable

import numpy as np

from cad.bounds import EPSILON, Bounds, Other, own_range, value_of, with_value
from cad.layout import Layout
from cad.optics import (
    Array,
    Paths,
    camera_axes,
    faulty_pictures,
    keystone,
    pad_grid,
    pixel_margin,
    trace,
)
from cad.parts.camera_holder import BARREL_GAP
from sensor.design import Wedge
from sensor.errors import WedgeError

PIXEL_MARGIN = 10.0
"""Every point of the pad must lie this far inside the picture, in px."""
KEYSTONE = 0.3
"""The tip edge of the pad must be seen at least this wide, relative to its base edge."""
MIRROR_MARGIN = 0.2
"""Light must strike the mirror this far from its edges, in mm."""
_LIGHT_MARGIN = 0.1
GRID = 21
"""Points of the pad along and across."""
BISECTED_MM = 1e-4
"""To which a named bound is found that has no closed form."""


def refuse_view(place: Layout) -> None:
    """Raise if the camera does not see the whole pad, well inside its picture."""
    design = place.design
    camera = design.camera
    paths = trace(design, pad_grid(design, GRID))
    _refuse_missed_mirror(place, paths)
    _refuse_blocked_window(place, paths)
    _refuse_narrow_hole(place, paths)
    margin = pixel_margin(camera, paths.pixels)
    if not margin >= PIXEL_MARGIN:
        raise WedgeError(
            f"camera.diagonal_view_deg = {camera.diagonal_view_deg:g} shows the pad with a margin"
            f" of {margin:.1f} px, which must be at least {PIXEL_MARGIN:g}: take a wider lens,"
            " another camera.pitch_deg or a smaller pad."
        )
    worst = min(faulty_pictures(design), key=lambda fault: fault.margin_px)
    if not worst.margin_px >= 0:
        raise WedgeError(
            f"camera.diagonal_view_deg = {camera.diagonal_view_deg:g} leaves the pad a margin of"
            f" {worst.margin_px:.1f} px if built with {worst.name}, which must be at least 0: take"
            " a wider lens or a smaller pad."
        )
    narrowing = keystone(paths.pixels, GRID)
    if not narrowing >= KEYSTONE:
        raise WedgeError(
            f"camera.pitch_deg = {camera.pitch_deg:g} shrinks the tip of the pad in the picture to"
            f" {narrowing:.2f} of its base, which must be at least {KEYSTONE:g}: change the pitch."
        )


def _refuse_missed_mirror(place: Layout, paths: Paths) -> None:
    bounds = Bounds(place.design)
    if _below_foot_mm(place, paths) > EPSILON:
        bounds.at_most(
            "mirror.foot_x_mm",
            _largest(place.design, "mirror.foot_x_mm", _below_foot_mm),
            "the tip of the pad would be seen below the mirror's foot",
        )
    bounds.at_least(
        "mirror.length_mm",
        float(_along_mirror(place, paths).max()) + MIRROR_MARGIN,
        "the base of the pad would be seen past the mirror's top",
        Other(
            place.longest_mirror,
            "to go in through the window below it",
            "take a shorter pad or a longer acrylic",
        ),
    )
    bounds.at_least(
        "mirror.width_mm",
        2 * (float(np.abs(paths.mirror[:, 1]).max()) + MIRROR_MARGIN),
        "the sides of the pad would be seen past the mirror",
    )


def _below_foot_mm(place: Layout, paths: Paths) -> float:
    """How far below its least place on the mirror the tip of the pad is seen."""
    return MIRROR_MARGIN - float(_along_mirror(place, paths).min())


def _along_mirror(place: Layout, paths: Paths) -> Array:
    """How far from the mirror's foot each path meets it, (n,)."""
    return np.asarray((paths.mirror[:, 0] - place.design.mirror.foot_x_mm) / math.cos(place.tilt))


def _refuse_narrow_hole(place: Layout, paths: Paths) -> None:
    """Light must come through the holder's hole before the lens, whose axis is the camera's."""
    bounds = Bounds(place.design)
    camera = place.design.camera
    forward, up, across = camera_axes(camera)
    ways = paths.mirror - paths.pupil
    steepest = float((np.hypot(ways @ up, ways @ across) / (ways @ forward)).max())
    deep = (camera.pupil_x_mm - place.tunnel_x0 - place.slide) / math.cos(place.pitch)
    # The hole leans with the camera: on one side it is deeper by its radius times the pitch.
    radius = (deep * steepest + _LIGHT_MARGIN) / (1 - steepest * math.tan(abs(place.pitch)))
    bounds.at_least(
        "camera.barrel_diameter_mm",
        2 * (radius - BARREL_GAP),
        "the holder's hole in front of the lens would hide an edge of the pad",
        Other(
            place.widest_barrel,
            "to leave a rim that stops the camera's head",
            "take a larger head, or move camera.pupil_x_mm toward the tip",
        ),
    )


def _refuse_blocked_window(place: Layout, paths: Paths) -> None:
    """Light must pass between the ledges, and on its way up past the baffle's face."""
    bounds = Bounds(place.design)
    for field, short, why in (
        (
            "gel.pad_width_mm",
            _hidden_sides_mm,
            "the light from its sides must pass between the ledges",
        ),
        (
            "gel.pad_length_mm",
            _hidden_ends_mm,
            "the light from its ends must pass the ledge at the tip and the baffle at the base",
        ),
    ):
        if short(place, paths) > EPSILON:
            bounds.at_most(field, _largest(place.design, field, short), why)


def _hidden_sides_mm(place: Layout, paths: Paths) -> float:
    """How much wider the light is than what the ledges leave open, on either side."""
    return float(np.abs(paths.acrylic[:, 1]).max()) + _LIGHT_MARGIN - place.cavity_half


def _hidden_ends_mm(place: Layout, paths: Paths) -> float:
    """How far the light reaches past the ledge at the tip, or past the baffle at the base."""
    tip, beyond = paths.acrylic[:, 0].min(), np.maximum(paths.acrylic, paths.mirror)[:, 0].max()
    ends = place.window_x0 - float(tip), float(beyond) - place.window_x1
    return max(ends) + _LIGHT_MARGIN


def _largest(design: Wedge, field: str, short: Callable[[Layout, Paths], float]) -> float:
    """Largest value of a too large field at which nothing falls short.

    Where even its least value is too large: below that, by what is then still short.
    """

    def short_at(value: float) -> float:
        moved = with_value(design, field, value)
        return short(Layout(moved), trace(moved, pad_grid(moved, GRID)))

    low, high = own_range(field)[0], value_of(design, field)
    if short_at(low) > 0:
        return low - short_at(low)
    while high - low > BISECTED_MM:
        middle = (low + high) / 2
        low, high = (low, middle) if short_at(middle) > 0 else (middle, high)
    return low
