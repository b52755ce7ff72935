# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Random pressed surfaces from which one gradient axis learns to predict the other.

The recipe is the paper's ("Gradient estimation for the missing axis"): cubed uniform noise, zero
border, Gaussian filters of random size, negative depth clipped, random height. Lengths are in
pixels of a square grid, since slopes (px/px, the same as mm/mm) are all that the network sees.
"""

import cv2
import numpy as np
from jaxtyping import Float32

EMPTY_SHARE = 0.05  # untouched gel, so that noise alone is answered with zero
SMALLEST_SIGMA_PX = 1.5
LARGEST_SIGMA_SHARE = 0.25  # of the frame's shorter side
STEEPEST_SLOPE = 2.5  # a ball pressed to 0.9 of its radius has 2.07 at its rim


def random_surface(
    rng: np.random.Generator, height_px: int, width_px: int
) -> Float32[np.ndarray, "h w"]:
    """Depth of one random contact in pixels: non-negative, zero on the border.

    The level that is clipped away is raised in half of the surfaces: that leaves few contacts, each
    with a sharp rim as real ones have. Its lower bound is the highest value on the border, so that
    the border is flat without a cliff.

    Args:
        rng: the only source of chance; the same state gives the same surface.
        height_px: rows, at least 8.
        width_px: columns, at least 8.
    """
    if rng.random() < EMPTY_SHARE:
        return np.zeros((height_px, width_px), np.float32)
    relief = _filtered_noise(rng, height_px, width_px)
    if rng.random() < 0.5:
        finer = _filtered_noise(rng, height_px, width_px)
        relief += np.float32(rng.uniform(0.0, 0.5)) * finer
    border = max(relief[[0, -1]].max(), relief[:, [0, -1]].max(), 0.0)
    level = border + rng.choice([0.0, rng.uniform(0.0, 0.8)]) * (relief.max() - border)
    depth = np.maximum(relief - np.float32(level), 0.0)
    steepest = float(np.linalg.norm(surface_gradient(depth), axis=-1).max())
    if steepest == 0.0:  # the border was the highest point
        return np.zeros_like(depth)
    return depth * np.float32(rng.uniform(0.1, STEEPEST_SLOPE) / steepest)


def surface_gradient(depth_px: Float32[np.ndarray, "h w"]) -> Float32[np.ndarray, "h w 2"]:
    """(∂depth/∂x, ∂depth/∂y) in px/px by central differences, one-sided on the border."""
    along_y, along_x = np.gradient(depth_px)
    return np.stack([along_x, along_y], axis=-1)


def _filtered_noise(
    rng: np.random.Generator, height_px: int, width_px: int
) -> Float32[np.ndarray, "h w"]:
    """Cubed noise with a zero border through one Gaussian, scaled to a standard deviation of 1."""
    shorter_px = min(height_px, width_px)
    margin_px = int(rng.integers(1, max(2, shorter_px // 4)))
    noise = np.zeros((height_px, width_px), np.float32)
    inner = noise[margin_px:-margin_px, margin_px:-margin_px]
    inner[:] = rng.uniform(-1.0, 1.0, inner.shape) ** 3
    log_range = np.log([SMALLEST_SIGMA_PX, LARGEST_SIGMA_SHARE * shorter_px])
    sigma_x, sigma_y = np.exp(rng.uniform(*log_range) + rng.uniform(-0.35, 0.35, 2))
    smooth = cv2.GaussianBlur(
        noise, (0, 0), sigmaX=sigma_x, sigmaY=sigma_y, borderType=cv2.BORDER_CONSTANT
    )
    return np.asarray(smooth / smooth.std(), np.float32)
