# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Raw frame to difference image without an array per frame: unwarped, less the blank frame."""

from typing import Any

import cv2
import numpy as np
from jaxtyping import Float32

from recon.arrays import Frame, Unwarped
from recon.fast.pages import in_large_pages
from recon.geometry.unwarp import Unwarp
from recon.kernels import compiled
from recon.same_light import brightness_of, sampled, telling


class FrameDifference:
    """Unwarps frames of one camera and takes the blank frame away."""

    def __init__(self, unwarp: Unwarp, blank: Unwarped, light: Float32[np.ndarray, "3"]) -> None:
        """Prepare the maps.

        Args:
            unwarp: of the camera's frames.
            blank: an unwarped blank frame.
            light: its ``light_of``.
        """
        self._blank = in_large_pages(np.ascontiguousarray(blank.transpose(2, 0, 1)))
        self._light, self._in_own_light = light[:, None, None], self._blank
        if (light != 1).any():
            self._in_own_light = self._blank / self._light
        self._telling = telling(self._in_own_light)
        self._maps = None
        width, height = unwarp.frame_size_px
        self._line = np.empty(width, np.uint8)
        if unwarp.maps is not None:
            # The grid of 1/32 pixel on which OpenCV interpolates, found once instead of per frame.
            self._maps = cv2.convertMaps(*unwarp.maps, cv2.CV_16SC2)
            self._scaled = in_large_pages(np.zeros((height, width, 3), np.float32))
            self._flat = in_large_pages(np.zeros_like(blank))

    def __call__(self, frame: Frame, out: Float32[np.ndarray, "3 h w"]) -> None:
        """Write the difference image of a frame as planes, in the light of the calibration."""
        self._take(frame, out)
        if self._in_own_light is not self._blank:
            out /= self._light
        factors = brightness_of(sampled(out), self._telling)
        if (factors != 1).any():
            out += self._in_own_light
            out /= factors[:, None, None]
            out -= self._in_own_light

    def _take(self, frame: Frame, out: Float32[np.ndarray, "3 h w"]) -> None:
        if self._maps is None:
            _difference(frame, self._blank, out, self._line)
            return
        np.divide(frame, np.float32(255), out=self._scaled)
        cv2.remap(
            self._scaled,
            *self._maps,
            cv2.INTER_LINEAR,
            dst=self._flat,
            borderMode=cv2.BORDER_REPLICATE,
        )
        cv2.split(self._flat, list(out))
        out -= self._blank


def _take_difference(frame: Any, blank: Any, out: Any, line: Any) -> None:
    """Divided as the reference does: times 1 / 255, half are other floats.

    As of colours side by side loops are slow, ``line`` is room for one colour of a row.
    """
    _, height, width = out.shape
    for k in range(3):
        for row in range(height):
            colors, before, difference = frame[row].reshape(-1), blank[k, row], out[k, row]
            for column in range(width):
                line[column] = colors[3 * column + k]
            for column in range(width):
                difference[column] = np.float32(line[column]) / np.float32(255) - before[column]


_difference = compiled(_take_difference)
