# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Where gel is held, told from gel that only follows, by a small network.

Free skin is bent away from what holds it, held skin is bent as the object is; with slopes that are
a tenth wrong no threshold on depth or pressure tells them apart, but a network that has seen many
skins does. It learnt from random objects pressed into elastic gel (``recon.training.contact``), and
further from presses rendered for sensors (``recon.training.contact_further``).
"""

import cv2
import numpy as np
from jaxtyping import Bool, Float, Float32

from recon import unet
from recon.unet.weights import Purpose, shipped_weights
from recon.windows import window_about
from sensor.toml import Pair

CONTACT = Purpose(
    name="contact",
    version="2",
    inputs=4,
    outputs=1,
    training="recon.training.contact",
    fine=(12, 12),
)
LARGEST_PX = 400
"""A frame with a longer side is looked at in coarser pixels: the collar is 2 to 9 of them long."""
MARGIN_PX = 12
"""Looked at beside the gel that may be held."""
DEPTH_UNIT_PX = 8.0
BEND_UNIT = 0.25
"""Both bring a map to about the size of slopes."""


def network_input(
    depth_px: Float[np.ndarray, "h w"], gradient: Float[np.ndarray, "h w 2"]
) -> Float32[np.ndarray, "4 h w"]:
    """Both slopes, the depth in pixels, and the slopes' divergence."""
    bend = np.zeros_like(depth_px)
    bend[:, 1:-1] = (gradient[:, 2:, 0] - gradient[:, :-2, 0]) / 2
    bend[1:-1] += (gradient[2:, :, 1] - gradient[:-2, :, 1]) / 2
    maps = [gradient[..., 0], gradient[..., 1], depth_px / DEPTH_UNIT_PX, bend / BEND_UNIT]
    return np.stack(maps).astype(np.float32)


def held(
    depth_mm: Float[np.ndarray, "h w"],
    gradient: Float[np.ndarray, "h w 2"],
    mm_per_px: Pair,
    near: Bool[np.ndarray, "h w"],
) -> Bool[np.ndarray, "h w"]:
    """Where an object holds the gel.

    Args:
        depth_mm: of the skin.
        gradient: mm/mm.
        mm_per_px: pixel pitch along x and y.
        near: what is asked for; elsewhere the answer is no.
    """
    found = np.zeros(near.shape, bool)
    if not near.any():
        return found
    weights = shipped_weights(CONTACT)
    rows, columns = window_about(near, MARGIN_PX)
    score = _score(depth_mm[rows, columns], gradient[rows, columns], mm_per_px, near.shape, weights)
    found[rows, columns] = (score > 0) & near[rows, columns]
    return found


def _score(
    depth_mm: Float[np.ndarray, "h w"],
    gradient: Float[np.ndarray, "h w 2"],
    mm_per_px: Pair,
    whole: tuple[int, ...],
    weights: unet.Weights,
) -> Float32[np.ndarray, "h w"]:
    """Log odds of being held."""
    height, width = depth_mm.shape
    coarser = -(-max(whole) // LARGEST_PX)
    rows, columns = -(-height // coarser), -(-width // coarser)
    pitch_mm = (mm_per_px[0] * mm_per_px[1]) ** 0.5 * coarser
    depth = np.asarray(depth_mm / pitch_mm, np.float32)
    slopes = np.ascontiguousarray(gradient, np.float32)
    depth, slopes = resized(depth, rows, columns), resized(slopes, rows, columns)
    maps = unet.padded(weights, network_input(depth, slopes))
    score = unet.through_layers(weights, maps)[0, :rows, :columns]
    return resized(score, height, width)


def resized(maps: Float32[np.ndarray, "h w *c"], rows: int, columns: int) -> np.ndarray:
    """The maps in other pixels: averages where these are larger."""
    if maps.shape[:2] == (rows, columns):
        return maps
    how = cv2.INTER_AREA if rows < len(maps) else cv2.INTER_LINEAR
    return np.asarray(cv2.resize(maps, (columns, rows), interpolation=how), np.float32)
