# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""From which sides a mesh looks like a touch: what a search of its pose begins with.

The mesh is drawn from directions all over, each picture compared with the touch turned by every
yaw: normals, depth and outline in few cells. How deep it is pressed follows from the picture
itself: less deep means less of the same picture, so its deepest cells are taken, as many as the
contact is large. Depth by the touch errs far more: at a tip it is a mean over noise, and where the
outline is a cliff nobody sees how high it is. Where the frame's border cuts the contact off, its
whole size and where its middle would be are unknown, and several of both are tried.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cache

import cv2
import numpy as np
from jaxtyping import Float, Float32
from scipy.spatial.transform import Rotation

from recon.arrays import ContactMask, DepthMap, GradientField
from recon.pose.mesh import Mesh, render
from recon.pose.registration import Touch, contact_middle, contact_points
from recon.pose.rigid import Points, Transform, rigid

DIRECTIONS, YAWS = 600, 36
"""Seven and ten degrees apart."""
CELLS = 24
"""Along each side of a picture."""
WIDTH, CUT_WIDTH = 1.25, 1.6
"""Of a picture, in contacts; of one cut off by the border, in what is left of it."""
DEEPER, DEEPER_MM = 1.6, 0.3
"""The mesh is drawn so much deeper than the touch seems to be."""
CUT_SIZES = (1.1, 1.4, 1.8)
"""Whole contacts in what the border leaves of them."""
BESIDE, BEYOND = (-0.25, 0.0, 0.25), (0.5, 0.75, 1.0)
"""Where the middle of a whole contact may lie, in radii of what the border leaves of it."""
OUTLINE_WEIGHT = 0.5
"""Of in or out beside unit normals, and depth in units of the deepest."""
RANKED = 4000
APART_DEG, APART_MM = 10.0, 1.0
"""Poses nearer to a better one lead to the same."""

Pictures = Float32[np.ndarray, "n c 4"]
"""Cells of normal x, normal y, depth and outline."""


@dataclass(frozen=True, kw_only=True)
class _View:
    """How a touch is cut into cells."""

    touch: Touch
    deepest_mm: float
    middles_mm: Float[np.ndarray, "m 2"]
    """Where the whole contact's middle may be."""
    sizes_mm2: Sequence[float]
    """Its area."""
    pitch_mm: float
    """Of cells."""


def sifted(mesh: Mesh, touch: Touch, own: Sequence[Transform], most: int) -> list[Transform]:
    """The poses at which a mesh looks most like a touch, the likest first.

    Args:
        mesh: the object.
        touch: what is seen of it; its contact is not empty.
        own: the mesh's own rotations, after which it looks the same.
        most: so many are given at most, all of them apart.

    Raises:
        WedgeError: the mesh has too many large triangles above each other to be drawn.
    """
    view = _view(touch)
    seen, shown = _turned(view)
    drawn = [item for turn in _directions() for item in _drawn(mesh, turn, view)]
    if not drawn:
        return []
    pictures = np.stack([picture for _, picture in drawn])
    unlike = (seen**2).sum((1, 2))[:, None] - 2 * _flat(seen) @ _flat(pictures).T
    unlike += shown @ (pictures**2).sum(2).T
    unlike = unlike.reshape(len(view.middles_mm), YAWS, len(drawn))
    middle, unlike = unlike.argmin(0), unlike.min(0)
    best = np.argsort(unlike, axis=None, kind="stable")[:RANKED]
    yaw, number = np.unravel_index(best, unlike.shape)
    poses = _about_z(_yaws()[yaw]) @ np.stack([pose for pose, _ in drawn])[number]
    poses[:, :2, 3] += view.middles_mm[middle[yaw, number]]
    center = np.array([*contact_middle(touch)[:2], -view.deepest_mm / 2])
    return _apart(poses, own, center, most)


def _apart(
    poses: Float[np.ndarray, "n 4 4"], own: Sequence[Transform], center: Points, most: int
) -> list[Transform]:
    """Those that no better one is near to, whichever of the object's own rotations is between."""
    found: list[Transform] = []
    alike = np.zeros((0, 4, 4))
    for pose in poses:
        turns = (alike[:, :3, :3] * pose[:3, :3]).sum((1, 2))
        near = alike[turns > 1 + 2 * np.cos(np.radians(APART_DEG))]
        there = np.append((center - pose[:3, 3]) @ pose[:3, :3], 1.0)
        if (np.linalg.norm((near @ there)[:, :3] - center, axis=1) < APART_MM).any():
            continue
        found.append(pose)
        alike = np.concatenate([alike, pose @ np.stack(own)])
        if len(found) == most:
            break
    return found


def _view(touch: Touch) -> _View:
    """By the contact's middle, its reach, and the borders that cut it off."""
    contact = touch.contact
    places = contact_points(touch)[:, :2]
    middle = places.mean(0)
    reach_mm = max(float(np.percentile(np.linalg.norm(places - middle, axis=1), 98)), 1e-3)
    steps = [
        (*(-step for step in BEYOND if low), *BESIDE, *(step for step in BEYOND if high))
        for low, high in (
            (contact[:, 0].any(), contact[:, -1].any()),
            (contact[0].any(), contact[-1].any()),
        )
    ]
    cut = max(map(len, steps)) > len(BESIDE)
    beside = [(x, y) for x in steps[0] for y in steps[1]] if cut else [(0.0, 0.0)]
    area_mm2 = len(places) * touch.mm_per_px[0] * touch.mm_per_px[1]
    return _View(
        touch=touch,
        deepest_mm=max(float(np.percentile(touch.depth_mm[contact], 99.5)), 1e-3),
        middles_mm=middle + reach_mm * np.array(beside),
        sizes_mm2=[area_mm2 * size for size in (CUT_SIZES if cut else (1.0,))],
        pitch_mm=2 * (CUT_WIDTH if cut else WIDTH) * reach_mm / CELLS,
    )


