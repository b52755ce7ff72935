# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""A triangle mesh pressed into ideal gel: the depth and the slopes of its underside."""

import logging
from dataclasses import dataclass, replace
from pathlib import Path

import cv2
import numpy as np
from jaxtyping import Float, Int

from recon.arrays import DepthMap, GradientField
from recon.contact.disturbed import boundary_of
from recon.integration.poisson import integrate
from recon.medians import median
from recon.pose.registration import OwnTouch, pixel_grid_mm
from recon.pose.rest import lifted, rest_of
from recon.pose.rigid import Points, Transform, applied
from sensor.design import Gel
from sensor.errors import WedgeError
from sensor.extras import how_to_install
from sensor.toml import Pair

SMALLEST_MM = 1.0
"""Smaller things are most likely given in metres."""
LARGEST_MM = 2000.0
MOST_TRIANGLES = 500_000
MOST_PAIRS = 20_000_000
"""Of triangles and pixels in one picture."""
CONTACT_DEPTH_MM = 0.04
SUBPIXELS = 2
"""Along each side of a pixel that averages over its area."""
HAIR_PX = 1e-6
"""What rounding may take from a triangle's extent."""


@dataclass(frozen=True, kw_only=True)
class Mesh:
    """Triangles of an object, in mm, in the object's frame."""

    vertices_mm: Float[np.ndarray, "v 3"]
    triangles: Int[np.ndarray, "t 3"]

    def __post_init__(self) -> None:
        """Refuse what cannot be an object in mm.

        Raises:
            WedgeError: no triangle, a number that is none, or a size beyond sense.
        """
        if not len(self.triangles) or len(self.triangles) > MOST_TRIANGLES:
            raise WedgeError(
                f"the mesh has {len(self.triangles)} triangles: give one of 1 to {MOST_TRIANGLES}."
            )
        if self.triangles.min() < 0 or self.triangles.max() >= len(self.vertices_mm):
            raise WedgeError("the mesh has triangles whose corners are missing: export it again.")
        if not np.isfinite(self.vertices_mm).all():
            raise WedgeError("the mesh has corners that are not finite: export it again.")
        size_mm = float(np.ptp(self.vertices_mm, axis=0).max())
        if size_mm == 0:
            raise WedgeError("all corners of the mesh are one point: export it again.")
        if size_mm < SMALLEST_MM:
            raise WedgeError(
                f"the mesh is only {size_mm:.3g} mm across: it seems to be in metres, inches or "
                "centimetres; scale it to mm."
            )
        if size_mm > LARGEST_MM:
            raise WedgeError(f"the mesh is {size_mm:.3g} mm across: its unit is not mm; scale it.")


@dataclass(frozen=True, kw_only=True)
class MeshTouch(OwnTouch):
    """What the gel would show of a mesh."""

    unseen_mm: float = 0.0
    """Of its mean depth, what its slopes do not show where sides are steeper than pixels tell."""


def read_mesh(path: Path) -> Mesh:
    """A mesh from an STL, PLY or OBJ file in mm.

    Raises:
        WedgeError: the file is missing or damaged, holds no triangles or is not in mm, or trimesh
            is not installed.
    """
    try:
        import trimesh
    except ImportError as error:
        raise WedgeError(f"meshes need trimesh: {how_to_install('track')}.") from error
    kind = path.suffix.lower().lstrip(".")
    if kind not in ("stl", "ply", "obj"):
        raise WedgeError(f"{path} is not an STL, PLY or OBJ file.")
    logging.getLogger("trimesh").setLevel(logging.CRITICAL)  # it prints what it passes over
    try:
        with path.open("rb") as stream:
            loaded = trimesh.load_mesh(stream, file_type=kind, process=False)
        vertices = np.asarray(loaded.vertices, float).reshape(-1, 3)
        faces = np.asarray(loaded.faces, np.int64).reshape(-1, 3)
    except OSError as error:
        raise WedgeError(f"{path} cannot be read: {error.strerror or error}.") from error
    except Exception as error:  # the readers raise whatever a damaged file leads them to
        raise WedgeError(f"{path} cannot be read as {kind.upper()}: export it again.") from error
    if faces.size and 0 <= faces.min() and faces.max() < len(vertices):
        # A corner that no triangle has is nothing that could touch.
        used, places = np.unique(faces, return_inverse=True)
        vertices, faces = vertices[used], places.reshape(-1, 3)
    try:
        return Mesh(vertices_mm=vertices, triangles=faces)
    except WedgeError as error:
        raise WedgeError(f"{path}: {error}") from error


