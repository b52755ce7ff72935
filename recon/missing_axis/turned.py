# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Frames turned so that the line of their lights lies along an axis, and back.

Whatever infers an unseen slope works along rows or columns. Lights on an oblique line see the slope
along it: in a frame turned by as much, that is the slope along an axis. Beyond the frame lies gel
that rests.
"""

import math
from dataclasses import dataclass

import cv2
import numpy as np
from jaxtyping import Bool, Float, Float32

from recon.arrays import ContactMask, GradientField
from sensor.toml import Pair


@dataclass(frozen=True, kw_only=True)
class Turn:
    """A frame and a larger one around it, of square pixels and turned about its middle."""

    size_px: tuple[int, int]
    """(width, height) of the frame."""
    mm_per_px: Pair
    """Its pixel pitch along x and y."""
    by_deg: float
    """From the frame's x axis toward its y axis to the turned frame's x axis."""

    @property
    def pitch_mm(self) -> float:
        """Of the turned frame's pixels: as many of them show the same area."""
        return math.sqrt(self.mm_per_px[0] * self.mm_per_px[1])

    @property
    def turned_px(self) -> tuple[int, int]:
        """(width, height) of the turned frame, which holds all of the other."""
        cos, sin = abs(self._cos), abs(self._sin)
        width, height = (
            side * pitch for side, pitch in zip(self.size_px, self.mm_per_px, strict=True)
        )
        return (
            math.ceil((width * cos + height * sin) / self.pitch_mm),
            math.ceil((width * sin + height * cos) / self.pitch_mm),
        )

    def slopes(self, gradient: GradientField) -> Float32[np.ndarray, "rows columns 2"]:
        """Slopes along the turned frame's axes; zero beyond the frame."""
        along = self._mixed(gradient, -self._sin)
        return self._sampled(along, self._to_frame, self.turned_px)

    def mask(self, mask: ContactMask) -> Bool[np.ndarray, "rows columns"]:
        """A mask as the turned frame shows it."""
        shown = self._sampled(mask.astype(np.float32), self._to_frame, self.turned_px)
        return np.asarray(shown >= 0.5)

    def slopes_back(self, gradient: Float32[np.ndarray, "rows columns 2"]) -> GradientField:
        """Slopes of the turned frame, along the frame's own axes."""
        return self._mixed(self.back(gradient), self._sin)

    def back(self, image: Float32[np.ndarray, "rows columns *c"]) -> Float32[np.ndarray, "h w *c"]:
        """An image of the turned frame in the frame."""
        to_turned = np.linalg.inv(np.vstack([self._to_frame, [0, 0, 1]]))[:2]
        return self._sampled(image, to_turned, self.size_px)

    @property
    def _cos(self) -> float:
        return math.cos(math.radians(self.by_deg))

    @property
    def _sin(self) -> float:
        return math.sin(math.radians(self.by_deg))

    @property
    def _to_frame(self) -> Float[np.ndarray, "2 3"]:
        """From the turned frame's pixels to the frame's, about the middles of both."""
        turn = np.array([[self._cos, -self._sin], [self._sin, self._cos]])
        linear = turn * self.pitch_mm / np.array(self.mm_per_px)[:, None]
        middle, turned = ((np.array(size) - 1) / 2 for size in (self.size_px, self.turned_px))
        return np.column_stack([linear, middle - linear @ turned])

    def _mixed(self, gradient: GradientField, sin: float) -> Float32[np.ndarray, "h w 2"]:
        """Both components of a vector, in axes turned by the angle of that sine."""
        x, y = gradient[..., 0], gradient[..., 1]
        return np.stack([self._cos * x - sin * y, sin * x + self._cos * y], -1).astype(np.float32)

    def _sampled(
        self, image: np.ndarray, back: Float[np.ndarray, "2 3"], size_px: tuple[int, int]
    ) -> np.ndarray:
        """An image at other pixels; ``back`` leads from those to its own."""
        flags = cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
        return cv2.warpAffine(np.ascontiguousarray(image), back, size_px, flags=flags)
