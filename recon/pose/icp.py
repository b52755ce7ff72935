# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Alignment of point clouds by small_gicp: the paper's way to track, and the measure for ours."""

from dataclasses import dataclass
from typing import Any, ClassVar, Literal

import cv2
import numpy as np

from recon.pose.cells import coarse, noise_between
from recon.pose.gaps import FARTHEST_MM, IndexedCloud, gaps_between
from recon.pose.registration import PRIOR, Alignment, Touch, contact_points
from recon.pose.rigid import Transform, motion
from sensor.errors import WedgeError
from sensor.extras import how_to_install

MOST_POINTS = 5000
GOLDEN = (np.sqrt(5) - 1) / 2
"""The golden ratio spreads the points that are kept: every n-th pixel could fall into columns, and
a point's neighbours in one column do not span a plane."""
NEIGHBORS = 10
STEPS = 30
STILL_RAD, STILL_MM = float(np.radians(0.1)), 1e-3
"""A shorter step is the last; small_gicp's own limits."""
LEAST_POINTS = 20
COVARIANCE_POINTS = 1000
"""Points that tell the covariance as well as all would."""


@dataclass(frozen=True, kw_only=True)
class Icp:
    """Iterated closest points: to planes, or between Gaussians (GICP)."""

    kind: Literal["PLANE_ICP", "GICP"]
    spacing_mm: float = 0.06
    """Points are thinned to about this distance."""
    prepares: ClassVar[type] = IndexedCloud

    def prepare(self, touch: Touch) -> IndexedCloud:
        """Points of the contact, thinned, with normals from their neighbours.

        Raises:
            WedgeError: small_gicp is not installed.
        """
        small_gicp = _small_gicp()
        points = contact_points(touch)
        share = 1 / max(1, -(-len(points) // MOST_POINTS))
        points = points[np.arange(len(points)) * GOLDEN % 1 < share]
        cloud, tree = small_gicp.preprocess_points(points, self.spacing_mm, NEIGHBORS, 1)
        return IndexedCloud(
            cloud=cloud,
            tree=tree,
            shape=touch.contact.shape,
            mm_per_px=touch.mm_per_px,
            slopes=cv2.blur(np.ascontiguousarray(touch.gradient), (3, 3)),
            coarse=coarse(touch),
        )

    def align(
        self, reference: IndexedCloud, current: IndexedCloud, T_current_reference: Transform
    ) -> Alignment:
        """Motion that brings the reference's points onto the current surface."""
        if min(reference.cloud.size(), current.cloud.size()) < LEAST_POINTS:
            return _unknown(T_current_reference)
        gaussian = self.kind == "GICP"
        align = _between_gaussians if gaussian else _to_planes
        found = align(reference, current, T_current_reference)
        every = -(-reference.cloud.size() // COVARIANCE_POINTS)
        left = gaps_between(reference, current, found, gaussian=gaussian, every=every)
        if len(left.points) < LEAST_POINTS:
            return _unknown(found)
        noise = noise_between(reference.coarse, current.coarse, found)
        covariance = left.covariance(reference, current, noise)
        return Alignment(T_current_reference=found, covariance=covariance)


def _unknown(guess: Transform) -> Alignment:
    return Alignment(T_current_reference=guess, covariance=PRIOR.copy())


def _to_planes(reference: IndexedCloud, current: IndexedCloud, guess: Transform) -> Transform:
    """Gauss-Newton on the distances from planes.

    small_gicp 1.0.1 multiplies a distance's coordinates by the normal's one by one and does not
    sum them up: so each point is held beside its nearest one, and hardly shifts along the surface.
    """
    for _ in range(STEPS):
        left = gaps_between(reference, current, guess, gaussian=False)
        if len(left.points) < LEAST_POINTS:
            break
        twist = left.closing()
        guess = guess @ motion(twist)
        if np.linalg.norm(twist[:3]) < STILL_RAD and np.linalg.norm(twist[3:]) < STILL_MM:
            break
    return guess


def _between_gaussians(
    reference: IndexedCloud, current: IndexedCloud, guess: Transform
) -> Transform:
    found = _small_gicp().align(
        current.cloud,
        reference.cloud,
        current.tree,
        guess,
        registration_type="GICP",
        max_correspondence_distance=FARTHEST_MM,
        max_iterations=STEPS,
        rotation_epsilon=STILL_RAD,
        translation_epsilon=STILL_MM,
        num_threads=1,
    )
    return np.asarray(found.T_target_source)


def _small_gicp() -> Any:
    try:
        import small_gicp
    except ImportError as error:
        raise WedgeError(
            f"ICP needs small_gicp: {how_to_install('track')}, or track with joint."
        ) from error
    return small_gicp