def render(
    mesh: Mesh,
    T_sensor_object: Transform,
    size_px: tuple[int, int],
    mm_per_px: Pair,
    gel: Gel | None = None,
) -> MeshTouch:
    """The mesh seen from inside the gel: at every pixel its lowest point.

    Args:
        mesh: the object.
        T_sensor_object: its pose.
        size_px: width and height.
        mm_per_px: pixel pitch.
        gel: the curved gel that the mesh is pressed on; by default it is flat.

    Raises:
        WedgeError: too many large triangles lie above each other, or the frame reaches beyond the
            gel's curve.
    """
    width, height = size_px
    x_mm, y_mm = pixel_grid_mm(size_px, mm_per_px)
    points = applied(T_sensor_object, mesh.vertices_mm)
    below = (points[:, 2] < 0)[mesh.triangles]
    # Most of a mesh hovers above the gel; numpy adds up short rows slowly, so they are spelled out.
    corners = points[mesh.triangles[below[:, 0] | below[:, 1] | below[:, 2]]]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    level = np.abs(normals[:, 2]) > 1e-12
    corners, normals = corners[level], normals[level]
    slopes = -normals[:, :2] / normals[:, 2:]  # of z along x and y
    low, high = _below(corners)
    start, pitch = np.array([x_mm[0], y_mm[0]]), np.array(mm_per_px)
    first = np.ceil((low - start) / pitch - HAIR_PX).T
    last = np.floor((high - start) / pitch + HAIR_PX).T
    first = np.clip(first, 0, np.array([[width], [height]])).astype(np.int64)
    last = np.clip(last, -1, np.array([[width - 1], [height - 1]])).astype(np.int64)
    counts = np.maximum(last - first + 1, 0)
    pairs = counts[0] * counts[1]
    if pairs.sum() > MOST_PAIRS:
        raise WedgeError("the mesh has too many large triangles above each other: simplify it.")
    triangle, row = _counted(first[1], np.where(counts[0] > 0, counts[1], 0))
    left, right = _ends(corners, triangle, y_mm[row])
    from_column = np.ceil((left - x_mm[0]) / mm_per_px[0] - HAIR_PX)
    to_column = np.floor((right - x_mm[0]) / mm_per_px[0] + HAIR_PX)
    from_column = np.maximum(from_column, first[0][triangle]).astype(np.int64)
    to_column = np.minimum(to_column, last[0][triangle]).astype(np.int64)
    line, column = _counted(from_column, np.maximum(to_column - from_column + 1, 0))
    corner, slope = corners[triangle, 0], slopes[triangle]
    start_mm = (slope * corner[:, :2]).sum(1) - corner[:, 2] - slope[:, 1] * y_mm[row]
    depth_mm = start_mm[line] - slope[line, 0] * x_mm[column]
    rest, pixel = rest_of(gel, size_px, mm_per_px), row[line] * width + column
    deepest_mm = rest.depth_mm.astype(float).ravel()
    below = depth_mm > deepest_mm[pixel]
    line, depth_mm, pixel = line[below], depth_mm[below], pixel[below]
    np.maximum.at(deepest_mm, pixel, depth_mm)
    front = depth_mm == deepest_mm[pixel]
    depth: DepthMap = deepest_mm.astype(np.float32).reshape(height, width)
    gradient: GradientField = rest.gradient.copy()
    gradient.reshape(-1, 2)[pixel[front]] = -slope[line[front]]
    contact = depth - rest.depth_mm > CONTACT_DEPTH_MM
    return MeshTouch(
        gradient=gradient, depth_mm=depth, contact=contact, mm_per_px=mm_per_px, gel=gel
    )


