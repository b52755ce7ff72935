# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""JPEG bytes to depth in millimetres, with everything prepared that one unit's frames share."""

import math
import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import cached_property, partial
from pathlib import Path
from threading import Lock

import cv2
import numpy as np
from jaxtyping import Float32

from recon.arrays import ContactMask, DepthMap, Frame
from recon.calibration import Calibration, load_calibration
from recon.contact.disturbed import boundary_of, disturbed_in_planes
from recon.depth import Depth, depth_of, fewer_px, untouched_depth
from recon.estimators import gradient_field
from recon.estimators.default import Default
from recon.estimators.mlp import Mlp
from recon.fast.disturbance import LEAST_SIDE_PX, LEAST_STILL_PX, FrameDisturbance, border_of
from recon.fast.dots import FrameDots, FrameSlopes
from recon.fast.ensemble import FrameEnsemble, Seen
from recon.fast.inference import BORDERS, FrameInference
from recon.fast.network import FrameMlp
from recon.fast.pages import in_large_pages
from recon.fast.poisson import FrameIntegrator
from recon.fast.still import FrameStill
from recon.fast.unwarping import FrameDifference
from recon.fast.weighing import FrameWeighing
from recon.integration.poisson import Boundary
from recon.integration.weighed import resting, shorter_side_mm
from recon.lights import Axis, line_turn_deg, unseen_axis
from recon.markers.watch import DotWatch
from recon.missing_axis.mirrored import rows_beyond
from recon.missing_axis.moved import MARGIN_PX, widest_support
from recon.quarters import SIDE_PX, QuarterMask, in_pixels, in_quarters
from recon.same_light import light_of
from recon.still import without_still
from recon.stream.frame import TimedFrame
from recon.stream.jpeg import decode_jpeg
from recon.touched import Touched
from sensor.errors import WedgeError
from sensor.toml import Pair

BESIDE_DOTS = 0.8
"""Of their spacing: dots are filled from so much of the gel that counts as flat beside a contact,
which is as wide as one of them is."""
BESIDE_RESIZED = 1
"""In quarters: the same, for slopes that are interpolated from half the resolution."""


@dataclass
class Frames:
    """Those that a reconstructor took in; a deep copy of a touch has its own, and they stay."""

    count: int = 0
    """How many."""


@dataclass(frozen=True, kw_only=True)
class Touch(Touched):
    """What one frame says. The next frame overwrites the arrays: keep ``copy.deepcopy(touch)``.

    What was asked of it before then stays; anything else is refused with a ``WedgeError``.
    """

    disturbed: ContactMask | QuarterMask
    """Where the colour changed; of as many pixels as the frame, or of its quarter."""
    watch: DotWatch
    """Of the gel's dots."""
    frames: Frames
    """Of its reconstructor."""
    number: int
    """Of its own frame, among them."""

    def refuse_if_overwritten(self) -> None:
        """Refuse to work out anything from arrays that are another frame's by now."""
        if self.frames.count != self.number:
            raise WedgeError(
                "the next frame has overwritten this touch: ask it before, or keep "
                "copy.deepcopy(touch)."
            )

    @cached_property
    def contact(self) -> ContactMask:
        """Where something touches; worked out when first asked for."""
        height, width = self.depth_mm.shape
        disturbed = self.disturbed
        if disturbed.shape != self.depth_mm.shape:
            disturbed = in_pixels(disturbed, (width, height))
        return self._held_of(disturbed)

    @cached_property
    def markers(self) -> str:
        """A word on the dots, as ``Reconstruction.markers``; worked out when asked for."""
        self.refuse_if_overwritten()
        watch = self.watch
        return watch.word(self.dots) or watch.unexpected(self.difference + watch.blank)


