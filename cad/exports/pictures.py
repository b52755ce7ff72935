# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Pictures of meshes, drawn by VTK without a display."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import trimesh
import vtkmodules.vtkRenderingOpenGL2  # noqa: F401  (the renderer behind vtkRenderWindow)
from vtkmodules.util.numpy_support import numpy_to_vtk, numpy_to_vtkIdTypeArray
from vtkmodules.vtkCommonCore import vtkLogger, vtkPoints
from vtkmodules.vtkCommonDataModel import vtkCellArray, vtkPolyData
from vtkmodules.vtkFiltersCore import vtkFeatureEdges
from vtkmodules.vtkIOImage import vtkPNGWriter
from vtkmodules.vtkRenderingCore import (
    vtkActor,
    vtkLightKit,
    vtkPolyDataMapper,
    vtkRenderer,
    vtkRenderWindow,
    vtkWindowToImageFilter,
)

from cad.motions import Vector

FROM_ABOVE: Vector = (-0.75, -1.0, 0.75)
FROM_BELOW: Vector = (-0.75, -1.0, -0.75)
FROM_BEHIND: Vector = (0.9, -1.0, 0.6)
FROM_A_LOW_CORNER: Vector = (-0.45, -1.0, 0.35)
FROM_THE_SIDE: Vector = (0.0, -1.0, 0.0)
_SIZE_PX = (1200, 800)
_EDGES_DEG = 25.0


@dataclass(frozen=True)
class Item:
    """One mesh to draw: its colour (red, green, blue in 0 to 1)."""

    mesh: trimesh.Trimesh
    color: Vector
    edges: bool = True


class Painter:
    """One window, kept for all pictures: opening it is what takes long."""

    def __init__(self) -> None:
        vtkLogger.SetStderrVerbosity(vtkLogger.VERBOSITY_ERROR)  # it needs no X server, yet warns
        self._window = vtkRenderWindow()
        self._window.SetOffScreenRendering(1)
        self._window.SetSize(*_SIZE_PX)
        self._window.SetMultiSamples(4)
        self._window.SwapBuffersOff()  # a copy for a display: a third of the time

    def png(self, items: Iterable[Item], view: Vector = FROM_ABOVE, zoom: float = 1.0) -> bytes:
        """A picture in parallel projection, looking from ``view`` at all of the items."""
        renderer = vtkRenderer()
        renderer.SetBackground(1, 1, 1)
        for item in items:
            _add(renderer, item)
        lights = vtkLightKit()
        lights.SetKeyLightIntensity(0.9)
        lights.AddLightsToRenderer(renderer)
        camera = renderer.GetActiveCamera()
        camera.ParallelProjectionOn()
        camera.SetPosition(*view)
        camera.SetFocalPoint(0, 0, 0)
        camera.SetViewUp(0, 0, 1)
        renderer.ResetCamera()
        camera.SetParallelScale(_half_height(renderer) / zoom)
        self._window.AddRenderer(renderer)
        self._window.Render()
        content = self._read()
        self._window.RemoveRenderer(renderer)
        return content

    def _read(self) -> bytes:
        image = vtkWindowToImageFilter()
        image.SetInput(self._window)
        image.ReadFrontBufferOff()
        image.ShouldRerenderOff()
        writer = vtkPNGWriter()
        writer.WriteToMemoryOn()
        writer.SetInputConnection(image.GetOutputPort())
        writer.Write()
        return bytes(writer.GetResult())


def _half_height(renderer: vtkRenderer) -> float:
    """Half the height, in mm, of a picture that just holds everything drawn."""
    low_x, high_x, low_y, high_y, low_z, high_z = renderer.ComputeVisiblePropBounds()
    corners = np.array(
        [(x, y, z) for x in (low_x, high_x) for y in (low_y, high_y) for z in (low_z, high_z)]
    )
    camera = renderer.GetActiveCamera()
    forward = np.array(camera.GetDirectionOfProjection())
    right = np.cross(forward, camera.GetViewUp())
    right /= np.linalg.norm(right)
    up = np.cross(right, forward)
    offset = corners - np.array(camera.GetFocalPoint())
    wide = np.abs(offset @ right).max() * _SIZE_PX[1] / _SIZE_PX[0]
    return float(1.06 * max(wide, np.abs(offset @ up).max()))


def _add(renderer: vtkRenderer, item: Item) -> None:
    data = _poly_data(item.mesh)
    mapper = vtkPolyDataMapper()
    mapper.SetInputData(data)
    actor = vtkActor()
    actor.SetMapper(mapper)
    look = actor.GetProperty()
    look.SetColor(*item.color)
    look.SetInterpolationToFlat()
    look.SetAmbient(0.15)
    renderer.AddActor(actor)
    if item.edges:
        renderer.AddActor(_edges(data))


def _edges(data: vtkPolyData) -> vtkActor:
    sharp = vtkFeatureEdges()
    sharp.SetInputData(data)
    sharp.SetFeatureAngle(_EDGES_DEG)
    sharp.ColoringOff()
    mapper = vtkPolyDataMapper()
    mapper.SetInputConnection(sharp.GetOutputPort())
    mapper.ScalarVisibilityOff()
    mapper.SetResolveCoincidentTopologyToPolygonOffset()
    actor = vtkActor()
    actor.SetMapper(mapper)
    actor.GetProperty().SetColor(0.05, 0.05, 0.08)
    actor.GetProperty().SetLineWidth(1.5)
    actor.GetProperty().LightingOff()
    return actor


def _poly_data(mesh: trimesh.Trimesh) -> vtkPolyData:
    points = vtkPoints()
    points.SetData(numpy_to_vtk(np.ascontiguousarray(mesh.vertices, np.float64), deep=True))
    faces = np.asarray(mesh.faces, np.int64)
    cells = vtkCellArray()
    rows = np.column_stack([np.full(len(faces), 3), faces]).ravel()
    cells.SetCells(len(faces), numpy_to_vtkIdTypeArray(rows, deep=True))
    data = vtkPolyData()
    data.SetPoints(points)
    data.SetPolys(cells)
    return data


def tube(points: Sequence[Sequence[float]], radius: float) -> trimesh.Trimesh:
    """A line through points, thick enough to be seen."""
    pieces = [
        trimesh.creation.cylinder(radius, segment=np.array([start, end]), sections=8)
        for start, end in pairwise(points)
    ]
    joined = trimesh.util.concatenate(pieces)
    assert isinstance(joined, trimesh.Trimesh)
    return joined
