# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Gaps between two point clouds of a skin, and how surely a motion that closes them is known.

Depth is integrated from slopes, so its noise is alike over millimetres, and many points say little
more than a few do.
"""

from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from jaxtyping import Float, Int

from recon.depth_error import depth_noise
from recon.poisson import eigenvalues
from recon.pose.rigid import Covariance, Points, Transform, Twist, applied
from sensor.toml import Pair

FARTHEST_MM = 0.5
"""Points farther apart are not the same place."""
FLATTENED = 1 - 1e-3
"""GICP takes a point for a Gaussian of variance 1 mm^2 along the surface and 1e-3 across it."""
CELL_MM = 0.25
"""Noise is summed over cells so wide; the waves of a fine texture still have several of them."""
LEAST_LEFT = 0.05
"""Of the noise's energy: a fit leaves so much of it in any case."""


@dataclass(frozen=True, kw_only=True)
class PointCloud:
    """Points with normals, a tree to find them by, and the frame that they are from."""

    cloud: Any
    tree: Any
    shape: tuple[int, int]
    """Height and width of the frame in pixels."""
    mm_per_px: Pair

    @property
    def points(self) -> Points:
        """(n, 3) in mm, gel frame."""
        return np.asarray(self.cloud.points())[:, :3]

    @property
    def normals(self) -> Points:
        """(n, 3), of either sign."""
        return np.asarray(self.cloud.normals())[:, :3]


@dataclass(frozen=True, kw_only=True)
class Gaps:
    """What lies between the reference's points, moved, and the current surface."""

    points: Points
    """(n, 3) of the reference, in mm."""
    gap_mm: Float[np.ndarray, " n"]
    """From a moved point to the plane through the nearest current one."""
    change: Float[np.ndarray, "n 6"]
    """By how much a twist x of ``T_current_reference @ motion(x)`` closes the gap."""
    upright: Float[np.ndarray, " n"]
    """By how much a change of depth opens it: z of the plane's normal."""
    weight: Float[np.ndarray, " n"]

    @property
    def information(self) -> Covariance:
        """Matrix of the normal equations, kept from being singular."""
        found = (self.weight * self.change.T) @ self.change
        return found + (1e-9 * np.trace(found) + 1e-12) * np.eye(6)

    def closing(self) -> Twist:
        """The twist that closes the gaps best."""
        pull = self.change.T @ (self.weight * self.gap_mm)
        twist: Twist = np.linalg.solve(self.information, pull)
        return twist

    def covariance(self, shape: tuple[int, int], mm_per_px: Pair) -> Covariance:
        """Of the twist that closes the gaps best, where depth is integrated from noisy slopes.

        Let gaps d have the weights W and change by J. White noise of the slopes, integrated, gives
        d the covariance s^2 C. The twist is H^-1 J'W d with H = J'W J, so its covariance and the
        expected d'W d that it leaves are

            s^2 H^-1 M H^-1,  M = J'W C W J,  and  s^2 (tr(W C) - tr(H^-1 M)).

        The latter, held against what is left, tells s. Independent noise, C = W = 1, has the
        well-known s^2 H^-1 with s^2 = d'd / (n - 6). Each second point gives the same as all.

        Args:
            shape: height and width in pixels of the frame that was integrated, zero around it.
            mm_per_px: its pixel pitch.
        """
        shares = (self.weight * self.upright)[:, None] * self.change
        sums = noise_of_sums(self.points, shares, shape, mm_per_px)
        inverse = np.linalg.inv(self.information)
        pixels = _cells(self.points, shape, mm_per_px, (1, 1))
        deviation = self.upright * depth_noise(shape, mm_per_px, "dirichlet")[pixels]
        energy = float(self.weight @ deviation**2)
        left = max(energy - float(np.trace(inverse @ sums)), LEAST_LEFT * energy)
        variance = float(self.weight @ self.gap_mm**2) / left
        found: Covariance = variance * inverse @ sums @ inverse
        return found


