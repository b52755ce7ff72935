# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""The light path from a point of the skin through gel, acrylic, air and mirror to a pixel.

The mirror is unfolded: the camera sees the pad as if from the pupil's mirror image. Every
refracting face is then a plane z = const, so the whole path is one Snell invariant
s = n sin(angle), found as the root of a monotone function of s.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from cad.bounds import own_range, value_of, with_value
from sensor.design import Camera, Wedge

Array = NDArray[np.float64]
STEPS = 21
"""Points along each side of the pad, between which a pixel's millimetres are measured."""


@dataclass(frozen=True)
class Paths:
    """Light paths, one a row. Points are (n, 3) in mm in the body's frame."""

    skin: Array
    gel: Array
    """Where the path crosses from gel to acrylic."""
    acrylic: Array
    """Where it crosses the acrylic's inner face."""
    mirror: Array
    """Where it meets the plane of the mirror."""
    pupil: Array
    pixels: Array
    """(n, 2): u along the finger, v across, in the picture; the lens looks along its centre."""

    @property
    def air_mm(self) -> Array:
        """Length in air of each path, (n,)."""
        up = np.linalg.norm(self.mirror - self.acrylic, axis=1)
        return np.asarray(up + np.linalg.norm(self.pupil - self.mirror, axis=1))


def pad_grid(design: Wedge, count: int) -> Array:
    """(count², 2) points of the pad's rectangle, x outermost, in the body's frame in mm."""
    length, width = design.pad_size_mm
    x = pad_center_x_mm(design) + np.linspace(-length / 2, length / 2, count)
    y = np.linspace(-width / 2, width / 2, count)
    return np.stack(np.meshgrid(x, y, indexing="ij"), axis=-1).reshape(-1, 2)


def pad_center_x_mm(design: Wedge) -> float:
    """The pad sits in the middle of the acrylic."""
    return design.acrylic.tip_offset_mm + design.acrylic.length_mm / 2


def gel_thickness_mm(design: Wedge, points: Array) -> Array:
    """Thickness of the gel under (n, 2) points, (n,)."""
    gel = design.gel
    if not gel.curved:
        return np.full(len(points), float(gel.thickness_mm))
    along = (points[:, 0] - pad_center_x_mm(design)) / gel.semi_axis_along_mm
    across = points[:, 1] / gel.semi_axis_across_mm
    root = np.sqrt(1 - along**2 - across**2)
    return np.asarray(gel.thickness_mm - gel.semi_axis_normal_mm * (1 - root))


def trace(design: Wedge, points: Array) -> Paths:
    """Follow the light from (n, 2) points of the pad to the picture."""
    normal, foot = mirror_plane(design)
    pupil = np.array([design.camera.pupil_x_mm, 0.0, design.camera.pupil_z_mm])
    image = pupil - 2 * ((pupil - foot) @ normal) * normal
    gel_mm = gel_thickness_mm(design, points)
    offset = points - image[:2]
    reach = np.hypot(offset[:, 0], offset[:, 1])
    sine = _snell_invariant(design, image[2], gel_mm, reach)
    azimuth = offset / np.maximum(reach, 1e-12)[:, None]
    cosine = np.sqrt(1 - sine**2)
    down = np.column_stack([azimuth * sine[:, None], -cosine])
    acrylic = image + down * (image[2] / cosine)[:, None]
    glass_mm = design.acrylic.thickness_mm
    aside = azimuth * _sideways_mm(glass_mm, design.acrylic.refractive_index, sine)[:, None]
    gel = np.column_stack([acrylic[:, :2] + aside, np.full(len(points), -glass_mm)])
    mirror = image + down * (((foot - image) @ normal) / (down @ normal))[:, None]
    skin = np.column_stack([points, -glass_mm - gel_mm])
    return Paths(skin, gel, acrylic, mirror, pupil, project(design.camera, mirror - pupil))


def _snell_invariant(design: Wedge, height_mm: float, gel_mm: Array, reach_mm: Array) -> Array:
    """Solve for s: air, acrylic and gel together carry the ray sideways by its reach."""
    acrylic, gel = design.acrylic, design.gel
    low, high = np.zeros_like(reach_mm), np.full_like(reach_mm, 1 - 1e-12)
    for _ in range(60):
        s = (low + high) / 2
        carried = (
            _sideways_mm(height_mm, 1.0, s)
            + _sideways_mm(acrylic.thickness_mm, acrylic.refractive_index, s)
            + _sideways_mm(gel_mm, gel.refractive_index, s)
        )
        short = carried < reach_mm
        low, high = np.where(short, s, low), np.where(short, high, s)
    return np.asarray((low + high) / 2)


def _sideways_mm(thickness_mm: float | Array, index: float, s: Array) -> Array:
    """How far a flat layer carries a ray sideways: n sin(angle) is the invariant s (Snell)."""
    return np.asarray(thickness_mm * s / np.sqrt(index**2 - s**2))


