# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""The frame as the camera has it: back from each pixel over mirror, acrylic and gel to the skin.

Matt paint sends the same radiance everywhere, so what was traced straight on is looked up where
the camera's ray meets the skin, and weakened by the faces on its way. Rays that miss the mirror
may reach the acrylic directly: the unreflected view that fills a part of every Wedge's frame,
unless a baffle hides it.

Rays are followed in the body's frame (x from the tip face to the base, z to the mirror).
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

import cv2
import numpy as np
from jaxtyping import Bool, Float, Float32
from scipy import ndimage

from sensor.design import Camera, Wedge
from sensor.errors import WedgeError
from sensor.toml import Pair
from simulation.skin import Map, Skin, View, rest_height_mm

Points = Float[np.ndarray, "n 2"]
Rays = Float[np.ndarray, "n 3"]

MIRROR_REFLECTANCE: Final = 0.93
"""Of a front-surface aluminium mirror."""
MEETINGS: Final = 12
"""Steps in which a ray finds the dented skin; each leaves a tenth to a third of the error."""


@dataclass(frozen=True, kw_only=True)
class Seen:
    """What rays from the camera meet."""

    point_mm: Points
    """On the skin, gel frame; NaN where a ray meets none."""
    share: Float[np.ndarray, " n"]
    """Of the skin's radiance that arrives."""
    direct: Bool[np.ndarray, " n"]
    """Seen past the mirror."""


def follow(design: Wedge, pixels: Points, view: View | None, depth_mm: Map | None) -> Seen:
    """Follow the camera's rays to the skin.

    Args:
        design: the sensor.
        pixels: (n, 2), along the finger and across it; pixel centres are integers.
        view: pixels of the dented skin, with ``depth_mm``; the untouched skin by default.
        depth_mm: its indentation.
    """
    origin, ray, reflected = _from_camera(design, pixels)
    downward = (ray[:, 2] < 0) & (origin[:, 2] > 0)
    entry, point = _through_layers(design, origin, ray, view, depth_mm)
    acrylic, gel = design.acrylic, design.gel
    sine = np.hypot(ray[:, 0], ray[:, 1])
    half = np.array([gel.pad_length_mm, gel.pad_width_mm]) / 2
    inside = np.abs(entry) <= np.array([acrylic.length_mm, acrylic.width_mm]) / 2
    met = downward & inside.all(1) & (np.abs(point) <= half).all(1)
    share = _through(sine, 1.0, acrylic.refractive_index)
    share = share * _through(sine, acrylic.refractive_index, gel.refractive_index)
    share = share * np.where(reflected, MIRROR_REFLECTANCE, 1.0)
    return Seen(
        point_mm=np.where(met[:, None], point, np.nan),
        share=np.where(met, share, 0.0),
        direct=met & ~reflected,
    )


def raw_frame(
    design: Wedge,
    view: View,
    radiance: Float32[np.ndarray, "h w 3"],
    depth_mm: Map,
    *,
    baffle: bool = True,
) -> Float32[np.ndarray, "rows columns 3"]:
    """The camera's frame, linear, from the radiance of the gel seen straight on.

    Args:
        design: the sensor.
        view: the radiance's pixels.
        radiance: what the skin sends.
        depth_mm: its indentation.
        baffle: hides the direct view, as the printed case does.
    """
    width, height = design.camera.width_px, design.camera.height_px
    columns, rows = np.meshgrid(np.arange(width), np.arange(height))
    pixels = np.stack([columns.ravel(), rows.ravel()], 1).astype(float)
    seen = follow(design, pixels, view, depth_mm)
    share = np.where(seen.direct, 0.0, seen.share) if baffle else seen.share
    x, y = (
        (seen.point_mm[:, axis] / view.mm_per_px[axis] + (view.size_px[axis] - 1) / 2)
        .reshape(height, width)
        .astype(np.float32)
        for axis in (0, 1)
    )
    looked_up = cv2.remap(
        radiance, np.nan_to_num(x), np.nan_to_num(y), cv2.INTER_LINEAR,
        borderMode=cv2.BORDER_REPLICATE,
    )  # fmt: skip
    return looked_up * share.reshape(height, width, 1).astype(np.float32)


def pad_corners_px(design: Wedge) -> tuple[Pair, Pair, Pair, Pair]:
    """The pad's corners in the raw frame: top left, top right, bottom right, bottom left."""
    return corners_px(design, design.pad_size_mm)


def corners_px(design: Wedge, size_mm: Pair) -> tuple[Pair, Pair, Pair, Pair]:
    """Corners in the raw frame, in the same order, of a rectangle around the pad's centre."""
    half = np.array(size_mm) / 2
    signs = np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)])
    # A hair inside, so that what is seen there is the pad.
    found = pixels_of(design, signs * half * (1 - 1e-6))
    first, second, third, fourth = ((float(x), float(y)) for x, y in found)
    return first, second, third, fourth


