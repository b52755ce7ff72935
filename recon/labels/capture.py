# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Which frames of a live sensor are good ball presses, and where on the pad some are missing."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Literal

import cv2
import numpy as np
from jaxtyping import Float32

from recon.arrays import ContactMask, Difference, Frame, Unwarped
from recon.contact.disturbed import STRANGE, disturbed_mask, is_strange
from recon.contact.raised import is_raised
from recon.coverage import Coverage
from recon.geometry.unwarp import PixelMap, Unwarp
from recon.labels.circles import Circle
from recon.labels.find_circle import DOUBTFUL, find_circle, refuse_ball
from recon.labels.sharpness import detail_kept
from recon.presses import fingerprint
from recon.same_light import in_same_light
from sensor.toml import Pair

BLANK_FRAMES = 8
"""Averaged to the background: its noise then is a third of a frame's."""
STILL_FRAMES = 3
"""In a row, before a frame is taken."""
STILL_FACTOR = 1.6
"""Neighbouring frames of a still gel differ by noise; a finger that moves adds to that."""
LEAST_STILL = 1 / 255
MOST_BLANK_CHANGE = 6 / 255
"""Since the first of the blank frames, noise smoothed: steps of a steady motion are alike, too."""
LEAST_DETAIL = 0.7
"""A frame that keeps less of the blank frame's fine structure is out of focus or shaken."""
SATURATED_LEVEL = 250
MOST_SATURATED = 0.3
"""Of the contact's pixels, in any colour: what saturates says nothing about the slope.

`wedge accept` fails a sensor beyond it; real presses that calibrate lie far below:
at most 0.12 of 22 of one sensor, none of 98 of two others.
"""

NO_CALIPER = "this is a ball, not the caliper"
TOUCHED = "something touched while the blank gel was taken"
AGAIN = f"{TOUCHED}: start again"

State = Literal["blank", "waiting", "lift"]


@dataclass(frozen=True, kw_only=True)
class Verdict:
    """What was made of one frame."""

    taken: bool
    words: str
    """What happened and, of a sensor's frames, what the person at it is to do next."""
    circle: Circle | None = None
    """Of a ball's frame that was taken; ``None`` for a caliper's."""


