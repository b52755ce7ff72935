# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Designs whose camera does not see the whole pad are refused."""

import math

import numpy as np

from cad.bounds import at_least, at_most
from cad.layout import Layout
from cad.optics import Paths, camera_axes, faulty_pictures, keystone, pad_grid, pixel_margin, trace
from cad.parts.camera_holder import BARREL_GAP
from sensor.errors import WedgeError

PIXEL_MARGIN = 10.0
"""Every point of the pad must lie this far inside the picture, in px."""
KEYSTONE = 0.3
"""The tip edge of the pad must be seen at least this wide, relative to its base edge."""
MIRROR_MARGIN = 0.2
"""Light must strike the mirror this far from its edges, in mm."""
_LIGHT_MARGIN = 0.1


def refuse_view(place: Layout) -> None:
    """Raise if the camera does not see the whole pad, well inside its picture."""
    design = place.design
    camera = design.camera
    paths = trace(design, pad_grid(design, 21))
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
    narrowing = keystone(paths.pixels, 21)
    if not narrowing >= KEYSTONE:
        raise WedgeError(
            f"camera.pitch_deg = {camera.pitch_deg:g} shrinks the tip of the pad in the picture to"
            f" {narrowing:.2f} of its base, which must be at least {KEYSTONE:g}: change the pitch."
        )


def _refuse_missed_mirror(place: Layout, paths: Paths) -> None:
    mirror = place.design.mirror
    along = (paths.mirror[:, 0] - mirror.foot_x_mm) / math.cos(place.tilt)
    at_most(
        "mirror.foot_x_mm",
        mirror.foot_x_mm,
        mirror.foot_x_mm - MIRROR_MARGIN + float(along.min()),
        "the tip of the pad would be seen below the mirror's foot",
    )
    at_least(
        "mirror.length_mm",
        mirror.length_mm,
        float(along.max()) + MIRROR_MARGIN,
        "the base of the pad would be seen past the mirror's top",
    )
    at_least(
        "mirror.width_mm",
        mirror.width_mm,
        2 * (float(np.abs(paths.mirror[:, 1]).max()) + MIRROR_MARGIN),
        "the sides of the pad would be seen past the mirror",
    )


def _refuse_narrow_hole(place: Layout, paths: Paths) -> None:
    """Light must come through the holder's hole before the lens, whose axis is the camera's."""
    camera = place.design.camera
    forward, up, across = camera_axes(camera)
    ways = paths.mirror - paths.pupil
    steepest = float((np.hypot(ways @ up, ways @ across) / (ways @ forward)).max())
    deep = (camera.pupil_x_mm - place.tunnel_x0 - place.slide) / math.cos(place.pitch)
    # The hole leans with the camera: on one side it is deeper by its radius times the pitch.
    radius = (deep * steepest + _LIGHT_MARGIN) / (1 - steepest * math.tan(abs(place.pitch)))
    at_least(
        "camera.barrel_diameter_mm",
        camera.barrel_diameter_mm,
        2 * (radius - BARREL_GAP),
        "the holder's hole in front of the lens would hide an edge of the pad",
    )


def _refuse_blocked_window(place: Layout, paths: Paths) -> None:
    """Light must pass between the ledges, and on its way up past the baffle's face."""
    gel, glass = place.design.gel, paths.acrylic
    across = float(np.abs(glass[:, 1]).max()) + _LIGHT_MARGIN
    at_most(
        "gel.pad_width_mm",
        gel.pad_width_mm,
        gel.pad_width_mm - 2 * (across - place.cavity_half),
        "the light from its sides must pass between the ledges",
    )
    short = place.window_x0 + _LIGHT_MARGIN - float(glass[:, 0].min())
    beyond = np.maximum(glass[:, 0], paths.mirror[:, 0]).max()
    short = max(short, float(beyond) + _LIGHT_MARGIN - place.window_x1)
    at_most(
        "gel.pad_length_mm",
        gel.pad_length_mm,
        gel.pad_length_mm - 2 * short,
        "the light from its ends must pass the ledge at the tip and the baffle at the base",
    )
