# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""The skin at rest on a design's curved gel, and what a touch is once it is laid on it.

A frame tells how far the skin was pressed in, and how steeply, from where it lay. An object has one
shape wherever on the pad it is pressed, and so has a touch only after the gel's own curve is added.
"""

from dataclasses import dataclass, replace
from functools import lru_cache
from typing import TypeVar

import numpy as np
from jaxtyping import Float, Float32
from scipy.spatial.transform import Rotation

from recon.ball import normals
from recon.pose.registration import OwnTouch, Touch, contact_middle, pixel_grid_mm
from recon.pose.rigid import Transform, inverse, rigid
from sensor.design import Gel
from sensor.errors import WedgeError
from sensor.toml import Pair

Laid = TypeVar("Laid", bound=OwnTouch)


@dataclass(frozen=True, kw_only=True)
class Rest:
    """The untouched skin."""

    depth_mm: Float32[np.ndarray, "h w"]
    """Below its highest point, the pad's centre."""
    gradient: Float32[np.ndarray, "h w 2"]
    """Slopes of that depth along x and y, mm/mm."""


def rest_at(
    gel: Gel | None, x_mm: Float[np.ndarray, "*n"], y_mm: Float[np.ndarray, "*n"]
) -> tuple[Float[np.ndarray, "*n"], Float[np.ndarray, "*n 2"]]:
    """Depth and slopes of the untouched skin at points of the pad, as of ``Rest``.

    Raises:
        WedgeError: some lie beyond the gel's curve.
    """
    if gel is None or not gel.curved:
        return np.zeros_like(x_mm), np.zeros((*x_mm.shape, 2))
    along, across = gel.semi_axis_along_mm, gel.semi_axis_across_mm
    left = 1 - (x_mm / along) ** 2 - (y_mm / across) ** 2
    if left.min() <= 0:
        raise WedgeError(
            f"the frame is {np.ptp(x_mm):.1f} x {np.ptp(y_mm):.1f} mm and reaches beyond the "
            "design's curved gel: name the design of this unit, or none for a flat gel."
        )
    root = np.sqrt(left)
    slopes = gel.semi_axis_normal_mm * np.stack([x_mm / along**2, y_mm / across**2], -1)
    return gel.semi_axis_normal_mm * (1 - root), slopes / root[..., None]


@lru_cache(maxsize=8)
def rest_of(gel: Gel | None, size_px: tuple[int, int], mm_per_px: Pair) -> Rest:
    """The untouched skin in a frame (width, height) whose middle is the pad's; flat without a gel.

    Raises:
        WedgeError: the frame reaches beyond the gel's curve.
    """
    depth_mm, gradient = rest_at(gel, *np.meshgrid(*pixel_grid_mm(size_px, mm_per_px)))
    rest = Rest(depth_mm=depth_mm.astype(np.float32), gradient=gradient.astype(np.float32))
    for array in (rest.depth_mm, rest.gradient):  # every caller's
        array.flags.writeable = False
    return rest


def gel_of(touch: Touch) -> Gel | None:
    """The curved gel that a touch was laid on."""
    return touch.gel if isinstance(touch, OwnTouch) else None


def rest_under(touch: Touch) -> Rest | None:
    """The untouched skin where a touch was laid on a curved gel."""
    gel = gel_of(touch)
    return None if gel is None else rest_of(gel, touch.depth_mm.shape[::-1], touch.mm_per_px)


def laid(touch: Laid, gel: Gel | None) -> Laid:
    """A touch with the slopes and depths of the object: the gel's own are added.

    Depth is then from the plane through the pad's centre, as the point ``(x, y, -depth)`` has it.

    Args:
        touch: as it was reconstructed, or laid already.
        gel: a design's; ``None`` or a flat one changes nothing.
    """
    if gel is None or not gel.curved or touch.gel is not None:
        return touch
    rest = rest_of(gel, touch.depth_mm.shape[::-1], touch.mm_per_px)
    return replace(
        touch,
        gradient=touch.gradient + rest.gradient,
        depth_mm=touch.depth_mm + rest.depth_mm,
        gel=gel,
    )


def lifted(touch: Laid) -> Laid:
    """The touch as it was before it was ``laid``."""
    rest = rest_under(touch)
    if rest is None:
        return touch
    gradient, depth_mm = touch.gradient - rest.gradient, touch.depth_mm - rest.depth_mm
    return replace(touch, gradient=gradient, depth_mm=depth_mm, gel=None)


def tangent(touch: OwnTouch) -> Transform:
    """``T_gel_plane``: where a flat gel's plane lies on the curved one, in a contact's middle."""
    x_mm, y_mm, _ = contact_middle(touch)
    depth_mm, slopes = rest_at(touch.gel, np.array([[x_mm]]), np.array([[y_mm]]))
    turn, _ = Rotation.align_vectors(normals(slopes)[0], [[0.0, 0.0, 1.0]])
    there = rigid(turn.as_matrix(), np.array([x_mm, y_mm, -depth_mm[0, 0]]))
    return there @ inverse(rigid(np.eye(3), np.array([x_mm, y_mm, 0.0])))
