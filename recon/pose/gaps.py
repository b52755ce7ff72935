# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Gaps between two point clouds of a skin, and how surely a motion that closes them is known.

Depth is integrated from slopes, so its noise is alike over millimetres, and many points say little
more than a few do.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float

from recon.arrays import GradientField
from recon.ball import normals
from recon.pose.cells import LENGTHS_MM, Coarse, Variances
from recon.pose.noise import depth_variances, pixels, sums_in_waves, wave_variances
from recon.pose.registration import prior_root
from recon.pose.rigid import Covariance, Points, Transform, Twist, applied
from sensor.toml import Pair

FARTHEST_MM = 0.5
"""Points farther apart are not the same place."""
FLATTENED = 1 - 1e-3
"""GICP takes a point for a Gaussian of variance 1 mm^2 along the surface and 1e-3 across it."""
LEAST_LEFT = 0.05
"""Of the noise's energy: a fit leaves so much of it in any case."""
LEAST_ALIKE = 0.5
"""Correlation of what two touches show of a motion: with less, they show more noise than motion."""


@dataclass(frozen=True, kw_only=True)
class IndexedCloud:
    """Points with normals, a tree to find them by, and the frame that they are from."""

    cloud: Any
    tree: Any
    shape: tuple[int, int]
    """Height and width of the frame in pixels."""
    mm_per_px: Pair
    slopes: GradientField
    """Of the frame, means of three by three pixels: normals that no choice of neighbours bends."""
    coarse: Coarse

    @property
    def points(self) -> Points:
        """(n, 3) in mm, gel frame."""
        return np.asarray(self.cloud.points())[:, :3]

    @property
    def normals(self) -> Points:
        """(n, 3), of either sign."""
        return np.asarray(self.cloud.normals())[:, :3]

    def upright_normals(self, points: Points) -> Points:
        """(n, 3), by the slopes of the pixels in which points lie."""
        slopes = self.slopes[pixels(points, self.shape, self.mm_per_px)]
        return normals(slopes[None])[0]


@dataclass(frozen=True, kw_only=True)
class Gaps:
    """What lies between the reference's points, moved, and the current surface."""

    points: Points
    """(n, 3) of the reference, in mm."""
    nearest: Points
    """(n, 3) of the current touch."""
    rotation: Float[np.ndarray, "3 3"]
    """From the reference to the current touch."""
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

    def covariance(
        self, reference: IndexedCloud, current: IndexedCloud, noise: Variances | None
    ) -> Covariance:
        """Of the twist that closes the gaps best, where depth is integrated from noisy slopes.

        Let gaps d have the weights W and change by J. Errors of the slopes, integrated, give d the
        covariance C. The twist is H^-1 J'W d with H = J'W J, so its covariance and the expected
        d'W d that it leaves are

            H^-1 M H^-1,  M = J'W C W J,  and  tr(W C) - tr(H^-1 M).

        Where more than the latter is left, noise is so much larger. Independent noise, C = W = 1,
        has the well-known s^2 H^-1 with s^2 = d'd / (n - 6). Each second point gives the same as
        all. A motion that is not seen (``unseen``) is as uncertain as before the touch.

        Args:
            reference: the one touch; its frame was integrated with zero around it.
            current: the other.
            noise: of both touches' slopes together; ``None`` where nobody knows: then it is white,
                and of the size that is left tells.
        """
        shape, mm_per_px = reference.shape, reference.mm_per_px
        known = np.eye(len(LENGTHS_MM))[0] if noise is None else noise
        shares = (self.weight * self.upright)[:, None] * self.change
        waves = sums_in_waves(self.points, shares[None], shape, mm_per_px)
        sums = waves * (known @ wave_variances(shape, mm_per_px)) @ waves.T
        place = pixels(self.points, shape, mm_per_px)
        variances = known @ depth_variances(shape, mm_per_px)[:, *place]
        energy = float((self.weight * self.upright**2) @ variances)
        inverse = np.linalg.inv(self.information)
        left = max(energy - float(np.trace(inverse @ sums)), LEAST_LEFT * energy)
        growth = float(self.weight @ self.gap_mm**2) / left
        if noise is not None:
            growth = max(growth, 1.0)
        unseen = self.unseen(reference, current)
        found: Covariance = growth * inverse @ sums @ inverse + unseen @ unseen.T
        return found

    def unseen(self, reference: IndexedCloud, current: IndexedCloud) -> Float[np.ndarray, "6 u"]:
        """Twists, in columns, that the touches do not show, as long as they may be before a touch.

        Noise of the planes' normals makes every motion look seen, also one along an edge that
        crosses the frame. Slopes of two touches err independently: what only noise shows of a
        motion is not the same in both.
        """
        ours, theirs = (
            np.concatenate([np.cross(self.points, normal), normal], 1)
            for normal in (
                reference.upright_normals(self.points),
                current.upright_normals(self.nearest) @ self.rotation,
            )
        )
        both = (self.weight * ours.T) @ theirs
        each = ((self.weight * ours.T) @ ours + (self.weight * theirs.T) @ theirs) / 2
        root = np.linalg.inv(np.linalg.cholesky(each + 1e-12 * np.trace(each) * np.eye(6)))
        shares, axes = np.linalg.eigh(root @ (both + both.T) @ root.T / 2)
        twists = root.T @ axes[:, shares < LEAST_ALIKE]
        lengths = np.linalg.norm(np.linalg.solve(prior_root(self.points.mean(0)), twists), axis=0)
        found: np.ndarray = twists / lengths
        return found


def gaps_between(
    reference: IndexedCloud,
    current: IndexedCloud,
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
        nearest=current.points[nearest],
        rotation=rotation,
        gap_mm=((current.points[nearest] - moved) * normal).sum(1),
        change=np.concatenate([np.cross(points, back), back], 1),
        upright=normal[:, 2],
        weight=weight,
    )