def gaps_between(
    reference: PointCloud,
    current: PointCloud,
    T_current_reference: Transform,
    *,
    gaussian: bool,
    every: int = 1,
) -> Gaps:
    """Gaps at every so many of the reference's points, where a surface is near.

    To the current points' planes with one weight for all; or between Gaussians as GICP has them
    (Segal, Haehnel and Thrun, RSS 2009): the sum of two that are flattened along the unit normals
    n and m varies least along n + m, by 2 - 0.999 (1 + n . m), and one over that is the weight.
    """
    points = reference.points[::every]
    moved = applied(T_current_reference, points)
    nearest, squared_mm = map(np.asarray, current.tree.batch_nearest_neighbor_search(moved))
    near = squared_mm < FARTHEST_MM**2
    points, moved, nearest = points[near], moved[near], nearest[near]
    rotation = T_current_reference[:3, :3]
    normal, weight = current.normals[nearest], np.ones(len(points))
    if gaussian:
        other = reference.normals[::every][near] @ rotation.T
        along = (normal * other).sum(1)
        normal = normal + np.sign(along)[:, None] * other
        normal /= np.linalg.norm(normal, axis=1, keepdims=True)
        weight = 1 / (2 - FLATTENED * (1 + np.abs(along)))
    back = normal @ rotation
    return Gaps(
        points=points,
        gap_mm=((current.points[nearest] - moved) * normal).sum(1),
        change=np.concatenate([np.cross(points, back), back], 1),
        upright=normal[:, 2],
        weight=weight,
    )


def noise_of_sums(
    points: Points, shares: Float[np.ndarray, "n k"], shape: tuple[int, int], mm_per_px: Pair
) -> Float[np.ndarray, "k k"]:
    """Covariance of k sums over depths at points, mm^2, for slopes with white noise of deviation 1.

    Integrated, that noise has the covariance (-L)^-1: L, the Laplacian of ``recon.poisson``, is
    diagonal in sines. The slopes' mean over a cell of b pixels varies by 1 / b, and so do depths.
    """
    side_px = max(1, round(CELL_MM / mm_per_px[0])), max(1, round(CELL_MM / mm_per_px[1]))
    row, column = _cells(points, shape, mm_per_px, side_px)
    height, width = -(-shape[0] // side_px[1]), -(-shape[1] // side_px[0])
    (top, left), (bottom, right) = ((f(row), f(column)) for f in (np.min, np.max))
    rows, columns = bottom + 1 - top, right + 1 - left
    cell = (row - top) * columns + column - left
    summed = np.stack([np.bincount(cell, share, rows * columns) for share in shares.T])
    down, across = _sines(height)[:, top : bottom + 1], _sines(width)[left : right + 1]
    waves = down @ (summed.reshape(-1, rows, columns) @ across)
    pitch_mm = side_px[0] * mm_per_px[0], side_px[1] * mm_per_px[1]
    waves /= np.sqrt(-eigenvalues(height, width, pitch_mm, "dirichlet", "d"))
    waves = waves.reshape(len(waves), -1)
    noise: np.ndarray = waves @ waves.T / (side_px[0] * side_px[1])
    return noise


@lru_cache(maxsize=8)
def _sines(count: int) -> Float[np.ndarray, "n n"]:
    """The type-I sine transform's orthonormal matrix; do not write into it, it is kept."""
    number = np.arange(1, count + 1)
    found: np.ndarray = np.sqrt(2 / (count + 1)) * np.sin(
        np.pi / (count + 1) * number[:, None] * number
    )
    return found


def _cells(
    points: Points, shape: tuple[int, int], mm_per_px: Pair, side_px: tuple[int, int]
) -> tuple[Int[np.ndarray, " n"], Int[np.ndarray, " n"]]:
    """Row and column of the cell, so many pixels wide and high, in which each point lies."""
    height, width = shape
    column, row = (
        np.clip((points[:, axis] / mm_per_px[axis] + count / 2).astype(int), 0, count - 1)
        // side_px[axis]
        for axis, count in ((0, width), (1, height))
    )
    return row, column