class FastReconstructor:
    """Frames of one unit to depth at camera rate, as ``Reconstructor`` would.

    Slopes agree with it to 1e-3, where an axis is inferred to 3e-3. What is disturbed, which
    chooses the border and the gel that ``default`` takes for flat, is found at a quarter of the
    resolution, but for small frames, and for lights on one line, which need it in pixels: so in
    large frames slopes beside still gel are zero in one and not in the other. In 200 presses of
    five sets that were 0.5 to 2.0 % of the pixels (medians of the sets; 5.8 % at most), and depth
    was off by 0.10 mm at most, by more than 0.03 mm in four. With ``mlp``, slopes of 200 presses
    agreed to 1e-3. Of 138, three got another border, by which depth is off by up to 0.09 mm. The
    lookup table is the reference's.

    It serves one thread at a time, for its arrays are overwritten: make one for each stream. Where
    Python itself runs it, OMP_NUM_THREADS=1 in the environment keeps BLAS from waiting for threads.

        reconstruct = FastReconstructor.load("units/wedge-001")
        for frame in Newest(open_source("http://10.55.0.1:8080")):
            depth_mm = reconstruct(frame).depth_mm
    """

    def __init__(
        self, calibration: Calibration, background: Frame | None = None, *, threads: int = 1
    ) -> None:
        """Prepare for a unit.

        Args:
            calibration: the unit.
            background: a blank frame of today; by default the one of the calibration.
            threads: that share the network's work.

        Raises:
            WedgeError: the background has another size than the unit's frames, or is grey, or there
                is no thread.
        """
        if threads < 1:
            raise WedgeError(f"threads must be 1 or more, not {threads}.")
        self.calibration = calibration
        card, unwarp = calibration.card, calibration.unwarp
        self._unwarp = unwarp
        if background is not None:
            unwarp.check_colored(background)
        own = unwarp(calibration.background)
        seen = own if background is None else unwarp(background)
        light = light_of(seen - own, own)
        blank = seen / light
        self._watch = DotWatch(blank, card.markers)
        tracker = self._watch.tracker
        self._dots = None if tracker is None else FrameDots(tracker, blank, card.mm_per_px)
        # Dots on slopes of which one is not seen are filled in another way: ``recon.depth`` knows.
        inferred = card.missing_axis != "none" or self._dots is not None
        self._unseen = unseen_axis(card.lights_deg, card.channels) if inferred else None
        lit = [channel in calibration.estimator.channels for channel in "RGB"]
        self._lit = np.array(lit, np.float32)[:, None, None]
        size_px = unwarp.size_px
        width, height = size_px
        self._frame = in_large_pages(np.zeros((*unwarp.frame_size_px[::-1], 3), np.uint8))
        self._difference = in_large_pages(np.zeros((3, height, width), np.float32))
        self._gradient = in_large_pages(np.zeros((2, height, width), np.float32))
        self._take_difference = FrameDifference(unwarp, seen, light)
        self._side_mm = shorter_side_mm((height, width), card.mm_per_px)
        self._small = min(size_px) < LEAST_SIDE_PX
        self._find_disturbance = FrameDisturbance(size_px, calibration.estimator.channels)
        # ``FrameInference`` has its own, for fewer pixels.
        borders: tuple[Boundary, ...] = BORDERS if self._unseen is None else ()
        self._integrate = {
            border: FrameIntegrator(size_px, card.mm_per_px, border) for border in borders
        }
        estimator, reach = calibration.estimator, 0
        self._infer: FrameInference | None = None
        # Frames whose lights lie on an oblique line are turned by the reference.
        oblique = line_turn_deg(card.lights_deg, card.channels) != 0
        if self._unseen is not None and card.missing_axis == "network" and not oblique:
            hinted, reach = estimator.looks_around, _reach(size_px, card.mm_per_px)
            self._infer = FrameInference(size_px, card.mm_per_px, self._unseen, hinted=hinted)
        self._mlp = FrameMlp(estimator, size_px) if isinstance(estimator, Mlp) else None
        self._ours: FrameEnsemble | None = None
        self._find_still: FrameStill | None = None
        self._asked = self._gradient
        self._weigh: dict[Boundary, FrameWeighing] = {}
        if isinstance(estimator, Default):
            self._ours = FrameEnsemble(estimator, size_px)
            if min(size_px) >= LEAST_STILL_PX:
                self._find_still = FrameStill(estimator, size_px)
            asked_px = self._ours.asked_px
            if asked_px != size_px:
                self._asked = np.zeros((2, *asked_px[::-1]), np.float32)
                reach = max(reach, BESIDE_RESIZED)
            self._weigh = {
                border: FrameWeighing(size_px, card.mm_per_px, border) for border in borders
            }
        if tracker is not None and (self._small or self._unseen is not None):
            reach = max(reach, math.ceil(BESIDE_DOTS * tracker.markers.spacing_px / SIDE_PX))
        self._beside = np.ones((2 * reach + 1, 2 * reach + 1), np.uint8)
        rows = self._asked.shape[1]
        self._parts = [
            slice(rows * i // threads, rows * (i + 1) // threads) for i in range(threads)
        ]
        self._free, self._frames = Lock(), Frames()
        self._pool: ThreadPoolExecutor | None = None
        self._pool_of = os.getpid()
        self(calibration.background)  # what must be compiled is, before the first frame comes

    @classmethod
    def load(
        cls, folder: str | Path, background: Frame | None = None, *, threads: int = 1
    ) -> "FastReconstructor":
        """Read a unit folder and prepare for it.

        Raises:
            WedgeError: the folder is not a unit folder or is damaged.
        """
        return cls(load_calibration(folder), background, threads=threads)

    def __call__(self, frame: bytes | Frame | TimedFrame) -> Touch:
        """Reconstruct one frame: a JPEG, pixels (h, w, 3) uint8 RGB, or what a source gave.

        Raises:
            WedgeError: the JPEG is damaged, or of another size than the unit's frames, or another
                thread's frame is in work.
        """
        if not self._free.acquire(blocking=False):
            raise WedgeError(
                "a FastReconstructor serves one thread at a time: make one for each stream."
            )
        try:
            return self._touch(frame)
        finally:
            self._free.release()

    def _touch(self, frame: bytes | Frame | TimedFrame) -> Touch:
        if isinstance(frame, TimedFrame):
            undecoded = frame.jpeg if frame.pixels is None else None
            frame = frame.image() if undecoded is None else undecoded
        pixels = decode_jpeg(frame, self._frame) if isinstance(frame, bytes) else frame
        self._unwarp.check_colored(pixels)
        if not pixels.flags.carray:  # loops are compiled for what JPEGs are decoded to, alone
            for channel in range(3):  # quicker than all at once
                self._frame[..., channel] = pixels[..., channel]
            pixels = self._frame
        self._frames.count += 1  # from here on, arrays are written
        difference, gradient = self._difference, self._gradient
        self._take_difference(pixels, difference)
        dots, hidden = (None, None) if self._dots is None else self._dots.followed(difference)
        touch = partial(
            Touch,
            difference=difference.transpose(1, 2, 0),
            mm_per_px=self.calibration.card.mm_per_px,
            lights_deg=self.calibration.card.lights_deg,
            estimator=self.calibration.estimator,
            watch=self._watch,
            dots=dots,
            frames=self._frames,
            number=self._frames.count,
        )
        if self._unseen is not None:
            disturbed, found = self._inferred(difference, hidden, self._unseen)
            return touch(
                gradient=found.gradient,
                depth_mm=found.depth_mm,
                boundary=found.boundary,
                disturbed=disturbed,
                doubt=found.doubt,
            )
        if self._small:
            disturbed = disturbed_in_planes(difference * self._lit)
            quartered = in_quarters(disturbed)
        else:
            disturbed = quartered = self._find_disturbance(difference)
        slopes = None if self._dots is None or hidden is None else self._dots.slopes(hidden)
        around = None if self._small else slopes
        near = self._take_gradient(difference, partial(self._near, quartered), gradient, around)
        if slopes is not None:
            where = near
            if self._small and near is not None:  # all slopes that were asked for, and dots beside
                where = cv2.dilate(near.view(np.uint8), self._beside, iterations=2) > 0
            slopes(gradient, where)
        reach = self.calibration.estimator.reach
        moved = disturbed if near is None else near
        if self._small and reach is not None:
            still = without_still(np.moveaxis(gradient, 0, -1).copy(), disturbed, reach)
            gradient[:] = np.moveaxis(still, -1, 0)
            moved = np.asarray(gradient.any(0))
        elif near is not None and (self._beside.size > 1 or slopes is not None):
            gradient *= in_pixels(near, self._unwarp.size_px)
        border = (boundary_of if self._small else border_of)(moved)
        depth_mm = self._integrate[border](gradient)
        weigh = self._weigh.get(border)
        if weigh is None or not weigh(gradient, depth_mm, rests=self._resting(gradient, depth_mm)):
            middles = slice(SIDE_PX // 2, None, SIDE_PX)
            some = depth_mm if self._small else depth_mm[middles, middles]
            if level_mm := untouched_depth(some, _cut(disturbed, some), border):
                depth_mm -= level_mm
        return touch(
            gradient=gradient.transpose(1, 2, 0),
            depth_mm=depth_mm,
            boundary=border,
            disturbed=disturbed,
        )

    def _resting(self, gradient: Float32[np.ndarray, "2 h w"], depth_mm: DepthMap) -> ContactMask:
        """``resting`` of planes; but for small frames, told by a pixel in every quarter."""
        few = np.s_[:, :] if self._small else np.s_[::SIDE_PX, ::SIDE_PX]
        rests = resting(np.moveaxis(gradient, 0, -1)[few], depth_mm[few], self._side_mm)
        return rests if self._small else in_pixels(rests, self._unwarp.size_px)

    def _near(self, disturbed: QuarterMask, small: Seen) -> QuarterMask | None:
        """What our estimator does not take for flat; ``None`` is everywhere."""
        return None if self._find_still is None else self._find_still(small, disturbed)

    def _take_gradient(
        self,
        difference: Float32[np.ndarray, "3 h w"],
        near: Callable[[Seen], QuarterMask | None],
        out: Float32[np.ndarray, "2 h w"],
        slopes: FrameSlopes | None = None,
    ) -> QuarterMask | None:
        """Write gradients as planes, our estimator's of what is near and beside it alone.

        What is near is given back; ``None`` is everywhere.
        """
        moved: QuarterMask | None = None
        apply: Callable[[slice], None]
        if self._mlp is not None:
            apply = partial(self._mlp, difference, self._asked)
        elif self._ours is not None:
            seen, small = self._ours.prepared(difference)
            moved = near(small)
            asked = None if moved is None else cv2.dilate(moved.view(np.uint8), self._beside) > 0
            if asked is not None and slopes is not None:
                asked = slopes.around(asked)
            apply = partial(self._ours, seen, self._asked, near=asked)
        else:
            whole = np.ascontiguousarray(np.moveaxis(difference, 0, -1))
            out[:] = np.moveaxis(gradient_field(self.calibration.estimator, whole), -1, 0)
            return None
        self._run(apply)
        if self._asked is not out:
            for few, every in zip(self._asked, out, strict=True):
                cv2.resize(few, every.shape[::-1], dst=every)
        return moved

    def _run(self, apply: Callable[[slice], None]) -> None:
        """Apply to all rows, shared out among the threads."""
        if len(self._parts) == 1:
            apply(slice(None))
            return
        if self._pool is None or self._pool_of != os.getpid():  # a fork has none of our threads
            self._pool, self._pool_of = ThreadPoolExecutor(len(self._parts)), os.getpid()
        list(self._pool.map(apply, self._parts))

    def _inferred(
        self,
        difference: Float32[np.ndarray, "3 h w"],
        hidden: ContactMask | None,
        unseen: Axis,
    ) -> tuple[ContactMask, Depth]:
        """What is disturbed, and depth, where an axis is not seen."""
        card = self.calibration.card
        disturbed = disturbed_in_planes(difference * self._lit)
        near = None
        if self._infer is not None:  # elsewhere it takes gel for flat
            near = in_quarters(widest_support(disturbed, unseen))
        self._take_gradient(difference, lambda _: near, self._gradient)
        gradient = np.moveaxis(self._gradient, 0, -1)
        hinted = self.calibration.estimator.looks_around
        if near is not None and any(rows_beyond(disturbed, gradient, unseen, hinted=hinted)):
            self._take_gradient(difference, lambda _: None, self._gradient)
        return disturbed, depth_of(
            gradient.copy(),
            disturbed,
            self.calibration.estimator,
            missing=card.missing_axis,
            lights_deg=card.lights_deg,
            mm_per_px=card.mm_per_px,
            hidden=hidden,
            infer=self._infer,
        )


def _reach(size_px: tuple[int, int], mm_per_px: Pair) -> int:
    """How far beside gel that may have moved slopes count, in quarters.

    Of a long frame they are averaged over some pixels, and its margin is as many of the averages;
    flanks are rounded to whole ones.
    """
    width, height = size_px
    rows, columns, _ = fewer_px(height, width, mm_per_px)
    shrunk = max(height / rows, width / columns)
    return math.ceil((shrunk * (MARGIN_PX + 2) - MARGIN_PX) / SIDE_PX)


def _cut(mask: QuarterMask, like: DepthMap) -> ContactMask:
    """The part of a quarter's mask that a strided view of the frame has."""
    return mask[: like.shape[0], : like.shape[1]]
