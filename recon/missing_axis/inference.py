# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""The gradient along the axis that no light shows, inferred from the gradient along the other.

Both are derivatives of one surface that is flat outside the contacts, so that one says much about
the other. Slopes have no unit: the network knows neither millimetres nor the size of a frame, only
that pixels are square, which is arranged here.
"""

from dataclasses import dataclass

import cv2
import numpy as np
from jaxtyping import Float, Float32

from recon import unet
from recon.arrays import GradientField
from recon.integration.pressed import Support
from recon.lights import Axis
from recon.unet.weights import shipped_weights
from sensor.errors import WedgeError
from sensor.toml import Pair

LONGEST_SIDE_PX = 320  # of the frame that the network sees; the largest it was trained on
LARGEST_DOUBT = 2.0  # a slope's whole range

Slopes = Float[np.ndarray, "h w"]


@dataclass(frozen=True, kw_only=True)
class Completed:
    """A gradient field as the network believes it."""

    gradient: GradientField
    """(h, w, 2) float32, mm/mm: the missing axis inferred, the measured one cleaned."""
    doubt: Float32[np.ndarray, "h w"]
    """How far off the inferred slope is expected to be, mm/mm; large where it is a guess."""

    def transposed(self) -> "Completed":
        """The same of the transposed surface, whose axes are swapped."""
        return Completed(gradient=swapped(self.gradient), doubt=np.ascontiguousarray(self.doubt.T))


def swapped(gradient: Float[np.ndarray, "h w 2"]) -> Float[np.ndarray, "w h 2"]:
    """The gradient field of the transposed surface."""
    return np.ascontiguousarray(gradient.transpose(1, 0, 2)[..., ::-1])


def infer_missing_axis(
    known: Slopes,
    axis: Axis,
    mm_per_px: Pair,
    *,
    support: Support | None = None,
    weights: unet.Weights | None = None,
    longest_px: int = LONGEST_SIDE_PX,
) -> Completed:
    """Both gradients, from the measured one: ``axis`` was not measured.

    Frames longer than ``longest_px``, or of oblong pixels, are resampled to square pixels and
    the result is resampled back. A frame of any size will do; contacts that cross its border are
    inferred less well than others.

    Args:
        known: ∂depth/∂y where ``axis`` is "x", and the reverse; mm/mm, positive toward the camera.
        axis: the axis that is missing.
        mm_per_px: pixel pitch along x and y; only the ratio counts.
        support: where the gel may have moved; everywhere unless given.
        weights: of the network; the shipped ones unless given.
        longest_px: side of the frame that the network sees.

    Raises:
        WedgeError: ``known`` holds a NaN or infinity, ``mm_per_px`` is not positive, or the shipped
            weights are missing or damaged.
    """
    if axis == "y":  # the network infers x
        return infer_missing_axis(
            known.T,
            "x",
            (mm_per_px[1], mm_per_px[0]),
            support=None if support is None else support.T,
            weights=weights,
            longest_px=longest_px,
        ).transposed()
    h, w = known.shape
    measured = np.zeros((h, w, 2), np.float32)
    measured[..., 1] = known
    if not np.isfinite(measured).all():
        raise WedgeError("The known gradient holds NaN or infinity: fill such pixels first.")
    if not all(np.isfinite(pitch) and pitch > 0 for pitch in mm_per_px):
        raise WedgeError(f"mm_per_px = {tuple(mm_per_px)} must be two positive numbers.")
    if weights is None:
        weights = shipped_weights()
    if support is None:
        support = np.ones((h, w), bool)
    if measured.size == 0:
        empty = np.zeros((h, w, 2), np.float32)
        return Completed(gradient=empty, doubt=empty[..., 0])
    rows, columns = working_size(h, w, mm_per_px, longest_px)
    seen = resampled(measured, rows, columns)
    moved = resampled(support.astype(np.float32)[..., None], rows, columns)[..., 0] > 0
    maps = unet.padded(weights, unet.network_input(seen, moved, both=False))
    found = unet.forward(weights, maps)[:, :rows, :columns].transpose(1, 2, 0)
    found = resampled(found, h, w)
    gradient = np.where(support[..., None], found[..., :2], np.float32(0))
    doubt = np.minimum(np.exp(np.minimum(found[..., 2], 1.0)), np.float32(LARGEST_DOUBT))
    return Completed(gradient=gradient, doubt=np.where(support, doubt, np.float32(0)))


def working_size(
    h: int, w: int, mm_per_px: Pair, longest_px: int = LONGEST_SIDE_PX
) -> tuple[int, int]:
    """Rows and columns of the same frame in square pixels, at most ``longest_px`` long.

    Neither axis grows: stretched noise is alike in neighbouring rows, and its integral adds up.
    """
    width_mm, height_mm = w * mm_per_px[0], h * mm_per_px[1]
    pitch_mm = max(*mm_per_px, max(width_mm, height_mm) / longest_px)
    return max(1, round(height_mm / pitch_mm)), max(1, round(width_mm / pitch_mm))


def resampled(
    maps: Float32[np.ndarray, "h w c"], rows: int, columns: int
) -> Float32[np.ndarray, "rows columns c"]:
    """Maps on another grid over the same frame."""
    # One axis at a time: OpenCV averages areas only where no axis grows.
    h, w, count = maps.shape
    if columns != w:
        how = cv2.INTER_AREA if columns < w else cv2.INTER_LINEAR
        maps = cv2.resize(np.ascontiguousarray(maps), (columns, h), interpolation=how)
    if rows != h:
        how = cv2.INTER_AREA if rows < h else cv2.INTER_LINEAR
        maps = cv2.resize(np.ascontiguousarray(maps), (columns, rows), interpolation=how)
    return np.asarray(maps, np.float32).reshape(rows, columns, count)
