# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Depth that is pressed in and nowhere out, from one gradient axis or both: a convex problem.

The depth fits the measured slopes best among those that are zero on the border and outside the
disturbed gel and nowhere negative. Where one axis was not measured, its slope should be smooth.
The quadratic part is diagonal in sines; the constraints come in by alternating directions (Boyd et
al., Foundations and Trends in Machine Learning 3(1), 2011, section 5), of which a dozen do.

``pressed_depth`` starts from slopes of one axis or two, ``nearest_pressed`` from a depth that was
integrated freely and is negative in places.
"""

from functools import lru_cache

import cv2
import numpy as np
from jaxtyping import Bool, Float, Float32

from recon.arrays import DepthMap
from recon.integration.poisson import Boundary, eigenvalues
from recon.integration.waves import of_waves, to_waves
from sensor.toml import Pair

Support = Bool[np.ndarray, "h w"]

STEPS = 12
PENALTY_PER_PX2 = 0.00125  # stiffness of a ripple 180 px long
OVER_RELAXATION = 1.6
SMOOTHNESS_PX = 1.0
"""Weight of a change of the unmeasured slope by 1 over so many pixels."""


def pressed_depth(
    measured: Float32[np.ndarray, "h w 2"],
    support: Support,
    *,
    both: bool,
    coarseness: int = 1,
    steps: int = STEPS,
) -> Float32[np.ndarray, "h w"]:
    """Depth in pixels, of square ones.

    Args:
        measured: gradient field, px/px.
        support: where the gel may have moved.
        both: whether the x gradient was measured too; else it is not looked at.
        coarseness: pixels of the frame along a side of the solver's.
        steps: of the alternation.
    """
    h, w = support.shape
    rows, columns = max(1, round(h / coarseness)), max(1, round(w / coarseness))
    stiffness = _stiffness(rows, columns, coarseness, both)
    coarse = _shrunk(measured, rows, columns)
    allowed = _shrunk(support.astype(np.float32), rows, columns) > 0
    wanted = _pull(coarse[..., 1], axis=0)
    if both:
        wanted += _pull(coarse[..., 0], axis=1)
    penalty = np.float32(PENALTY_PER_PX2 * coarseness**2)
    inverse = 1 / (stiffness + penalty)
    pressed = multiplier = np.zeros((rows, columns), np.float32)
    for _ in range(steps):
        spectrum = to_waves(wanted + penalty * (pressed - multiplier), "dirichlet")
        fitted = of_waves(spectrum * inverse, "dirichlet")
        fitted = np.float32(OVER_RELAXATION) * (fitted - pressed) + pressed
        pressed = np.maximum(fitted + multiplier, 0) * allowed
        multiplier = multiplier + fitted - pressed
    depth = pressed * np.float32(coarseness)
    if (rows, columns) == (h, w):
        return depth
    return np.asarray(cv2.resize(depth, (w, h), interpolation=cv2.INTER_CUBIC), np.float32)


def nearest_pressed(
    free_mm: DepthMap, support: Support, mm_per_px: Pair, boundary: Boundary
) -> DepthMap:
    """The depth, nowhere negative, whose slopes differ least from those of a free one.

    If ``free_mm`` is the least-squares integral of some slopes, so is this among the depths that
    are allowed. It is found at half the resolution; what is finer stays as it was.

    Args:
        free_mm: (h, w), mm.
        support: where the gel may have moved.
        mm_per_px: pixel pitch along x and y.
        boundary: that ``free_mm`` was integrated with.
    """
    h, w = support.shape
    rows, columns = max(1, round(h / 2)), max(1, round(w / 2))
    coarse = _shrunk(free_mm.astype(np.float32), rows, columns)
    allowed = _shrunk(support.astype(np.float32), rows, columns) > 0
    pitch = (mm_per_px[0] * w / columns, mm_per_px[1] * h / rows)
    stiffness = -eigenvalues(rows, columns, pitch, boundary, "f")
    if boundary == "neumann":
        stiffness = stiffness * (np.indices((rows, columns)).any(0))  # a constant costs nothing
    penalty = np.float32(PENALTY_PER_PX2 / (mm_per_px[0] * mm_per_px[1]))
    wanted, inverse = stiffness * to_waves(coarse, boundary), 1 / (stiffness + penalty)
    pressed = np.maximum(coarse, 0) * allowed
    multiplier = np.zeros_like(pressed)
    for _ in range(STEPS):
        spectrum = wanted + penalty * to_waves(pressed - multiplier, boundary)
        fitted = of_waves(spectrum * inverse, boundary)
        fitted = np.float32(OVER_RELAXATION) * (fitted - pressed) + pressed
        pressed = np.maximum(fitted + multiplier, 0) * allowed
        multiplier = multiplier + fitted - pressed
    change = cv2.resize(pressed - coarse, (w, h), interpolation=cv2.INTER_LINEAR)
    return np.maximum(free_mm + change, 0) * support


def _pull(slopes: Float32[np.ndarray, "h w"], axis: int) -> Float32[np.ndarray, "h w"]:
    """Minus the divergence of slopes halfway between neighbours, flat gel around."""
    ringed = np.pad(slopes, [(1, 1) if axis == along else (0, 0) for along in (0, 1)])
    if axis == 0:
        return (ringed[:-2] - ringed[2:]) / 2
    return (ringed[:, :-2] - ringed[:, 2:]) / 2


@lru_cache(maxsize=8)
def _stiffness(
    rows: int, columns: int, coarseness: int, both: bool
) -> Float32[np.ndarray, "rows columns"]:
    """Eigenvalues of the fit and of the smoothness; zero border."""

    def along(count: int) -> Float[np.ndarray, " n"]:
        return (2 * np.sin(np.pi * np.arange(1, count + 1) / (2 * count + 2))) ** 2

    x, y = along(columns)[None, :], along(rows)[:, None]
    unmeasured = (SMOOTHNESS_PX / coarseness) ** 2 * x * (x + y)
    return np.asarray(y + (x if both else unmeasured), np.float32)


def _shrunk(maps: np.ndarray, rows: int, columns: int) -> np.ndarray:
    """Averages over the solver's pixels."""
    if maps.shape[:2] == (rows, columns):
        return maps
    return cv2.resize(np.ascontiguousarray(maps), (columns, rows), interpolation=cv2.INTER_AREA)
