# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Two touches of one object to the motion between them: what every method offers."""

from dataclasses import dataclass
from typing import Any, Protocol, runtime_checkable

import cv2
import numpy as np
from jaxtyping import Float

from recon.arrays import ContactMask, DepthMap, GradientField
from recon.geometry.caliper import of_one_scale
from recon.pose.rigid import Covariance, Points, Transform, adjoint, rigid
from sensor.design import Gel
from sensor.errors import WedgeError
from sensor.toml import Pair

PRIOR_DEG, PRIOR_MM = 5.0, 0.5
"""Standard deviation of a motion nobody saw: where the touch says nothing, the guess stays."""
PRIOR = np.diag([np.radians(PRIOR_DEG) ** 2] * 3 + [PRIOR_MM**2] * 3)


def prior_root(middle_mm: Float[np.ndarray, "3"]) -> Covariance:
    """A root S of the prior S S' of twists: a contact turns and shifts about its own middle.

    The prior of what lies at the origin, brought to the point c: a turn w about it shifts the
    origin by c x w.
    """
    root: Covariance = adjoint(rigid(np.eye(3), middle_mm)) * np.sqrt(np.diag(PRIOR))
    return root


@runtime_checkable
class Touch(Protocol):
    """What tracking needs of a frame; a ``Reconstruction`` is one."""

    @property
    def gradient(self) -> GradientField:
        """Slopes."""

    @property
    def depth_mm(self) -> DepthMap:
        """Depth."""

    @property
    def contact(self) -> ContactMask:
        """Where the object touches."""

    @property
    def mm_per_px(self) -> Pair:
        """Pixel pitch."""


@dataclass(frozen=True, kw_only=True)
class OwnTouch:
    """A touch in arrays of its own."""

    gradient: GradientField
    """(h, w, 2): slopes of the depth along x and y, mm/mm."""
    depth_mm: DepthMap
    """(h, w) float32, mm, positive where pushed in; noise may leave some below zero."""
    contact: ContactMask
    """(h, w): where something touches."""
    mm_per_px: Pair
    """Pixel pitch along x and y."""
    gel: Gel | None = None
    """The curved gel that it was ``recon.pose.rest.laid`` on: then slopes and depth are from the
    plane through the pad's centre."""


def own(touch: Touch, like: Touch | None = None) -> OwnTouch:
    """A copy, unless it is one: a fast reconstructor writes its next touch where the last one was.

    Raises:
        WedgeError: it is a frame, or of another sensor than the touch that it should be like.
    """
    if isinstance(touch, np.ndarray):
        raise WedgeError("a touch is what a Reconstructor makes of a frame: reconstruct it first.")
    if like is not None and not of_one_sensor(touch, like):
        raise WedgeError(
            f"this touch has {_grid(touch)}, those before {_grid(like)}:"
            " a tracker follows what one sensor feels."
        )
    if isinstance(touch, OwnTouch):
        return touch
    return OwnTouch(
        gradient=touch.gradient.copy(),
        depth_mm=touch.depth_mm.copy(),
        contact=touch.contact.copy(),
        mm_per_px=touch.mm_per_px,
    )


def of_one_sensor(touch: Touch, other: Touch) -> bool:
    """Whether both have as many pixels, of about the same pitch."""
    same_size = touch.depth_mm.shape == other.depth_mm.shape
    return same_size and of_one_scale(touch.mm_per_px, other.mm_per_px)


def _grid(touch: Touch) -> str:
    """A touch's pixels in words."""
    height, width = touch.depth_mm.shape
    return f"{width} x {height} pixels of {' x '.join(f'{mm:.5g}' for mm in touch.mm_per_px)} mm"


@dataclass(frozen=True, kw_only=True)
class Alignment:
    """How an object has moved from one touch to another."""

    T_current_reference: Transform
    """Where the object's points went, in the gel frame."""
    covariance: Covariance
    """Of a twist x in ``T_current_reference @ motion(x)``, (rad, mm)."""


@runtime_checkable
class Registration(Protocol):
    """A way to find the motion between two touches."""

    @property
    def prepares(self) -> type:
        """What ``prepare`` makes."""

    def prepare(self, touch: Touch) -> Any:
        """What one touch gives to any number of alignments."""

    def align(self, reference: Any, current: Any, T_current_reference: Transform) -> Alignment:
        """Refine a first guess of the motion between two prepared touches."""


def pixel_grid_mm(
    size_px: tuple[int, int], mm_per_px: Pair
) -> tuple[Float[np.ndarray, " w"], Float[np.ndarray, " h"]]:
    """Coordinates in the gel frame, whose origin is the frame's centre, of columns and of rows."""
    x_mm, y_mm = (
        (np.arange(count) - (count - 1) / 2) * pitch
        for count, pitch in zip(size_px, mm_per_px, strict=True)
    )
    return x_mm, y_mm


def reaches_border(contact: ContactMask) -> bool:
    """Whether the frame's border may cut a contact off."""
    return bool(contact[[0, -1]].any() or contact[:, [0, -1]].any())


def contact_middle(touch: Touch) -> Points:
    """Mean (3,) of the points of the touched skin in mm, gel frame; zero where nothing touches."""
    x_mm, y_mm = pixel_grid_mm(touch.contact.shape[::-1], touch.mm_per_px)
    touched = touch.contact.view(np.uint8)
    columns, rows = (
        cv2.reduce(touched, axis, cv2.REDUCE_SUM, dtype=cv2.CV_32S).reshape(-1) for axis in (0, 1)
    )
    depth_mm = touch.depth_mm[touch.contact].sum(dtype=float)
    return np.array([columns @ x_mm, rows @ y_mm, -depth_mm]) / max(columns.sum(), 1)


def contact_points(touch: Touch) -> Points:
    """Points (n, 3) of the touched skin in mm, gel frame."""
    x_mm, y_mm = pixel_grid_mm(touch.contact.shape[::-1], touch.mm_per_px)
    rows, columns = np.nonzero(touch.contact)
    return np.stack([x_mm[columns], y_mm[rows], -touch.depth_mm[rows, columns]], -1).astype(float)