def pixels_of(design: Wedge, points_mm: Points) -> Points:
    """Raw pixels that see points of the untouched skin over the mirror (n, 2), by Newton's method.

    Raises:
        WedgeError: the camera sees nothing of the pad over the mirror.
    """
    width, height = design.camera.width_px, design.camera.height_px
    coarse = np.stack(
        [axis.ravel() for axis in np.meshgrid(np.arange(0, width, 4.0), np.arange(0, height, 4.0))],
        1,
    )
    seen = follow(design, coarse, None, None)
    over_mirror = np.isfinite(seen.point_mm[:, 0]) & ~seen.direct
    if not over_mirror.any():
        raise WedgeError(
            "the camera sees nothing of the pad in the mirror: move or turn one of the two."
        )
    coarse, known = coarse[over_mirror], seen.point_mm[over_mirror]
    distance = np.linalg.norm(known[None] - points_mm[:, None], axis=-1)
    nearest = np.argsort(distance, axis=1)[:, :12]
    # The map is smooth: a plane through the neighbours, then steps along it.
    planes = np.array(
        [
            np.linalg.lstsq(
                np.column_stack([known[near], np.ones(len(near))]), coarse[near], rcond=None
            )[0]
            for near in nearest
        ]
    )
    found = np.einsum("ni,nij->nj", points_mm, planes[:, :2]) + planes[:, 2]
    for _ in range(8):
        origin, ray, _ = _from_camera(design, found)
        # Not `follow`: a step may lead past the pad's edge, where that sees nothing, and back.
        here = _through_layers(design, origin, ray, None, None)[1]
        step = np.einsum("ni,nij->nj", points_mm - here, planes[:, :2])
        found = found + np.nan_to_num(step)
    return found


def unwarped_skin(design: Wedge, view: View, skin: Skin, *, lens_undone: bool = False) -> Skin:
    """The skin that each pixel shows once four corners have unwarped the raw frame.

    Each pixel's ray is followed to the dented skin, whose parallax is part of what it shows; where
    a ray meets no skin over the mirror, nothing is indented.

    Args:
        design: the sensor.
        view: pixels of the skin and of the unwarped frame.
        skin: as it is.
        lens_undone: whether the lens is undone first, as by the set's ``camera.toml``.
    """
    raw, unwarped = _unwarping_px(design, view)
    columns, rows = np.meshgrid(*(np.arange(float(count)) for count in view.size_px))
    pixels = np.stack([columns.ravel(), rows.ravel()], 1)
    if lens_undone:
        raw = as_pinhole(design.camera, raw).astype(np.float32)
    back = cv2.getPerspectiveTransform(unwarped, raw)
    shown = cv2.perspectiveTransform(pixels[:, None], back)[:, 0]
    if lens_undone:
        shown = through_lens(design.camera, shown)
    seen = follow(design, shown, view, skin.depth_mm)
    met = (np.isfinite(seen.point_mm[:, 0]) & ~seen.direct).reshape(rows.shape)
    column, row = view.pixel(*np.nan_to_num(seen.point_mm).T)

    def looked_up(of_skin: np.ndarray, order: int) -> np.ndarray:
        found = ndimage.map_coordinates(of_skin, [row, column], order=order, mode="nearest")
        return np.where(met, found.reshape(rows.shape), 0)

    return Skin(
        depth_mm=looked_up(skin.depth_mm, order=1),
        contact=looked_up(skin.contact, order=0).astype(bool),
    )


def _unwarping_px(
    design: Wedge, view: View
) -> tuple[Float32[np.ndarray, "4 2"], Float32[np.ndarray, "4 2"]]:
    """Corners of what the view covers: in the raw frame, and of the unwarped one."""
    width, height = view.size_px
    edges = [(-0.5, -0.5), (width - 0.5, -0.5), (width - 0.5, height - 0.5), (-0.5, height - 0.5)]
    return np.array(corners_px(design, view.size_mm), np.float32), np.array(edges, np.float32)


def _from_camera(design: Wedge, pixels: Points) -> tuple[Rays, Rays, Bool[np.ndarray, " n"]]:
    """Origins and directions of the rays once the mirror is behind them, and which it turned."""
    camera, mirror = design.camera, design.mirror
    ray = directions(camera, pixels)
    pupil = np.array([camera.pupil_x_mm, 0.0, camera.pupil_z_mm])
    tilt = np.radians(mirror.angle_deg)
    normal = np.array([-np.sin(tilt), 0.0, np.cos(tilt)])
    slope = np.array([np.cos(tilt), 0.0, np.sin(tilt)])
    foot = np.array([mirror.foot_x_mm, 0.0, mirror.foot_height_mm])
    with np.errstate(divide="ignore"):
        away = ((foot - pupil) @ normal) / (ray @ normal)
    hit = pupil + ray * away[:, None]
    along = (hit - foot) @ slope
    turned = (away > 0) & (along >= 0) & (along <= mirror.length_mm)
    turned &= np.abs(hit[:, 1]) <= mirror.width_mm / 2
    bounced = ray - 2 * (ray @ normal)[:, None] * normal
    pick = turned[:, None]
    return np.where(pick, hit, pupil), np.where(pick, bounced, ray), turned


