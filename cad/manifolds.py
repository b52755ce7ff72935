# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Triangle meshes as bodies that can be intersected, and back."""

import manifold3d
import numpy as np
import trimesh


def manifold_of(mesh: trimesh.Trimesh) -> manifold3d.Manifold:
    """The mesh as a body that can be intersected exactly."""
    return manifold3d.Manifold(
        manifold3d.Mesh64(
            vert_properties=np.asarray(mesh.vertices, np.float64),
            tri_verts=np.asarray(mesh.faces, np.uint64),
        )
    )


def mesh_of_manifold(body: manifold3d.Manifold) -> trimesh.Trimesh:
    """The triangles of a body that was intersected or cut."""
    mesh = body.to_mesh64()
    return trimesh.Trimesh(mesh.vert_properties[:, :3], mesh.tri_verts, process=False)
