# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Rays against triangle meshes, through Embree."""

import numpy as np
import trimesh
from embreex.mesh_construction import TriangleMesh
from embreex.rtcore_scene import EmbreeScene
from numpy.typing import NDArray

Array = NDArray[np.float64]


class Scene:
    """One mesh that rays may strike."""

    def __init__(self, mesh: trimesh.Trimesh) -> None:
        self._scene = EmbreeScene()
        self._mesh = TriangleMesh(self._scene, np.asarray(mesh.triangles, np.float32))

    def distance(self, origins: Array, directions: Array) -> Array:
        """Distance to the first hit of (n, 3) rays with unit directions; infinite for none."""
        hit = self._run(origins, directions, "DISTANCE").astype(np.float64)
        return np.where(hit > 1e30, np.inf, hit)

    def triangle(self, origins: Array, directions: Array) -> NDArray[np.int64]:
        """Index of the first triangle hit, -1 for none, (n,)."""
        return self._run(origins, directions, "INTERSECT").astype(np.int64)

    def _run(self, origins: Array, directions: Array, query: str) -> np.ndarray:
        return np.asarray(
            self._scene.run(
                np.ascontiguousarray(origins, np.float32),
                np.ascontiguousarray(directions, np.float32),
                query=query,
            )
        )
