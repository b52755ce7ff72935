# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""A stream of one sensor to what it feels: the touched object's pose and the gel's dots."""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool

from recon.arrays import Frame, GradientField, Unwarped
from recon.calibration import Calibration
from recon.cloud import Skin
from recon.contact.disturbed import STRANGE
from recon.integration.poisson import Boundary
from recon.markers.tracking import Tracked
from recon.markers.watch import DotWatch
from recon.plausible import doubt_word
from recon.pose.estimate import PoseEstimate
from recon.pose.registration import OwnTouch
from recon.pose.tracker import Tracker
from recon.pose.warm_up import warm_up
from sensor.design import Gel

LOOK_AGAIN_S = 1.0
"""After so long it is seen whether dots that do not belong are still there: finding them takes many
times what a frame without them does."""
FORGET_S = 1.0
"""Without a touch for so long, the next one is another object."""
TRUSTED_MARKERS = ("none", "tracked", "jumped")
"""Words on dots with which slopes may be believed: a jump mixes dots up, but not what they hide."""


@dataclass(frozen=True, kw_only=True)
class KeptTouch(OwnTouch):
    """A touch that the next frame does not overwrite."""

    disturbed: Bool[np.ndarray, "_ _"]
    """Where the colour changed; of as many pixels as the frame, or of its quarter."""
    boundary: Boundary
    """``"dirichlet"``: the border was held at zero; ``"neumann"``: left free as gel moved there."""
    slope_error: GradientField | None
    """Standard deviation expected of each slope's error; ``None`` where it is not known."""

    def refuse_if_overwritten(self) -> None:
        """Nothing overwrites it."""


@dataclass(frozen=True, kw_only=True)
class Felt:
    """What one frame says."""

    image: Unwarped
    """(h, w, 3) float32: the gel plane, RGB, 0 to 1."""
    touch: KeptTouch
    """Its depth and contact."""
    pose: PoseEstimate
    """Of the object in the gel frame."""
    gel: Gel | None
    """On which the pose was found; flat without."""
    object_number: int
    """Counts the objects: poses of two numbers have nothing to do with each other."""
    dots: Tracked | None
    """``None`` on a gel without."""
    markers: str
    """A word on them, as ``Reconstruction.markers``."""
    doubt: str
    """Why the frame's depth means little, as of ``recon.plausible.doubt_word``."""


class Follower:
    """Follows what touches one sensor; its first touch is the object, its pose there the origin."""

    def __init__(self, unit: Calibration, background: Frame | None = None) -> None:
        """Begin.

        Args:
            unit: whose frames come.
            background: a blank frame of today; by default the unit's own.
        """
        warm_up()
        self._unit, self._unwarp = unit, unit.unwarp
        self._blank = self._unwarp(unit.background if background is None else background)
        self._watch = DotWatch(self._blank, unit.card.markers)
        self._dots: Tracked | None = None
        self._before: Frame | None = None
        self._unexpected = "none"
        self._looked_s = 0.0
        self.gel = unit.gel
        """On which the object travels; ``None`` where it counts as flat."""
        self._track = Tracker(gel=self.gel)
        self._object_number = 0
        self._touched_s: float | None = None
        """When the object last touched; ``None`` before it has."""

    def begin_anew(self) -> None:
        """Take what touches next for another object."""
        self._track = Tracker(gel=self.gel)
        self._object_number += 1
        self._touched_s = None

    def __call__(self, frame: Frame, touch: Skin, now_s: float) -> Felt:
        """Take in a frame and what was reconstructed of it, at a time that only grows."""
        kept = KeptTouch(
            gradient=touch.gradient.copy(),
            depth_mm=touch.depth_mm.copy(),
            contact=touch.contact.copy(),
            disturbed=touch.disturbed,
            boundary=touch.boundary,
            mm_per_px=touch.mm_per_px,
            slope_error=touch.slope_error,
        )
        image = self._unwarp(frame)
        still = self._before is not None and np.array_equal(self._before, frame)
        if self._watch.tracker is not None:
            self._dots = self._watch.tracker.track(image, self._dots)
        word = self._watch.word(self._dots) or self._word_on_unexpected(image, now_s)
        self._before = frame.copy()
        doubt = doubt_word(kept, self._unit)
        found = followed(self._track, kept, doubt)
        if found.reason != "nothing touches":
            self._touched_s = now_s
        elif self._touched_s is not None and now_s - self._touched_s > FORGET_S:
            self.begin_anew()
        return Felt(
            image=image,
            touch=kept,
            pose=doubted(found, word, still=still, doubt=doubt),
            gel=self.gel,
            object_number=self._object_number,
            dots=self._dots,
            markers=word,
            doubt=doubt,
        )

    def _word_on_unexpected(self, image: Unwarped, now_s: float) -> str:
        if self._unexpected == "none" or now_s - self._looked_s > LOOK_AGAIN_S:
            self._unexpected, self._looked_s = self._watch.unexpected(image), now_s
        return self._unexpected


def followed(track: Tracker, touch: Skin, doubt: str) -> PoseEstimate:
    """What a tracker says of the next touch, where the frame is one that it may see.

    It gets none that differs all over, and before its first pose none that is doubted: the object
    would be what that shows, and every touch after it another.

    Args:
        track: of one object.
        touch: what was reconstructed of the frame.
        doubt: of ``recon.plausible.doubt_word``.
    """
    if doubt == STRANGE or (doubt and not track.begun):
        return PoseEstimate(state="lost", reason=doubt)
    return track(touch)


def doubted(found: PoseEstimate, markers: str, *, still: bool, doubt: str = "") -> PoseEstimate:
    """What a tracker says of the slopes, with what else is known of the frame.

    Args:
        found: from these slopes.
        markers: ``Reconstruction.markers`` or ``Tracked.word``: where it puts slopes in doubt, a
            pose is weak.
        still: the frame is that before to the last bit, as no camera's is: where nothing touches,
            nothing can be known of it.
        doubt: why slopes mean little (``recon.plausible.doubt_word``), if so: the reason, then, of
            a pose that is weak and of none.
    """
    if found.state == "lost" and still:
        return replace(found, reason="the stream stands still")
    if doubt and found.state != "frozen":
        return replace(found, state="lost" if found.state == "lost" else "weak", reason=doubt)
    if found.state != "tracking":
        return found
    if markers in TRUSTED_MARKERS:
        return found
    return replace(found, state="weak", reason=f"the dots on the gel: {markers}")
