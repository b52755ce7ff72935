# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Alignment of point clouds by small_gicp: the paper's way to track, and the measure for ours."""

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from recon.pose.registration import Alignment, Touch, contact_points
from recon.pose.rigid import Covariance, Transform
from sensor.errors import WedgeError

MOST_POINTS = 5000
NEIGHBOURS = 10
FARTHEST_MM = 0.5
"""Points farther apart are not the same place."""
STEPS = 30
LEAST_POINTS = 20


@dataclass(frozen=True, kw_only=True)
class PointCloud:
    """Points with normals, and a tree to find them by."""

    cloud: Any
    tree: Any


@dataclass(frozen=True, kw_only=True)
class Icp:
    """Iterated closest points: to planes, or between Gaussians (GICP)."""

    kind: Literal["PLANE_ICP", "GICP"]
    spacing_mm: float = 0.06
    """Points are thinned to about this distance."""

    def prepare(self, touch: Touch) -> PointCloud:
        """Points of the contact, thinned, with normals from their neighbours.

        Raises:
            WedgeError: small_gicp is not installed.
        """
        small_gicp = _small_gicp()
        points = contact_points(touch)
        points = points[:: max(1, -(-len(points) // MOST_POINTS))]
        cloud, tree = small_gicp.preprocess_points(points, self.spacing_mm, NEIGHBOURS, 1)
        return PointCloud(cloud=cloud, tree=tree)

    def align(
        self, reference: PointCloud, current: PointCloud, T_current_reference: Transform
    ) -> Alignment:
        """Motion that brings the reference's points onto the current surface."""
        small_gicp = _small_gicp()
        if min(reference.cloud.size(), current.cloud.size()) < LEAST_POINTS:
            return Alignment(
                T_current_reference=T_current_reference, covariance=np.diag(np.full(6, np.inf))
            )
        found = small_gicp.align(
            current.cloud,
            reference.cloud,
            current.tree,
            T_current_reference,
            registration_type=self.kind,
            max_correspondence_distance=FARTHEST_MM,
            max_iterations=STEPS,
            num_threads=1,
        )
        return Alignment(
            T_current_reference=np.asarray(found.T_target_source),
            covariance=_covariance(found),
        )


def _covariance(found: Any) -> Covariance:
    """From the normal equations and the mean square that is left; pairs count as independent."""
    pairs = max(int(found.num_inliers), 7)
    variance = 2 * float(found.error) / (pairs - 6)
    damped = np.asarray(found.H) + 1e-9 * np.trace(found.H) * np.eye(6) + 1e-12 * np.eye(6)
    return variance * np.linalg.inv(damped)


def _small_gicp() -> Any:
    try:
        import small_gicp
    except ImportError as error:
        raise WedgeError(
            'ICP needs small_gicp: pip install "gelsight-wedge[track]", or track with joint.'
        ) from error
    return small_gicp
