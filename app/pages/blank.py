# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""A new blank frame from a stream: the mean of a second's frames, where nothing moves in them."""

import time

import numpy as np

from recon.arrays import Frame
from recon.contact.disturbed import disturbed_mask
from recon.medians import PER_MAD
from sensor.errors import WedgeError

BLANK_FRAMES = 12
LEAST_FRAMES = 3
"""Frames that are enough of a slow stream, once the time is over."""
LEAST_GRAIN, TIMES, SHARE = 1.5 / 255, 8.0, 0.002
"""A gel moves where more than this share of its pixels change by so many times the frame's grain,
which is this at least: the edges of dots that moved by a tenth of a pixel do."""
LONGEST_S = 3.0
"""Time from the request on: whoever asked lets go of the gel for some seconds, not for ever."""


class BlankTaker:
    """Takes the frames that come after somebody asked."""

    def __init__(self, connection: int) -> None:
        """Begin now.

        Args:
            connection: which one of the source's: frames of the next may show anything.
        """
        self._connection = connection
        self._until_s = time.monotonic() + LONGEST_S
        self._frames: list[Frame] = []

    def add(self, frame: Frame | None, connection: int) -> Frame | None:
        """Take the next frame, (h, w, 3) uint8 RGB, or that there is none yet.

        Returns:
            Their mean, once there are enough.

        Raises:
            WedgeError: the gel moves, the connection broke off, frames of another size came, all
                are the same to the last bit, or too few in time.
        """
        if connection != self._connection:
            raise WedgeError("the connection broke off meanwhile.")
        if frame is not None:
            first = self._frames[0] if self._frames else frame
            if frame.shape != first.shape:
                raise WedgeError("the frame size changed.")
            if _moved(first, frame):
                raise WedgeError("the gel moved: let go of it and take it again.")
            self._frames.append(frame)
        is_over = time.monotonic() > self._until_s
        if len(self._frames) >= (LEAST_FRAMES if is_over else BLANK_FRAMES):
            if all(np.array_equal(frame, self._frames[0]) for frame in self._frames[1:]):
                raise WedgeError("the picture stands still, as of a camera that hangs.")
            return np.mean(self._frames, axis=0).round().astype(np.uint8)
        if is_over:
            raise WedgeError(f"only {len(self._frames)} frames came in {LONGEST_S:g} s.")
        return None


def _moved(before: Frame, after: Frame) -> bool:
    """Whether frames differ by more than noise: in a contact, or all over, at the edges of dots."""
    change = (after.astype(np.float32) - before) / np.float32(255)
    size = np.abs(change)
    grain = max(PER_MAD * float(np.median(size)), LEAST_GRAIN)
    all_over = float((size.max(-1) > TIMES * grain).mean())
    return all_over > SHARE or bool(disturbed_mask(change).any())