def averaged(
    mesh: Mesh,
    T_sensor_object: Transform,
    size_px: tuple[int, int],
    mm_per_px: Pair,
    gel: Gel | None = None,
) -> MeshTouch:
    """The mesh as a camera sees it, whose pixels average over their area.

    Slopes at the pixels' middles would tell no more of where an edge runs than through which
    pixels. Arguments are those of ``render``.

    Raises:
        WedgeError: as ``render``.
    """
    fine_px = SUBPIXELS * size_px[0], SUBPIXELS * size_px[1]
    fine_mm = mm_per_px[0] / SUBPIXELS, mm_per_px[1] / SUBPIXELS
    fine = render(mesh, T_sensor_object, fine_px, fine_mm, gel)
    gradient, depth, share = (
        cv2.resize(values, size_px, interpolation=cv2.INTER_AREA)
        for values in (fine.gradient, fine.depth_mm, fine.contact.astype(np.float32))
    )
    contact = share >= 0.5
    touch = MeshTouch(
        gradient=gradient, depth_mm=depth, contact=contact, mm_per_px=mm_per_px, gel=gel
    )
    boundary, pressed = boundary_of(contact), lifted(touch)
    shown = integrate(pressed.gradient, mm_per_px, boundary)
    level_mm = median(shown[~contact]) if boundary == "neumann" else 0.0
    lack = (pressed.depth_mm - shown)[contact] + level_mm
    return replace(touch, unseen_mm=float(lack.mean()) if lack.size else 0.0)


def under_side(
    points_mm: Points, triangles: Int[np.ndarray, "t 3"], z_mm: float
) -> Float[np.ndarray, "2"]:
    """The middle, in x and y, of what lies below the gel's surface after a lift by ``z_mm``."""
    middles = points_mm[triangles].reshape(-1, 3)
    below = middles[middles[:, 2] + z_mm < 0]
    middle: Float[np.ndarray, 2] = below[:, :2].mean(0)
    return middle


def _below(
    corners: Float[np.ndarray, "t 3 3"],
) -> tuple[Float[np.ndarray, "t 2"], Float[np.ndarray, "t 2"]]:
    """Least and greatest x and y of each triangle's part below the gel's surface, which it has."""
    starts = np.ascontiguousarray(np.moveaxis(corners, 1, 0))  # least of three rows: fast in numpy
    ends = np.roll(starts, -1, axis=0)
    below, end_below = starts[..., 2] < 0, ends[..., 2] < 0
    crosses = below != end_below
    rise = np.where(crosses, ends[..., 2] - starts[..., 2], 1.0)
    share = -starts[..., 2] / rise
    crossings = starts[..., :2] + share[..., None] * (ends - starts)[..., :2]
    places = np.concatenate([starts[..., :2], crossings])
    there = np.concatenate([below, crosses])[..., None]
    return np.where(there, places, np.inf).min(0), np.where(there, places, -np.inf).max(0)


def _counted(
    first: Int[np.ndarray, " n"], counts: Int[np.ndarray, " n"]
) -> tuple[Int[np.ndarray, " m"], Int[np.ndarray, " m"]]:
    """So many whole numbers from each first one on: whose they are, and they themselves."""
    whose = np.repeat(np.arange(len(counts)), counts)
    return whose, np.arange(len(whose)) + (first + counts - np.cumsum(counts))[whose]


def _ends(
    corners: Float[np.ndarray, "t 3 3"],
    triangle: Int[np.ndarray, " n"],
    y_mm: Float[np.ndarray, " n"],
) -> tuple[Float[np.ndarray, " n"], Float[np.ndarray, " n"]]:
    """Least and greatest x of triangles along lines of one y, which touch them but for rounding."""
    starts = np.ascontiguousarray(np.moveaxis(corners[..., :2], 1, 0))[:, triangle]
    ends = starts[[1, 2, 0]]
    y_mm = np.clip(y_mm, starts[..., 1].min(0), starts[..., 1].max(0))
    rise = ends[..., 1] - starts[..., 1]
    share = (y_mm - starts[..., 1]) / np.where(rise == 0, 1.0, rise)
    crosses = (rise != 0) & (share >= 0) & (share <= 1)
    x_mm = starts[..., 0] + share * (ends - starts)[..., 0]
    return np.where(crosses, x_mm, np.inf).min(0), np.where(crosses, x_mm, -np.inf).max(0)
