# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Closed triangle meshes of solids, accurate to an absolute distance."""

import cadquery as cq
import numpy as np
import trimesh
from OCP.BRep import BRep_Tool
from OCP.BRepMesh import BRepMesh_IncrementalMesh
from OCP.BRepTools import BRepTools
from OCP.TopAbs import TopAbs_REVERSED
from OCP.TopLoc import TopLoc_Location

DEFLECTION_MM = 0.005
ANGLE_RAD = 0.1
"""A curved face is split until its facets turn by less than this."""


def mesh_of(solid: cq.Solid) -> trimesh.Trimesh:
    """Mesh a solid to within 0.005 mm; faces share their vertices.

    CadQuery's own exporter measures the distance relative to each edge's length, which puts
    0.2 mm of error into the gel's mold.
    """
    BRepTools.Clean_s(solid.wrapped)
    BRepMesh_IncrementalMesh(solid.wrapped, DEFLECTION_MM, False, ANGLE_RAD, False)
    vertices: list[np.ndarray] = []
    triangles: list[np.ndarray] = []
    count = 0
    for face in solid.Faces():
        location = TopLoc_Location()
        patch = BRep_Tool.Triangulation_s(face.wrapped, location)
        move = location.Transformation()
        nodes = [patch.Node(i + 1).Transformed(move) for i in range(patch.NbNodes())]
        vertices.append(np.array([(node.X(), node.Y(), node.Z()) for node in nodes]))
        corners = np.array([patch.Triangle(i + 1).Get() for i in range(patch.NbTriangles())])
        if face.wrapped.Orientation() == TopAbs_REVERSED:
            corners = corners[:, ::-1]
        triangles.append(corners - 1 + count)
        count += len(nodes)
    return _merged(np.concatenate(vertices), np.concatenate(triangles))


def _merged(vertices: np.ndarray, triangles: np.ndarray) -> trimesh.Trimesh:
    """Join the vertices that neighbouring faces have in common, in order of first use."""
    keys = np.round(vertices, 7) + 0.0
    _, first, inverse = np.unique(keys, axis=0, return_index=True, return_inverse=True)
    order = np.argsort(first)
    rank = np.empty_like(order)
    rank[order] = np.arange(len(order))
    joined = rank[inverse.ravel()][triangles]
    a, b, c = joined.T
    whole = (a != b) & (b != c) & (c != a)
    return trimesh.Trimesh(keys[first[order]], joined[whole], process=False)
