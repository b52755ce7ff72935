# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Gradients to depth: the Poisson equation with a zero or a free border, solved exactly.

Photometric stereo gives slopes at pixel centres. The mean of two neighbours is the slope at the
midpoint between them, and depth z should satisfy ``z[j+1] - z[j] = h * slope[j+1/2]`` along rows
and columns. Its least-squares solution solves the five-point Poisson equation whose right side
is the divergence of the midpoint slopes; that operator is diagonal in sines or cosines:

* ``dirichlet``: z = 0 on a ring outside the frame, type-I sine transform with the eigenvalues
  ``(2 cos(pi k / (n + 1)) - 2) / h^2``, k = 1..n;
* ``neumann``: nothing is assumed at the border (a least-squares fit has natural borders),
  type-II cosine transform with ``(2 cos(pi k / n) - 2) / h^2``, k = 0..n-1; depth is then
  defined up to a constant, and has mean zero.

See Simchony, Chellappa and Shao, PAMI 12(5), 1990, for the transforms.
"""

from functools import lru_cache
from typing import Literal, get_args

import numpy as np
from jaxtyping import Float
from scipy import fft

from recon.arrays import DepthMap, GradientField
from sensor.errors import WedgeError
from sensor.toml import Pair

Boundary = Literal["dirichlet", "neumann"]
SlopesX = Float[np.ndarray, "h mx"]
SlopesY = Float[np.ndarray, "my w"]


def integrate(gradient: GradientField, mm_per_px: Pair, boundary: Boundary) -> DepthMap:
    """Depth in mm of a gradient field sampled at pixel centres.

    Args:
        gradient: (h, w, 2), mm/mm, along x and y.
        mm_per_px: pixel pitch along x and y.
        boundary: ``dirichlet`` where the frame's border is untouched gel, ``neumann`` where a
            contact reaches it.

    Returns:
        (h, w), of the gradient's dtype; mean zero for ``neumann``.

    Raises:
        WedgeError: there is no such boundary, or a pitch is not positive.
    """
    if boundary not in get_args(Boundary):
        raise WedgeError(f"there is no boundary {boundary!r}: choose one of dirichlet, neumann.")
    if not all(0 < side < np.inf for side in mm_per_px):
        raise WedgeError(f"mm_per_px = {mm_per_px} must be positive along both axes.")
    mm_per_px = (mm_per_px[0], mm_per_px[1])
    if boundary == "neumann":
        return solve_neumann(*midpoint_slopes(gradient), mm_per_px)
    (above, below), (left, right) = (margins_px(n) for n in gradient.shape[:2])
    flat = np.pad(gradient, ((above, below), (left, right), (0, 0)))
    slopes_x, slopes_y = midpoint_slopes(flat)
    depth = solve_dirichlet(slopes_x[1:-1], slopes_y[:, 1:-1], mm_per_px)
    return depth[above - 1 : -below + 1 or None, left - 1 : -right + 1 or None]


def midpoint_slopes(gradient: GradientField) -> tuple[SlopesX, SlopesY]:
    """Slopes halfway between neighbours: (h, w - 1) along x and (h - 1, w) along y."""
    along_x, along_y = gradient[..., 0], gradient[..., 1]
    return (along_x[:, :-1] + along_x[:, 1:]) / 2, (along_y[:-1] + along_y[1:]) / 2


def solve_dirichlet(slopes_x: SlopesX, slopes_y: SlopesY, mm_per_px: Pair) -> DepthMap:
    """Depth that is zero on a ring just outside the frame.

    Args:
        slopes_x: (h, w + 1), between horizontal neighbours, ring included.
        slopes_y: (h + 1, w), between vertical neighbours, ring included.
        mm_per_px: pixel pitch along x and y.
    """
    divergence = np.diff(slopes_x, axis=1) / mm_per_px[0] + np.diff(slopes_y, axis=0) / mm_per_px[1]
    height, width = divergence.shape
    spectrum = fft.dstn(divergence, type=1, overwrite_x=True)
    spectrum /= eigenvalues(height, width, mm_per_px, "dirichlet", spectrum.dtype.char)
    depth: DepthMap = fft.idstn(spectrum, type=1, overwrite_x=True)
    return depth


def solve_neumann(slopes_x: SlopesX, slopes_y: SlopesY, mm_per_px: Pair) -> DepthMap:
    """Depth, of mean zero, that fits the slopes best; nothing is assumed at the border.

    Args:
        slopes_x: (h, w - 1), between horizontal neighbours.
        slopes_y: (h - 1, w), between vertical neighbours.
        mm_per_px: pixel pitch along x and y.
    """
    closed_x, closed_y = np.pad(slopes_x, ((0, 0), (1, 1))), np.pad(slopes_y, ((1, 1), (0, 0)))
    divergence = np.diff(closed_x, axis=1) / mm_per_px[0] + np.diff(closed_y, axis=0) / mm_per_px[1]
    height, width = divergence.shape
    spectrum = fft.dctn(divergence, type=2, overwrite_x=True)
    spectrum /= eigenvalues(height, width, mm_per_px, "neumann", spectrum.dtype.char)
    spectrum[0, 0] = 0
    depth: DepthMap = fft.idctn(spectrum, type=2, overwrite_x=True)
    return depth


@lru_cache(maxsize=8)
def eigenvalues(
    height: int, width: int, mm_per_px: Pair, boundary: Boundary, dtype: str
) -> Float[np.ndarray, "h w"]:
    """Eigenvalues of the five-point Laplacian, in mm^-2; the constant's zero is replaced by one.

    Do not write into them: they are kept.
    """

    def along(count: int, pitch_mm: float) -> Float[np.ndarray, " n"]:
        if boundary == "dirichlet":
            angles = np.pi * np.arange(1, count + 1) / (count + 1)
        else:
            angles = np.pi * np.arange(count) / count
        return -((2 * np.sin(angles / 2) / pitch_mm) ** 2)

    values = along(height, mm_per_px[1])[:, None] + along(width, mm_per_px[0])[None, :]
    if boundary == "neumann":
        values[0, 0] = 1
    return values.astype(dtype)


@lru_cache(maxsize=32)
def margins_px(count: int) -> tuple[int, int]:
    """Rows of flat gel before and after ``count`` samples, the zero ring included.

    A type-I sine transform of n samples is an FFT of length 2 (n + 1): a few more samples of
    flat gel turn a slow length (2 x 641 for 640 pixels) into a quick one (2 x 648).
    """
    added = fft.next_fast_len(count + 1, real=True) - (count + 1)
    before = added // 2
    return before + 1, added - before + 1