def directions(camera: Camera, pixels: Points) -> Rays:
    """Unit vectors from the pupil through pixels, body frame."""
    pitch = np.radians(camera.pitch_deg)
    forward = np.array([-np.cos(pitch), 0.0, np.sin(pitch)])
    up, across = np.array([np.sin(pitch), 0.0, np.cos(pitch)]), np.array([0.0, 1.0, 0.0])
    offset = pixels + 0.5 - np.array([camera.width_px, camera.height_px]) / 2
    radius = np.linalg.norm(offset, axis=1)
    spread = radius / camera.focal_length_px
    angle = spread if camera.projection == "equidistant" else np.arctan(spread)
    azimuth = offset / np.maximum(radius, 1e-12)[:, None]
    aside = azimuth[:, :1] * up + azimuth[:, 1:] * across
    return np.cos(angle)[:, None] * forward + np.sin(angle)[:, None] * aside


def as_pinhole(camera: Camera, pixels: Points) -> Points:
    """Where a pinhole of the same focal length shows what the camera shows in pixels (n, 2)."""
    return pixels if camera.projection == "pinhole" else _from_middle(camera, pixels, np.tan)


def through_lens(camera: Camera, pixels: Points) -> Points:
    """Where the camera shows what that pinhole shows in pixels (n, 2)."""
    return pixels if camera.projection == "pinhole" else _from_middle(camera, pixels, np.arctan)


def _from_middle(
    camera: Camera, pixels: Points, bend: Callable[[np.ndarray], np.ndarray]
) -> Points:
    """Pixels moved from or to the frame's middle; distances are in focal lengths."""
    middle = np.array([camera.width_px, camera.height_px]) / 2 - 0.5
    away = (pixels - middle) / camera.focal_length_px
    radius = np.maximum(np.linalg.norm(away, axis=1, keepdims=True), 1e-12)
    moved: Points = middle + camera.focal_length_px * away * bend(radius) / radius
    return moved


def _through_layers(
    design: Wedge, origin: Rays, ray: Rays, view: View | None, depth_mm: Map | None
) -> tuple[Points, Points]:
    """Where rays enter the acrylic, and where they would meet a skin without edges; gel frame."""
    acrylic, gel = design.acrylic, design.gel
    with np.errstate(divide="ignore", invalid="ignore"):
        there = origin + ray * (-origin[:, 2] / ray[:, 2])[:, None]
    center_mm = acrylic.tip_offset_mm + acrylic.length_mm / 2
    to_tip = np.array([-1.0, 1.0])  # gel x runs to the tip
    entry = (there[:, :2] - [center_mm, 0]) * to_tip
    start = entry + _bent(ray, acrylic.refractive_index) * acrylic.thickness_mm * to_tip
    step = _bent(ray, gel.refractive_index) * to_tip
    point = start + step * gel.thickness_mm
    for _ in range(MEETINGS):
        point = start + step * _thickness_mm(design, point, view, depth_mm)[:, None]
    return entry, point


def _bent(ray: Rays, index: float) -> Points:
    """How far a ray that comes from air goes aside in a flat layer of thickness 1."""
    sideways = ray[:, :2] / index
    return sideways / np.sqrt(1 - (sideways**2).sum(1))[:, None]


def _thickness_mm(
    design: Wedge, point: Points, view: View | None, depth_mm: Map | None
) -> Float[np.ndarray, " n"]:
    """Of the gel over points of the pad; beyond its edge, that at the edge."""
    half = np.array([design.gel.pad_length_mm, design.gel.pad_width_mm]) / 2
    x, y = np.clip(np.nan_to_num(point), -half, half).T
    thickness = design.gel.thickness_mm + rest_height_mm(design.gel, x, y)
    if view is None or depth_mm is None:
        return thickness
    column, row = view.pixel(x, y)
    dent = ndimage.map_coordinates(depth_mm, [row, column], order=1, mode="nearest")
    return thickness - dent


def _through(sine: np.ndarray, before: float, after: float) -> np.ndarray:
    """Share of unpolarised light that passes a face (Fresnel); ``sine`` is n sin(angle)."""
    cosine_before = np.sqrt(np.maximum(1 - (sine / before) ** 2, 0))
    cosine_after = np.sqrt(np.maximum(1 - (sine / after) ** 2, 0))
    across = (before * cosine_before - after * cosine_after) / (
        before * cosine_before + after * cosine_after
    )
    along = (after * cosine_before - before * cosine_after) / (
        after * cosine_before + before * cosine_after
    )
    return 1 - (across**2 + along**2) / 2
