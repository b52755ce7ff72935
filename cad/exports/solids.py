# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""STEP, STL, 3MF and GLB, the same bytes for the same solid on every run."""

import io
import itertools
import re
import struct
import zipfile
from collections.abc import Callable, Mapping
from pathlib import Path
from tempfile import TemporaryDirectory

import cadquery as cq
import numpy as np
import trimesh
from OCP.Interface import Interface_Static
from OCP.STEPControl import STEPControl_AsIs, STEPControl_Writer

from cad.exports.step_colors import Color, with_colors

_TIME = "2021-06-21T00:00:00"
"""In place of the moment of writing, which would make every file differ."""


def step_of(solid: cq.Solid, name: str) -> bytes:
    """One solid as STEP AP214."""
    writer = STEPControl_Writer()
    Interface_Static.SetIVal_s("write.surfacecurve.mode", 1)
    writer.Transfer(solid.wrapped, STEPControl_AsIs)
    return _written(lambda path: writer.Write(str(path)), name)


def step_of_assembly(
    solids: Mapping[str, cq.Solid], name: str, colors: Mapping[str, Color]
) -> bytes:
    """Named solids in their places and colours."""
    name = _in_ascii(name)
    assembly = cq.Assembly(name=name)
    for key, solid in solids.items():
        assembly.add(solid, name=key)
    content = _written(lambda path: assembly.export(str(path), exportType="STEP"), name)
    return with_colors(content.decode("ascii"), colors.__getitem__).encode("ascii")


def _written(write: Callable[[Path], object], name: str) -> bytes:
    with TemporaryDirectory() as folder:
        path = Path(folder, "part.step")
        write(path)
        text = path.read_text(encoding="ascii")
    text = _renumbered(text)
    quoted = name.replace("'", "''")
    head = f"FILE_NAME('{quoted}','{_TIME}'"
    text = re.sub(r"FILE_NAME\('(?:[^']|'')*',\s*'[^']*'", lambda _: head, text, count=1)
    made_by = r"Open CASCADE STEP translator [\d.\s]*\d"
    return re.sub(made_by, lambda _: quoted, text).encode("ascii")


def _in_ascii(name: str) -> str:
    """Any other character by its code, as strings have it in ISO 10303-21, clause 6.4.3."""
    return re.sub(r"[^ -~]", lambda other: f"\\X4\\{ord(other[0]):08X}\\X0\\", name)


def _renumbered(text: str) -> str:
    """Occurrences in an assembly counted from 1: OCCT counts on from file to file of a process.

    Each goes on a line of its own, as the length of its number decides where OCCT breaks it.
    """
    numbers = itertools.count(1)

    def occurrence(match: re.Match[str]) -> str:
        rest = re.sub(r"\s*\n\s*", "", match[2])
        return f"{match[1]}'{next(numbers)}'{rest}"

    return re.sub(r"(NEXT_ASSEMBLY_USAGE_OCCURRENCE\()'\d+'([^;]*;)", occurrence, text)


def stl_of(mesh: trimesh.Trimesh) -> bytes:
    """Binary STL in mm."""
    count = len(mesh.faces)
    rows = np.zeros(
        count, dtype=[("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")]
    )
    rows["normal"] = mesh.face_normals
    rows["corners"] = mesh.triangles
    return b"GelSight Wedge, millimetres".ljust(80) + struct.pack("<I", count) + rows.tobytes()


def threemf_of(meshes: Mapping[str, trimesh.Trimesh]) -> bytes:
    """3MF core specification 1.3: one object a mesh, in mm, with fixed dates."""
    objects, items = [], []
    for number, (name, mesh) in enumerate(meshes.items(), start=1):
        points, corners = (np.asarray(mesh.vertices) + 0.0).tolist(), mesh.faces.tolist()
        vertices = "".join(f'<vertex x="{x:.6f}" y="{y:.6f}" z="{z:.6f}"/>' for x, y, z in points)
        triangles = "".join(f'<triangle v1="{a}" v2="{b}" v3="{c}"/>' for a, b, c in corners)
        objects.append(
            f'<object id="{number}" type="model" name="{name}"><mesh><vertices>{vertices}'
            f"</vertices><triangles>{triangles}</triangles></mesh></object>"
        )
        items.append(f'<item objectid="{number}"/>')
    model = (
        '<?xml version="1.0" encoding="UTF-8"?>\n<model unit="millimeter" xml:lang="en-US"'
        ' xmlns="http://schemas.microsoft.com/3dmanufacturing/core/2015/02">'
        f"<resources>{''.join(objects)}</resources><build>{''.join(items)}</build></model>"
    )
    return _zipped(
        {"[Content_Types].xml": _TYPES, "_rels/.rels": _RELATIONS, "3D/3dmodel.model": model}
    )


_TYPES = (
    '<?xml version="1.0" encoding="UTF-8"?>\n'
    '<Types xmlns="http://schemas.openxmlformats.org/package/2006/content-types">'
    '<Default Extension="rels"'
    ' ContentType="application/vnd.openxmlformats-package.relationships+xml"/>'
    '<Default Extension="model"'
    ' ContentType="application/vnd.ms-package.3dmanufacturing-3dmodel+xml"/>'
    "</Types>"
)
_RELATIONS = (
    '<?xml version="1.0" encoding="UTF-8"?>\n'
    '<Relationships xmlns="http://schemas.openxmlformats.org/package/2006/relationships">'
    '<Relationship Target="/3D/3dmodel.model" Id="rel0"'
    ' Type="http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel"/></Relationships>'
)


def _zipped(files: Mapping[str, str]) -> bytes:
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED, compresslevel=6) as archive:
        for name, text in files.items():
            entry = zipfile.ZipInfo(name, date_time=(1980, 1, 1, 0, 0, 0))
            entry.compress_type = zipfile.ZIP_DEFLATED
            entry.external_attr = 0o644 << 16
            archive.writestr(entry, text)
    return stream.getvalue()


_IN_GLTF = np.array(
    [[1e-3, 0.0, 0.0, 0.0], [0.0, 0.0, 1e-3, 0.0], [0.0, -1e-3, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]]
)
"""From mm with z up to what glTF 2.0 (section 3.4) is: metres with y up. A turn by -90° about x."""


def glb_of(meshes: Mapping[str, tuple[trimesh.Trimesh, Color]]) -> bytes:
    """All bodies in their places with their colours, for viewers.

    The meshes keep their mm and their z; one node above them makes metres of them, y up.
    """
    scene = trimesh.Scene()
    scene.graph.update(frame_to="sensor", matrix=_IN_GLTF)
    for name, (mesh, color) in meshes.items():
        painted = mesh.copy()
        painted.visual = trimesh.visual.TextureVisuals(
            material=trimesh.visual.material.PBRMaterial(
                name=name, baseColorFactor=[*color, 1.0], metallicFactor=0.0, roughnessFactor=0.7
            )
        )
        scene.add_geometry(painted, node_name=name, geom_name=name, parent_node_name="sensor")
    content = scene.export(file_type="glb")
    assert isinstance(content, bytes)
    return content