class PressWatcher:
    """Looks at every frame of a sensor and says which to keep.

    First the blank gel: still frames, averaged. Then, for each press: wait until something
    touches and holds still, judge that frame, and wait until the gel is free again. The first
    presses may be a caliper's.
    """

    def __init__(
        self,
        unwarp: Unwarp,
        ball_radius_mm: float,
        mm_per_px: Pair,
        calipers: int = 0,
        lights_deg: Mapping[str, float] | None = None,
    ) -> None:
        """Begin with the blank gel, which nothing must touch; ``calipers`` presses follow.

        With ``lights_deg``, azimuths of the colours' lights, it shows if something touched it.

        Raises:
            WedgeError: the ball cannot be found at this scale.
        """
        refuse_ball(unwarp.size_px, ball_radius_mm, mm_per_px)
        self.unwarp = unwarp
        self.ball_radius_mm, self.mm_per_px = ball_radius_mm, mm_per_px
        self.state: State = "blank"
        self.calipers_left = calipers
        self.lights_deg = lights_deg
        self.coverage = Coverage(unwarp.size_px, mm_per_px)
        self.background: Frame | None = None
        self._taken: set[str] = set()
        """Fingerprints of presses: a picture that comes twice is no second one."""
        self._blanks: list[Frame] = []
        self._steps: list[float] = []
        self._blank: Unwarped | None = None
        self._noise = 0.0
        self._single: Frame | None = None
        """One blank frame, as noisy as those that it is compared with."""
        self._last: Unwarped | None = None
        self._still = 0
        self._kept: tuple[Unwarped, ContactMask] | None = None
        """The frame that was taken last, and where something touched on it."""

    def look(self, frame: Frame) -> Verdict:
        """Look at the next frame of the stream, (h, w, 3) uint8 RGB.

        Raises:
            WedgeError: the frame has another size than the camera's.
        """
        seen = self.unwarp(frame)
        moved = np.inf if self._last is None else _moved(seen, self._last)
        self._last = seen
        if self.state == "blank":
            return self._look_at_blank(frame, seen, moved)
        assert self._blank is not None
        difference = in_same_light(seen - self._blank, self._blank)
        contact = disturbed_mask(difference)
        if not contact.any():
            self.state, self._still = "waiting", 0
            return _no(f"no contact: {self._wanted}")
        if self.state == "lift":
            if self._has_another(seen):
                return _no(f"two places differ from the blank gel: if only one is touched, {AGAIN}")
            return _no(f"taken: lift it, then {self._wanted}")
        is_still = moved < max(STILL_FACTOR * self._noise, LEAST_STILL)
        self._still = self._still + 1 if is_still else 0
        if self._still < STILL_FRAMES:
            return _no("still moving: hold it")
        verdict = self._judge(frame, seen, difference, contact)
        next_one = f"lift it, then {self._wanted}" if verdict.taken else self._wanted
        is_told = verdict.taken or verdict.words == NO_CALIPER
        return replace(verdict, words=f"{verdict.words}: {next_one}") if is_told else verdict

    def judge_alone(self, frame: Frame) -> Verdict:
        """Judge a frame that has no neighbours in time, as a folder's; the blank gel is known."""
        assert self._blank is not None
        seen = self.unwarp(frame)
        difference = in_same_light(seen - self._blank, self._blank)
        contact = disturbed_mask(difference)
        if not contact.any():
            return _no("no contact")
        verdict = self._judge(frame, seen, difference, contact)
        self.state = "waiting"
        return verdict

    def set_background(self, background: Frame) -> None:
        """Take a blank frame as it is, instead of waiting for still ones."""
        self.background = background
        self._blank = self.unwarp(background)
        self._single = background
        self.state = "waiting"

    def look_through(self, unwarp: Unwarp, ball_radius_mm: float, mm_per_px: Pair) -> None:
        """Judge by other corners, another ball or scale from here on; the blank gel is known.

        It stays, and the presses count where their middles lie now.
        """
        assert self.background is not None and self._blank is not None
        before = self.unwarp
        middles_px = [_carried(x, before, unwarp) for x in self.coverage.centers_px]
        self.unwarp, self._blank, self._last = unwarp, unwarp(self.background), None
        self._kept = None
        self.ball_radius_mm, self.mm_per_px = ball_radius_mm, mm_per_px
        self.coverage = Coverage(unwarp.size_px, mm_per_px)
        for middle_px in middles_px:
            self.coverage.add(middle_px)

    @property
    def _wanted(self) -> str:
        """What to press next."""
        if self.calipers_left:
            along = "across" if self.calipers_left % 2 else "along"
            return f"press the caliper's jaws, the gap measured {along} the finger"
        return f"press the ball, next at: {self.coverage.next_place}"

    def _look_at_blank(self, frame: Frame, seen: Unwarped, moved: float) -> Verdict:
        if self._blanks:
            away = _moved(seen, self.unwarp(self._blanks[0]))
            uneven = len(self._steps) > 1 and moved > 3 * max(*self._steps, LEAST_STILL)
            if uneven or away > MOST_BLANK_CHANGE:
                self._blanks.clear()
                self._steps.clear()
                return _no("still moving: let go of the gel")
            self._steps.append(moved)
        self._blanks.append(frame)
        if len(self._blanks) < BLANK_FRAMES:
            return _no(f"blank gel, {len(self._blanks)} of {BLANK_FRAMES}: touch nothing")
        self.set_background(np.stack(self._blanks).mean(axis=0).round().astype(np.uint8))
        # An average is smoother than any frame: the frames' own noise is what others compare with.
        self._noise, self._single = max(self._steps), self._blanks[-1]
        return _no(f"the blank gel is known: {self._wanted}")

    def _judge(
        self, frame: Frame, seen: Unwarped, difference: Difference, contact: np.ndarray
    ) -> Verdict:
        """Keep a frame, or say what is wrong with it; not what to do next, as a file is done."""
        self._still = 0
        known_by = fingerprint(frame)
        if known_by in self._taken:
            return _no("the same picture, pixel by pixel, as one already taken")
        assert self._single is not None
        saturated = (seen[contact] >= SATURATED_LEVEL / 255).any(-1).mean()
        if saturated > MOST_SATURATED:
            return _no(f"saturated on {saturated:.0%} of the contact: lower the exposure")
        if is_strange(contact):
            return _no(f"{STRANGE}: are the lights on?")
        if detail_kept(frame, self._single) < LEAST_DETAIL:
            return _no("blurred: hold the sensor still, or correct its focus")
        circle = find_circle(difference, self.ball_radius_mm, self.mm_per_px)
        where = contact if circle is None else _disc(circle, contact.shape)
        if self.lights_deg and is_raised(difference, where, self.lights_deg):
            return self._without_blank()
        if self.calipers_left:
            if circle is not None and circle.quality >= DOUBTFUL:
                return _no(NO_CALIPER)
            self.calipers_left -= 1
            self._lift(seen, contact)
            return Verdict(taken=True, words="caliper taken")
        if circle is None:
            return _no("no ball is recognised: press only the ball, not its holder")
        self._taken.add(known_by)
        self.coverage.add(circle.center_px)
        self._lift(seen, contact)
        x, y = circle.center_px
        return Verdict(taken=True, words=f"taken at ({x:.0f}, {y:.0f}) px", circle=circle)

    def _lift(self, seen: Unwarped, contact: ContactMask) -> None:
        self.state, self._kept = "lift", (seen, contact)

    def _has_another(self, seen: Unwarped) -> bool:
        """Whether something touches beside what was taken last, which is as it was."""
        if self._kept is None:
            return False
        kept, contact = self._kept
        changed = disturbed_mask(seen - kept)
        return bool(changed.any()) and not (changed & contact).any()

    def _without_blank(self) -> Verdict:
        """Take the blank gel anew, unless it is a file's, or presses were judged by it."""
        if not self._blanks:
            return _no("something touches on the picture of the blank gel: give another")
        if self._taken:
            return _no(AGAIN)
        self._blanks.clear()
        self._steps.clear()
        self.state = "blank"
        return _no(f"{TOUCHED}: it is taken anew, touch nothing")


