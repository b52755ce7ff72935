# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""The camera sees the whole pad: through gel, acrylic and air, by the mirror, past every body."""

from collections.abc import Mapping

import numpy as np
import trimesh

from cad.layout import Layout
from cad.optics import (
    camera_axes,
    faulty_pictures,
    keystone,
    mm_per_px,
    pad_grid,
    pixel_margin,
    trace,
)
from cad.rays import Array, first_hits
from cad.result import Result
from cad.sight_refusals import KEYSTONE, PIXEL_MARGIN
from sensor.design import Wedge

GRID = 41
_OFF_THE_FACE = 1e-3
_CLEAR = ("acrylic", "gel")


def check_sight(design: Wedge, meshes: Mapping[str, trimesh.Trimesh]) -> list[Result]:
    """Trace 41 x 41 points of the pad against the bodies, by name."""
    paths = trace(design, pad_grid(design, GRID))
    opaque = {name: mesh for name, mesh in meshes.items() if name not in _CLEAR}
    others = _joined([mesh for name, mesh in opaque.items() if name != "mirror"])
    # The pupil lies inside the camera's own barrel.
    beyond = _joined([mesh for name, mesh in opaque.items() if name not in ("mirror", "camera")])
    n = len(paths.skin)
    pupil = np.broadcast_to(paths.pupil, (n, 3))
    blocked = _cut(beyond, pupil, paths.mirror) | _cut(others, paths.mirror, paths.acrylic)
    missed = ~_strikes(opaque["mirror"], pupil, paths.mirror)
    rays = f"{n} points, two segments each"
    return [
        Result("sight", "rays blocked by a body", float(blocked.sum()), "rays", 0, "at most", rays),
        Result("sight", "rays that miss the mirror", float(missed.sum()), "rays", 0, "at most",
               rays),
        Result("sight", "margin in the picture", pixel_margin(design.camera, paths.pixels), "px",
               PIXEL_MARGIN, "at least", design.camera.projection),
        *_figures(design, paths.pixels),
        *_direct_view(design, beyond),
    ]  # fmt: skip


def _figures(design: Wedge, pixels: Array) -> list[Result]:
    (along_low, along_high), (across_low, across_high) = mm_per_px(design)
    ranges = f"{along_low:.3f}-{along_high:.3f} along, {across_low:.3f}-{across_high:.3f} across"
    coarsest = max(along_high, across_high)
    return [
        Result("sight", "keystone", keystone(pixels, GRID), "", KEYSTONE, "at least",
               "tip edge divided by base edge"),
        Result("sight", "coarsest pixel", coarsest, "mm", 0, "for information", ranges),
    ]  # fmt: skip


def _direct_view(design: Wedge, bodies: trimesh.Trimesh) -> list[Result]:
    """Share of the picture that shows the acrylic directly, past mirror and baffle."""
    place, camera = Layout(design), design.camera
    axes = np.array(camera_axes(camera))
    u, v = np.meshgrid(np.arange(4, camera.width_px, 8), np.arange(4, camera.height_px, 8))
    offset = np.column_stack([u.ravel(), v.ravel()]) - [camera.width_px / 2, camera.height_px / 2]
    radius = np.linalg.norm(offset, axis=1) / camera.focal_length_px
    angle = radius if camera.projection == "equidistant" else np.arctan(radius)
    side = offset / np.maximum(np.linalg.norm(offset, axis=1), 1e-9)[:, None]
    sine = np.sin(angle)
    rays = np.cos(angle)[:, None] * axes[0] + (sine * side[:, 0])[:, None] * axes[1]
    rays = rays + (sine * side[:, 1])[:, None] * axes[2]
    pupil = np.array([camera.pupil_x_mm, 0.0, camera.pupil_z_mm])
    falls = (rays[:, 2] < -1e-3) & (angle < np.pi / 2)
    rays = rays[falls]
    landing = pupil + rays * (-pupil[2] / rays[:, 2])[:, None]
    on_glass = (landing[:, 0] > place.window_x0) & (landing[:, 0] < place.acrylic_x1)
    on_glass &= np.abs(landing[:, 1]) < place.acrylic_half
    start = np.broadcast_to(pupil, landing[on_glass].shape)
    open_ = ~_cut(bodies, start, landing[on_glass])
    share = 100 * float(open_.sum()) / u.size
    without = 100 * float(on_glass.sum()) / u.size
    return [
        Result("sight", "direct view of the acrylic", share, "% of the picture", 5.0, "at most",
               f"{without:.1f} % without the baffle")
    ]  # fmt: skip


def check_tolerance(design: Wedge) -> list[Result]:
    """The whole pad stays in the picture under each likely fault of building."""
    return [
        Result("tolerance", f"margin with {fault.name}", fault.margin_px, "px", 0, "at least",
               f"moves the picture by {fault.shift_px:.1f} px, which calibration corrects")
        for fault in faulty_pictures(design)
    ]  # fmt: skip


def _joined(meshes: list[trimesh.Trimesh]) -> trimesh.Trimesh:
    joined = trimesh.util.concatenate(meshes)
    assert isinstance(joined, trimesh.Trimesh)
    return joined


def _cut(mesh: trimesh.Trimesh, start: Array, end: Array) -> np.ndarray:
    """Whether a body lies between two points, (n,)."""
    way = end - start
    length = np.linalg.norm(way, axis=1)
    direction = way / length[:, None]
    hit, _ = first_hits(mesh, start + _OFF_THE_FACE * direction, direction)
    return np.asarray(hit < length - 3 * _OFF_THE_FACE)


def _strikes(mesh: trimesh.Trimesh, start: Array, end: Array) -> np.ndarray:
    """Whether the first thing on the mirror's own body is the point asked for, (n,)."""
    way = end - start
    length = np.linalg.norm(way, axis=1)
    hit, _ = first_hits(mesh, start, way / length[:, None])
    return np.asarray(np.abs(hit - length) < 1e-2)