def _turned(view: _View) -> tuple[Pictures, Float32[np.ndarray, "n c"]]:
    """The touch about each middle and turned back by each yaw, and which cells the frame shows."""
    touch, pitch = view.touch, view.touch.mm_per_px
    size_px = np.array(touch.contact.shape[::-1])
    side = [max(round(view.pitch_mm / step), 1) for step in pitch]
    whole = _channels(touch.gradient, touch.depth_mm, touch.contact, view)
    every = cv2.blur(np.ones(whole.shape[:2], np.float32), side, borderType=cv2.BORDER_CONSTANT)
    total = cv2.blur(whole, side, borderType=cv2.BORDER_CONSTANT)
    whole = (total / every[..., None]).astype(np.float32)
    at_mm = (np.arange(CELLS) - (CELLS - 1) / 2) * view.pitch_mm
    cells = np.stack(np.meshgrid(at_mm, at_mm), -1).reshape(-1, 2)
    pictures, shown = [], []
    for middle in view.middles_mm:
        for turn in _about_z(_yaws())[:, :2, :2]:
            place = (cells @ turn.T + middle) / pitch + (size_px - 1) / 2
            x, y = place.astype(np.float32).T
            inside = (np.abs(place - (size_px - 1) / 2) * 2 < size_px).all(1)
            found = cv2.remap(whole, x, y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_CONSTANT)[:, 0]
            found[:, :2] = found[:, :2] @ turn
            pictures.append(found * inside[:, None])
            shown.append(inside)
    return np.stack(pictures).astype(np.float32), np.stack(shown).astype(np.float32)


def _drawn(
    mesh: Mesh, turn: Float[np.ndarray, "3 3"], view: _View
) -> Iterator[tuple[Transform, Float32[np.ndarray, "c 4"]]]:
    """The mesh from one direction, as deep as each size of contact is; its middle at the origin."""
    corners = mesh.vertices_mm @ turn.T
    low = corners[corners[:, 2].argmin()]
    deep_mm = DEEPER * view.deepest_mm + DEEPER_MM
    pose = rigid(turn, np.array([-low[0], -low[1], -deep_mm - low[2]]))
    wide = render(mesh, pose, (2 * CELLS, 2 * CELLS), (view.pitch_mm, view.pitch_mm))
    depths = np.sort(wide.depth_mm[wide.depth_mm > 0])[::-1]
    at = np.arange(2 * CELLS) - CELLS + 0.5
    for size_mm2 in view.sizes_mm2:
        cells = int(size_mm2 / view.pitch_mm**2)
        less_mm = float(depths[cells]) if cells < len(depths) else 0.0
        depth = np.maximum(wide.depth_mm - less_mm, 0)
        inside = depth > 0
        if not inside.any():
            continue
        middle = np.array([inside.sum(0) @ at, inside.sum(1) @ at]) / inside.sum()
        shift = np.column_stack([np.eye(2), middle + CELLS / 2])
        picture = cv2.warpAffine(
            _channels(wide.gradient, depth, inside, view),
            shift,
            (CELLS, CELLS),
            flags=cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP,
        )
        moved = np.array([*(-view.pitch_mm * middle), less_mm])
        yield rigid(turn, pose[:3, 3] + moved), picture.reshape(-1, 4)


def _channels(
    gradient: GradientField, depth_mm: DepthMap, contact: ContactMask, view: _View
) -> Float32[np.ndarray, "h w 4"]:
    """Normals, so that a steep side does not outweigh all others; depth; and in or out."""
    steepness = np.sqrt(1 + (gradient**2).sum(-1, keepdims=True))
    depth = depth_mm[..., None] / view.deepest_mm
    outline = np.full_like(depth, OUTLINE_WEIGHT)
    whole = np.concatenate([gradient / steepness, depth, outline], -1)
    return (whole * contact[..., None]).astype(np.float32)


def _flat(pictures: Pictures) -> Float32[np.ndarray, "n k"]:
    return pictures.reshape(len(pictures), -1)


def _yaws() -> Float[np.ndarray, " y"]:
    return np.arange(YAWS) * 2 * np.pi / YAWS


def _about_z(angles: Float[np.ndarray, " n"]) -> Float[np.ndarray, "n 4 4"]:
    turns = np.zeros((len(angles), 4, 4))
    turns[:, :3, :3] = Rotation.from_rotvec(angles[:, None] * [0, 0, 1]).as_matrix()
    turns[:, 3, 3] = 1
    return turns


@cache
def _directions() -> tuple[Float[np.ndarray, "3 3"], ...]:
    """Rotations that bring points all over a sphere (Fibonacci's lattice) to the gel."""
    golden = np.pi * (3 - np.sqrt(5))
    turns = []
    for index in range(DIRECTIONS):
        down = 1 - 2 * (index + 0.5) / DIRECTIONS
        around = np.sqrt(1 - down**2)
        way = np.array([around * np.cos(golden * index), around * np.sin(golden * index), down])
        turns.append(Rotation.align_vectors([[0.0, 0.0, -1.0]], [way])[0].as_matrix())
    return tuple(turns)
