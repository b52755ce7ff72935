# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Shadows on the twin's skin by ray casting, and how many of them the detector finds."""

from collections.abc import Mapping
from dataclasses import dataclass

import cv2
import numpy as np
from jaxtyping import Bool, Float

from sensor.design import Wedge
from simulation.scene import Side, sides
from simulation.skin import Map, View, rest_height_mm

POINTS_ALONG = 5
"""Of a row of LEDs, from which light is taken to come."""
BLOCKED, FACING, REACHED = 0.5, 0.25, 0.6
"""A light is blocked where less than this share of it arrives; a shadow is cast where the skin
faces the light so far, yet less than this share reaches it past other skin."""
STEP_PX = 1.5
LONGEST_MM = 8.0
CLEAR_MM = 0.01


@dataclass(frozen=True, kw_only=True)
class TrueShadows:
    """Of one light on one skin."""

    blocked: Bool[np.ndarray, "h w"]
    """Less than half of what the untouched skin receives arrives directly."""
    cast: Bool[np.ndarray, "h w"]
    """The skin faces the light, but other skin is in the way."""


@dataclass(frozen=True, kw_only=True)
class ShadowScore:
    """Over all lights."""

    name: str
    found_px: int
    right_px: int
    """Of those found, where the light is blocked."""
    cast_px: int
    cast_found_px: int

    @property
    def precision(self) -> float:
        """Share of what was found that is blocked."""
        return self.right_px / self.found_px if self.found_px else 1.0

    @property
    def recall(self) -> float:
        """Share of cast shadows that was found."""
        return self.cast_found_px / self.cast_px if self.cast_px else 1.0


def true_shadows(design: Wedge, view: View, depth_mm: Map) -> Mapping[str, TrueShadows]:
    """By colour: rays from the skin to points of each row of LEDs, refraction left out."""
    flat = np.zeros_like(depth_mm)
    found = {}
    for side in sides(design):
        if not side.leds:
            continue
        facing, arriving = _light(design, view, depth_mm, side)
        rest, _ = _light(design, view, flat, side)
        found[str(side.color)] = TrueShadows(
            blocked=arriving < BLOCKED * rest,
            cast=(arriving < REACHED * facing) & (facing > FACING * rest),
        )
    return found


def score_shadows(
    name: str, found: Bool[np.ndarray, "h w 3"], truth: Mapping[str, TrueShadows]
) -> ShadowScore:
    """What was found of the shadows on one skin."""
    pairs = [(found[..., "RGB".index(color)], shadow) for color, shadow in truth.items()]
    return ShadowScore(
        name=name,
        found_px=sum(int(mask.sum()) for mask, _ in pairs),
        right_px=sum(int((mask & (shadow.blocked | shadow.cast)).sum()) for mask, shadow in pairs),
        cast_px=sum(int(shadow.cast.sum()) for _, shadow in pairs),
        cast_found_px=sum(int((mask & shadow.cast).sum()) for mask, shadow in pairs),
    )


def _light(
    design: Wedge, view: View, depth_mm: Map, side: Side
) -> tuple[Float[np.ndarray, "h w"], Float[np.ndarray, "h w"]]:
    """What the skin would receive of one side's LEDs by its slope alone, and what reaches it."""
    x, y = view.grid_mm
    z = rest_height_mm(design.gel, x, y) - depth_mm
    slope_y, slope_x = np.gradient(z, *view.mm_per_px[::-1])
    normal = np.stack([slope_x, slope_y, -np.ones_like(z)], -1)
    normal /= np.linalg.norm(normal, axis=-1, keepdims=True)
    middle = -(design.gel.thickness_mm + design.acrylic.thickness_mm / 2)
    half = side.leds * design.wiring.led_pitch_mm / 2
    facing, arriving = np.zeros_like(z), np.zeros_like(z)
    for share in np.linspace(-1, 1, POINTS_ALONG):
        lamp = np.array(
            [*(np.array(side.row_center_mm) + share * half * np.array(side.along)), middle]
        )
        way = lamp - np.stack([x, y, z], -1)
        far = np.linalg.norm(way, axis=-1)
        way /= far[..., None]
        light = np.maximum((normal * way).sum(-1), 0)
        light *= np.abs(way @ np.array([*side.inward, 0.0])) / far**2
        facing += light
        arriving += light * _unstopped(view, z, way)
    return facing, arriving


def _unstopped(view: View, z: Map, way: Float[np.ndarray, "h w 3"]) -> Bool[np.ndarray, "h w"]:
    """Where a ray from the skin stays inside the gel."""
    rows, columns = np.indices(z.shape)
    level = np.hypot(way[..., 0], way[..., 1])
    free = np.ones(z.shape, bool)
    pitch = view.mm_per_px[0]
    skin = z.astype(np.float32)
    for far_mm in np.arange(STEP_PX * pitch, LONGEST_MM, STEP_PX * pitch):
        along_x, along_y, along_z = np.moveaxis(way / level[..., None], -1, 0) * far_mm
        there = cv2.remap(
            skin,
            (columns + along_x / view.mm_per_px[0]).astype(np.float32),
            (rows + along_y / view.mm_per_px[1]).astype(np.float32),
            cv2.INTER_LINEAR,
            borderMode=cv2.BORDER_REPLICATE,
        )
        free &= z + along_z < there + CLEAR_MM
    return free
