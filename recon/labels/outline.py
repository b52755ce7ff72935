# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Where a ball touched, from the outline of what it changed rather than from its colours.

Along rays from a first centre the change of colour rises to the contact's rim and falls beyond it.
Circles are fitted where it has fallen to shares of each ray's own maximum, so that a side that is
lit more does not pull. Tried as well, on real presses with hand-drawn centres and on rendered ones
of known centre, and worse: a colour model shared by all presses (refined with all centres at once;
with and without place, background and wider rings), the point that all slopes lead to, the rim of
slopes fitted linearly, and where each ray falls steepest.
"""

from dataclasses import dataclass

import cv2
import numpy as np
from jaxtyping import Float32, Float64

from sensor.toml import Pair

Change = Float32[np.ndarray, "h w"]
Profiles = Float64[np.ndarray, "rays steps"]
Radii = Float64[np.ndarray, " rays"]

RAYS = 120
STEP_PX = 0.25
NEAREST, FARTHEST = 0.7, 1.7
"""Of the contact's radius: where rays begin and end; the visible disc ends at 1.2 to 1.3."""
LEVELS = (0.6, 0.7, 0.8, 0.9)
FEWEST_RAYS = 0.3
"""Share of the rays that must fall within the frame: a shorter arc fixes no centre."""
ROUNDS = 4
FARTHEST_SHIFT = 0.25
"""Of the radius: an outline farther off than this is another object's."""
FIT_STEPS = 8


@dataclass(frozen=True, kw_only=True)
class Outline:
    """Where a disc's outline is centred."""

    center_px: Pair
    spread: float
    """How far the circle of the lowest share lies from that of the highest, in contact radii. Light
    that a dent turns away to one side draws the outer circles there."""


def outline_of(change: Change, center_px: Pair, radius_px: float) -> Outline | None:
    """The outline; ``None`` where too little of it shows, or it lies elsewhere.

    Args:
        change: how much the colour changed at each pixel, smoothed, without dots.
        center_px: of the contact, good to a quarter of its radius.
        radius_px: of the contact.
    """
    center = np.array(center_px, dtype=np.float64)
    angle = np.linspace(0, 2 * np.pi, RAYS, endpoint=False)
    along = np.stack([np.cos(angle), np.sin(angle)], -1)
    distance = np.arange(NEAREST * radius_px, FARTHEST * radius_px, STEP_PX)
    for _ in range(ROUNDS):
        x, y = np.moveaxis(center + along[:, None] * distance[:, None], -1, 0).astype(np.float32)
        profiles = cv2.remap(
            change, x, y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_CONSTANT, borderValue=-1
        ).astype(np.float64)
        whole = (profiles >= 0).all(1)
        found = []
        for level in LEVELS:
            radii = _where_fallen(profiles, distance, level)
            seen = whole & np.isfinite(radii)
            if seen.sum() < FEWEST_RAYS * RAYS:
                return None
            found.append(_center_of(center + along[seen] * radii[seen, None], center))
        center = np.mean(found, axis=0)
    if np.hypot(*(center - center_px)) > FARTHEST_SHIFT * radius_px:
        return None
    return Outline(
        center_px=(float(center[0]), float(center[1])),
        spread=float(np.hypot(*(found[-1] - found[0]))) / radius_px,
    )


def _where_fallen(
    profiles: Profiles, distance: Float64[np.ndarray, " steps"], level: float
) -> Radii:
    """Where each ray first falls to a share of the way from its maximum to what follows."""
    steps = np.arange(len(distance))
    beyond = steps > profiles.argmax(1)[:, None]
    top = profiles.max(1)
    bottom = np.where(beyond, profiles, top[:, None]).min(1)
    wanted = bottom + level * (top - bottom)
    fallen = beyond & (profiles < wanted[:, None])
    first, ray = fallen.argmax(1), np.arange(len(profiles))
    inner, outer = profiles[ray, first - 1], profiles[ray, first]
    share = (wanted - outer) / np.maximum(inner - outer, 1e-12)
    radii: Radii = np.where(fallen.any(1), distance[first] - STEP_PX * share, np.nan)
    return radii


def _center_of(
    points: Float64[np.ndarray, "n 2"], center: Float64[np.ndarray, " 2"]
) -> Float64[np.ndarray, " 2"]:
    """Centre of the circle nearest to points; those over a pixel off count less (soft L1)."""
    center = center.copy()
    radius = float(np.median(np.hypot(*(points - center).T)))
    for _ in range(FIT_STEPS):
        away = points - center
        length = np.maximum(np.hypot(*away.T), 1e-9)
        error = length - radius
        weight = (1 + error**2) ** -0.25
        terms = np.column_stack([away / length[:, None], np.ones(len(points))]) * weight[:, None]
        step = np.linalg.lstsq(terms.T @ terms, terms.T @ (error * weight), rcond=None)[0]
        center, radius = center + step[:2], radius + float(step[2])
    return center
