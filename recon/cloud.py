# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""The skin as points and as a mesh, in mm in the gel frame: x right, y down, z out of the gel.

A point is ``(x, y, rest - depth)``, where the skin at rest lies at z = 0 or on the design's curved
gel. Its uncertainty is along z: what the slopes' errors become when they are integrated, where the
estimator knows them.
"""

from dataclasses import dataclass, fields
from typing import Protocol

import numpy as np
from jaxtyping import Bool, Float32, Int32

from recon.arrays import DepthMap, GradientField
from recon.ball import normals
from recon.depth_error import depth_error
from recon.integration.poisson import Boundary
from recon.pose.registration import Touch, pixel_grid_mm
from recon.pose.rest import rest_of
from sensor.design import Gel


class Skin(Touch, Protocol):
    """What a cloud needs of a frame; a ``Reconstruction`` and a ``recon.fast.Touch`` are one."""

    @property
    def boundary(self) -> Boundary:
        """What the depth was integrated with."""

    @property
    def disturbed(self) -> Bool[np.ndarray, "_ _"]:
        """Where the colour changed; of as many pixels as the frame, or of its quarter."""

    @property
    def slope_error(self) -> GradientField | None:
        """Standard deviation expected of each slope's error; ``None`` where it is not known."""


@dataclass(frozen=True, kw_only=True)
class PointCloud:
    """Points of the skin in the gel frame, mm."""

    points_mm: Float32[np.ndarray, "n 3"]
    """x, y and z in the gel frame."""
    normals: Float32[np.ndarray, "n 3"]
    """Unit length, out of the gel."""
    sigma_mm: Float32[np.ndarray, " n"]
    """Standard deviation expected along z; NaN where the slopes' errors are not known."""
    contact: Bool[np.ndarray, " n"]
    """Where something touches."""

    def __len__(self) -> int:
        """Number of points."""
        return len(self.points_mm)

    def __getitem__(self, chosen: np.ndarray) -> "PointCloud":
        """The chosen points."""
        return PointCloud(**{item.name: getattr(self, item.name)[chosen] for item in fields(self)})


@dataclass(frozen=True, kw_only=True)
class Mesh:
    """A cloud whose points are joined."""

    cloud: PointCloud
    """Its points, in mm."""
    triangles: Int32[np.ndarray, "m 3"]
    """Corners counted so that they turn anticlockwise when seen from outside the gel."""


def point_cloud(touch: Skin, gel: Gel | None = None) -> PointCloud:
    """Every pixel of a reconstruction as a point, row by row.

    Args:
        touch: one frame's.
        gel: lays the skin at rest on this gel's curve; by default it is flat.

    Raises:
        WedgeError: the frame reaches beyond the gel's curve.
    """
    height, width = touch.depth_mm.shape
    x, y = np.meshgrid(*pixel_grid_mm((width, height), touch.mm_per_px))
    rest = rest_of(gel, (width, height), touch.mm_per_px)
    below_mm = touch.depth_mm + rest.depth_mm
    return PointCloud(
        points_mm=np.stack([x, y, -below_mm], -1).reshape(-1, 3).astype(np.float32),
        normals=normals(touch.gradient + rest.gradient).reshape(-1, 3).astype(np.float32),
        sigma_mm=expected_error_mm(touch).ravel().astype(np.float32),
        contact=touch.contact.ravel(),
    )


def expected_error_mm(touch: Skin) -> DepthMap:
    """Standard deviation expected of every depth's error, as in ``PointCloud.sigma_mm``."""
    error = touch.slope_error
    if error is None:
        return np.full(touch.depth_mm.shape, np.nan)
    return depth_error(error, touch.mm_per_px, touch.boundary)


def skin_mesh(touch: Skin, gel: Gel | None = None) -> Mesh:
    """The whole skin as triangles, two to a square of pixels; arguments as above."""
    height, width = touch.depth_mm.shape
    number = np.arange(height * width, dtype=np.int32).reshape(height, width)
    corners = (number[:-1, :-1], number[:-1, 1:], number[1:, 1:], number[1:, :-1])
    top_left, top_right, bottom_right, bottom_left = (corner.ravel() for corner in corners)
    # y points down, z toward the viewer's side of x right and y down: clockwise in the picture.
    triangles = np.concatenate(
        [
            np.stack([top_left, top_right, bottom_right], 1),
            np.stack([top_left, bottom_right, bottom_left], 1),
        ]
    )
    return Mesh(cloud=point_cloud(touch, gel), triangles=triangles)
