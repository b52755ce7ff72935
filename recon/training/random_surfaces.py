# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Random pressed surfaces from which one gradient axis learns to predict the other.

Two recipes, so that the effect of each can be measured:

* ``paper``: Wang et al., GelSight Wedge, 2021, "Gradient estimation for the missing axis": uniform
  noise from -1 to 1, cubed, zero border, a Gaussian filter of random size, negative depth clipped,
  a random height;
* ``contact``: what sensors touch, see ``recon.training.contact_surfaces``.

Lengths are in pixels of a square grid, since slopes (px/px, the same as mm/mm) are all that a
network sees of them.
"""

from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import Executor
from functools import partial
from typing import Literal

import cv2
import numpy as np
from jaxtyping import Float32

from recon.training.batches import made_ahead
from recon.training.chance import log_uniform
from recon.training.contact_surfaces import STEEPEST_SLOPE, contact_surface, surface_gradient

Recipe = Literal["paper", "contact"]
Surface = Float32[np.ndarray, "h w"]

SMALLEST_SIGMA_PX = 1.5
LARGEST_SIGMA_SHARE = 0.2  # of the frame's shorter side
HEIGHT_SHARE = (0.005, 0.08)  # of the frame's shorter side; 0.1 to 2 mm of a pad 25 mm wide
BLOCK = 50
"""Surfaces that a worker makes at a time."""
BLOCKS_AHEAD = 7
"""What is made waits in memory until it is taken."""


def paper_surface(rng: np.random.Generator, height_px: int, width_px: int) -> Surface:
    """Depth of one surface of the paper's recipe, in pixels: non-negative, zero on the border.

    A wide filter carries some of the noise to the border; the highest value there is taken off
    before clipping, so that the border is flat without a cliff. The height is lowered where slopes
    would exceed those of a ball pressed to 0.9 of its radius.

    Args:
        rng: the only source of chance; the same state gives the same surface.
        height_px: rows, at least 8.
        width_px: columns, at least 8.
    """
    shorter_px = min(height_px, width_px)
    margin_px = int(rng.integers(1, max(2, shorter_px // 6)))
    noise = np.zeros((height_px, width_px), np.float32)
    inner = noise[margin_px:-margin_px, margin_px:-margin_px]
    inner[:] = rng.uniform(-1.0, 1.0, inner.shape) ** 3
    largest_px = max(LARGEST_SIGMA_SHARE * shorter_px, SMALLEST_SIGMA_PX)
    sigma_px = log_uniform(rng, SMALLEST_SIGMA_PX, largest_px)
    relief = cv2.GaussianBlur(noise, (0, 0), sigma_px, borderType=cv2.BORDER_CONSTANT)
    border = max(relief[[0, -1]].max(), relief[:, [0, -1]].max(), 0.0)
    depth = np.maximum(relief - border, 0.0)
    highest_px = rng.uniform(*HEIGHT_SHARE) * shorter_px
    if depth.max() == 0.0:  # the border was the highest point
        return depth
    steepest = float(np.linalg.norm(surface_gradient(depth), axis=-1).max())
    return depth * np.float32(min(highest_px / depth.max(), STEEPEST_SLOPE / steepest))


RECIPES: Mapping[Recipe, Callable[[np.random.Generator, int, int], Surface]] = {
    "paper": paper_surface,
    "contact": contact_surface,
}


def surface_set(
    recipe: Recipe,
    count: int,
    size_px: tuple[int, int],
    seed: int,
    executor: Executor,
    progress: Callable[[float], None] = lambda _share: None,
) -> Float32[np.ndarray, "count h w"]:
    """Many surfaces, made in parallel; the result does not depend on by whom.

    Args:
        recipe: "paper" or "contact".
        count: how many.
        size_px: rows and columns of each.
        seed: surface i is drawn from (seed, i).
        executor: runs the blocks.
        progress: called with the share that is done.
    """
    surfaces = np.empty((count, *size_px), np.float32)
    starts = range(0, count, BLOCK)
    make = partial(_block, recipe, count, size_px, seed)
    for start, block in zip(starts, made_ahead(make, starts, executor, BLOCKS_AHEAD), strict=True):
        surfaces[start : start + BLOCK] = block
        progress(min(start + BLOCK, count) / count)
    return surfaces


def _block(
    recipe: Recipe, count: int, size_px: tuple[int, int], seed: int, start: int
) -> Float32[np.ndarray, "n h w"]:
    def each() -> Iterator[Surface]:
        for index in range(start, min(start + BLOCK, count)):
            yield RECIPES[recipe](np.random.default_rng([seed, index]), *size_px)

    return np.stack(list(each()))