def _no(words: str) -> Verdict:
    return Verdict(taken=False, words=words)


def _disc(circle: Circle, shape: tuple[int, ...]) -> ContactMask:
    """Pixels inside a circle."""
    y, x = np.indices(shape)
    return np.hypot(x - circle.center_px[0], y - circle.center_px[1]) < circle.radius_px


def _carried(place_px: Pair, before: Unwarp, after: Unwarp) -> Pair:
    """The pixel of another unwarped picture that shows what a pixel of the first one does."""
    map_x, map_y = _raw_pixels(before)
    column = int(np.clip(round(place_px[0]), 0, map_x.shape[1] - 1))
    row = int(np.clip(round(place_px[1]), 0, map_x.shape[0] - 1))
    x_px, y_px = map_x[row, column], map_y[row, column]
    map_x, map_y = _raw_pixels(after)
    nearest = np.hypot(map_x - x_px, map_y - y_px).argmin()
    return float(nearest % map_x.shape[1]), float(nearest // map_x.shape[1])


def _raw_pixels(unwarp: Unwarp) -> tuple[PixelMap, PixelMap]:
    """Raw x and y of every unwarped pixel."""
    if unwarp.maps is not None:
        return unwarp.maps
    width, height = unwarp.size_px
    x, y = np.meshgrid(np.arange(width, dtype=np.float32), np.arange(height, dtype=np.float32))
    return x, y


def _moved(a: Float32[np.ndarray, "h w 3"], b: Float32[np.ndarray, "h w 3"]) -> float:
    """How much two frames differ where they differ most: the 99th percentile, noise smoothed."""
    change = np.abs(cv2.GaussianBlur(a - b, (0, 0), 2)).max(-1)
    return float(np.percentile(change, 99))
