# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Rays against triangle meshes: through Embree, or, where there is no wheel of it, one by one."""

import numpy as np
import trimesh
from numpy.typing import NDArray

try:
    from embreex.mesh_construction import TriangleMesh
    from embreex.rtcore_scene import EmbreeScene
except ImportError:  # Linux on ARM
    EmbreeScene = None

Array = NDArray[np.float64]
Hits = tuple[Array, NDArray[np.int64]]
_CHUNK = 2_000_000


def first_hits(mesh: trimesh.Trimesh, origins: Array, directions: Array) -> Hits:
    """First triangle that each ray strikes.

    Args:
        mesh: Triangles, seen from both sides.
        origins: (n, 3) in mm.
        directions: (n, 3) unit vectors.

    Returns:
        Distance in mm, infinite for none, (n,); and the triangle's index, -1 for none, (n,).
    """
    if EmbreeScene is None:
        return first_hits_one_by_one(mesh, origins, directions)
    scene = EmbreeScene()
    triangles = TriangleMesh(scene, np.asarray(mesh.triangles, np.float32))
    rays = (np.ascontiguousarray(values, np.float32) for values in (origins, directions))
    found = scene.run(*rays, output=True)
    del triangles  # the scene does not keep it alive
    struck = found["primID"].astype(np.int64)
    return np.where(struck < 0, np.inf, found["tfar"].astype(np.float64)), struck


def first_hits_one_by_one(mesh: trimesh.Trimesh, origins: Array, directions: Array) -> Hits:
    """The same by the test of Möller and Trumbore (1997) of every ray with every triangle."""
    corner = np.asarray(mesh.triangles, np.float64)
    first, second = corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]
    distance = np.full(len(origins), np.inf)
    struck = np.full(len(origins), -1, np.int64)
    rays = max(1, _CHUNK // max(1, len(corner)))
    for start in range(0, len(origins), rays):
        part = slice(start, start + rays)
        way = directions[part, None]
        across = np.cross(way, second)
        scale = np.einsum("rtk,tk->rt", across, first)
        with np.errstate(divide="ignore", invalid="ignore"):
            inverse = 1 / scale
            offset = origins[part, None] - corner[:, 0]
            u = np.einsum("rtk,rtk->rt", offset, across) * inverse
            turned = np.cross(offset, first)
            v = np.einsum("rtk,rtk->rt", np.broadcast_to(way, turned.shape), turned) * inverse
            far = np.einsum("rtk,tk->rt", turned, second) * inverse
            edge = 1e-9
            inside = (u >= -edge) & (v >= -edge) & (u + v <= 1 + edge) & (far > 0)
        far = np.where(inside, far, np.inf)
        nearest = far.argmin(axis=1)
        distance[part] = far[np.arange(len(far)), nearest]
        struck[part] = np.where(np.isfinite(distance[part]), nearest, -1)
    return distance, struck
