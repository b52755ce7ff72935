# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""A ball as an ideal sensor with soft gel sees it: the gel slopes on beside the contact."""

import numpy as np

AZIMUTHS_DEG = {"R": -90.0, "G": 180.0, "B": 90.0}


def pressed(
    size_px: tuple[int, int],
    center_px: tuple[float, float],
    contact_radius_px: float,
    ball_radius_px: float,
    noise: float = 0.01,
    seed: int = 0,
) -> np.ndarray:
    """Difference image, float32 of full scale, of three lights at ``AZIMUTHS_DEG``."""
    y, x = np.mgrid[: size_px[1], : size_px[0]]
    dx, dy = x - center_px[0], y - center_px[1]
    distance = np.maximum(np.hypot(dx, dy), 1e-9)
    inside = np.minimum(distance, contact_radius_px)
    slope = inside / np.sqrt(ball_radius_px**2 - inside**2)
    slope *= np.exp(-np.maximum(distance - contact_radius_px, 0) / (contact_radius_px / 4))
    normal = np.stack([-dx / distance * slope, -dy / distance * slope, np.ones_like(slope)], -1)
    normal /= np.linalg.norm(normal, axis=-1, keepdims=True)
    angles = np.radians(list(AZIMUTHS_DEG.values()))
    # The gradient rises away from the side that faces a light, so light is against the gradient.
    lights = np.stack([-np.cos(angles), -np.sin(angles), np.ones(3)]) * np.sqrt(0.5)
    flat = lights[2]
    seen = 0.5 * (normal @ lights - flat)
    seen += noise * np.random.default_rng(seed).standard_normal(seen.shape)
    return seen.astype(np.float32)


def as_frame(difference: np.ndarray, level: float = 0.5) -> np.ndarray:
    """The 8-bit frame whose background is an even grey."""
    return np.clip((difference + level) * 255, 0, 255).round().astype(np.uint8)
