# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""The calibration ball's cap in closed form: one truth for calibration, tests and validation.

A ball of radius R whose contact circle has radius a dents the gel, at a distance d < a from the
circle's centre, by ``sqrt(R^2 - d^2) - sqrt(R^2 - a^2)`` below the circle's rim.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from recon.arrays import ContactMask, DepthMap, GradientField, NormalMap
from sensor.toml import Pair

DistanceMap = Float[np.ndarray, "h w"]


@dataclass(frozen=True, kw_only=True)
class BallCap:
    """A ball's cap sampled at pixel centres; zero (and a flat normal) outside the contact."""

    depth_mm: DepthMap
    """Below the rim of the contact circle."""
    gradient: GradientField
    contact: ContactMask

    @property
    def normal(self) -> NormalMap:
        """Normals of the skin."""
        return normals(self.gradient)


def ball_cap(
    size_px: tuple[int, int],
    center_px: Pair,
    contact_radius_mm: float,
    ball_radius_mm: float,
    mm_per_px: Pair,
) -> BallCap:
    """The cap of a ball in a frame of ``size_px`` (width, height).

    Raises:
        ValueError: the contact circle is not smaller than the ball.
    """
    if not 0 < contact_radius_mm < ball_radius_mm:
        raise ValueError("the contact circle must be smaller than the ball")
    x_mm, y_mm = offsets_mm(size_px, center_px, mm_per_px)
    squared = x_mm**2 + y_mm**2
    contact = squared < contact_radius_mm**2
    height = np.sqrt(np.where(contact, ball_radius_mm**2 - squared, 1.0))
    rim = np.sqrt(ball_radius_mm**2 - contact_radius_mm**2)
    depth = np.where(contact, height - rim, 0.0)
    gradient = np.where(contact[..., None], -np.stack([x_mm, y_mm], -1) / height[..., None], 0.0)
    return BallCap(depth_mm=depth, gradient=gradient, contact=contact)


def offsets_mm(
    size_px: tuple[int, int], center_px: Pair, mm_per_px: Pair
) -> tuple[DistanceMap, DistanceMap]:
    """Distances along x and y, in mm, of every pixel from a centre given in pixels."""
    width, height = size_px
    x_mm = (np.arange(width) - center_px[0]) * mm_per_px[0]
    y_mm = (np.arange(height) - center_px[1]) * mm_per_px[1]
    x_map, y_map = np.meshgrid(x_mm, y_mm)
    return x_map, y_map


def normals(gradient: GradientField) -> NormalMap:
    """Unit normals of the skin (x, y, -depth): proportional to (Gx, Gy, 1)."""
    upright = np.concatenate([gradient, np.ones_like(gradient[..., :1])], -1)
    unit: NormalMap = upright / np.linalg.norm(upright, axis=-1, keepdims=True)
    return unit