def mirror_plane(design: Wedge) -> tuple[Array, Array]:
    """Unit normal of the reflecting face, away from the pad, and the point at its foot."""
    tilt = np.radians(design.mirror.angle_deg)
    normal = np.array([-np.sin(tilt), 0.0, np.cos(tilt)])
    return normal, np.array([design.mirror.foot_x_mm, 0.0, design.mirror.foot_height_mm])


def camera_axes(camera: Camera) -> tuple[Array, Array, Array]:
    """Unit vectors: where the lens looks, up in its picture, and across."""
    pitch = np.radians(camera.pitch_deg)
    forward = np.array([-np.cos(pitch), 0.0, np.sin(pitch)])
    up = np.array([np.sin(pitch), 0.0, np.cos(pitch)])
    return forward, up, np.array([0.0, 1.0, 0.0])


def project(camera: Camera, directions: Array) -> Array:
    """Pixels (n, 2) of (n, 3) directions from the pupil; NaN behind the lens."""
    forward, up, across = camera_axes(camera)
    u, v = directions @ up, directions @ across
    angle = np.arctan2(np.hypot(u, v), directions @ forward)
    spread = angle if camera.projection == "equidistant" else np.tan(angle)
    radius = np.where(angle < np.pi / 2, camera.focal_length_px * spread, np.nan)
    azimuth = np.arctan2(v, u)
    center = np.array([camera.width_px, camera.height_px]) / 2
    return np.asarray(
        center + np.column_stack([radius * np.cos(azimuth), radius * np.sin(azimuth)])
    )


def pixel_margin(camera: Camera, pixels: Array) -> float:
    """Distance in pixels from the picture's edge to the nearest point; negative outside."""
    size = np.array([camera.width_px, camera.height_px])
    return float(np.nanmin([pixels, size - pixels])) if np.isfinite(pixels).all() else -np.inf


def keystone(pixels: Array, count: int) -> float:
    """Width of the pad's tip edge in the picture over that of its base edge."""
    v = pixels[:, 1].reshape(count, count)
    return float(np.ptp(v[0]) / np.ptp(v[-1]))


def mm_per_px(design: Wedge) -> tuple[tuple[float, float], tuple[float, float]]:
    """Smallest and largest millimetres a pixel, along the finger and across it."""
    grid = pad_grid(design, STEPS)
    shape = (STEPS, STEPS, 2)
    pixels, points = trace(design, grid).pixels.reshape(shape), grid.reshape(shape)
    ranges = []
    for axis in (0, 1):
        mm = np.linalg.norm(np.diff(points, axis=axis), axis=-1)
        scale = mm / np.linalg.norm(np.diff(pixels, axis=axis), axis=-1)
        ranges.append((float(scale.min()), float(scale.max())))
    return ranges[0], ranges[1]


FAULTS = (
    ("mirror.angle_deg", 1.0),
    ("camera.pupil_x_mm", 0.3),
    ("camera.pupil_z_mm", 0.3),
    ("camera.pitch_deg", 1.0),
    ("camera.diagonal_view_deg", 10.0),
)
"""Likely faults of building, in either direction: field of the design and amount."""


@dataclass(frozen=True)
class Faulty:
    """What a fault of building does to the picture, in px; the worse of its two directions."""

    name: str
    shift_px: float
    """Largest shift of a point of the pad."""
    margin_px: float
    """Distance from the pad to the picture's edge that remains."""


def seen_mm(design: Wedge, paths: Paths) -> Array:
    """How far from the pupil the skin seems to lie, (n,): what is in glass and gel looks nearer."""
    gel, acrylic = design.gel, design.acrylic
    behind = acrylic.thickness_mm / acrylic.refractive_index
    return np.asarray(paths.air_mm + behind + gel.thickness_mm / gel.refractive_index)


def faulty_pictures(design: Wedge) -> list[Faulty]:
    """The picture of the pad under each likely fault of building."""
    grid = pad_grid(design, 9)
    nominal = trace(design, grid).pixels
    found = []
    for field, amount in FAULTS:
        shift, margin = 0.0, np.inf
        for by in (-amount, amount):
            built = _moved(design, field, by)
            pixels = trace(built, grid).pixels
            shift = max(shift, float(np.linalg.norm(pixels - nominal, axis=1).max()))
            margin = min(margin, pixel_margin(built.camera, pixels))
        found.append(Faulty(f"{field} ± {amount:g}", shift, margin))
    return found


def _moved(design: Wedge, field: str, by: float) -> Wedge:
    """The design with one number moved, but not past the number's own bounds."""
    value = float(np.clip(value_of(design, field) + by, *own_range(field)))
    return with_value(design, field, value)
