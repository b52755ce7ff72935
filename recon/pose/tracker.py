# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Touch after touch to the object's pose, or to a plain word why it is not known.

    track = Tracker()  # the first touch becomes the object, its pose the identity
    for frame in frames:
        found = track(reconstruct(frame))
        if found.state == "tracking":
            found.T_sensor_object

Every touch is compared with a keyframe, not with the touch before: errors add up per keyframe and
not per frame, and an object that comes back meets its first keyframe again. A result is believed
only if it explains the slopes that are seen.
"""

from collections.abc import Iterator, Mapping
from dataclasses import replace

import cv2
import numpy as np
from numpy.typing import ArrayLike

from recon.pose.agreement import agreement
from recon.pose.estimate import WEAK_DEG, WEAK_MM, PoseEstimate, disbelieved, is_certain
from recon.pose.icp import Icp
from recon.pose.joint import Joint
from recon.pose.models import (
    Keyframe,
    ObjectModel,
    TouchModel,
    keyframe,
    moved_mm,
    refuse_other_model,
    remoteness,
    turned,
)
from recon.pose.registration import Alignment, Registration, Touch, own, reaches_border
from recon.pose.rest import laid, lifted
from recon.pose.rigid import (
    Transform,
    angle_deg,
    greatest_std,
    inverse,
    is_rigid,
    rigid_or_none,
    straightened,
    turned_covariance,
)
from recon.pose.symmetry import nearest_turn
from sensor.design import Gel
from sensor.errors import WedgeError

REGISTRATIONS: Mapping[str, Registration] = {
    "joint": Joint(),
    "gicp": Icp(kind="GICP"),
    "plane": Icp(kind="PLANE_ICP"),
}
"""Ways to compare touches, by name; the first is ours."""

LEAST_CONTACT_PX = 120
"""A smaller contact shows too little to be followed."""
LEAST_SHARE, LEAST_DEPTH = 0.1, 0.03
"""Shares of the largest and of the deepest contact so far: less is a last remnant or the gel's slow
return, not the object. Prints that real ones left in a gel were at most 0.02 as deep."""
LEAST_IN_FRAME = 0.5
"""Share of the largest contact so far that must be left where the frame's border cuts it off: the
end of an edge may lie beyond, and the rest then slides along it unseen."""
LEAST_OVERLAP = 0.35
"""Share of the smaller contact that both touches must show."""
LEAST_EXPLAINED = 0.5
"""Share of the normals' energy that a pose must explain; wrong ones explain less than nothing."""
FOUND_AGAIN = 0.7
"""The same after a loss, when no motion from the last pose vouches for it."""
RECOGNIZED = 4
"""Keyframes that are tried when lost or adrift, the surest first."""
UNMATCHED = "does not match what was seen before"
UNLIKE = "its details do not match, or it has none"
LEAST_ALIKE = 0.4
"""Correlation of details; a shape without any, such as a smooth ball's, has none."""
KEYFRAME_OVERLAP = 0.75
SWITCH = 0.7
"""Share of a keyframe's reach beyond which another is looked for, or made."""
LONGEST_STEP_DEG, LONGEST_STEP_MM = 12.0, 1.2
"""Longest way from one touch to the next; a longer one is a jump."""
ADRIFT_DEG = 4.0
"""A standard deviation from which keyframes are tried wherever they are."""
ALIKE = 0.03
"""Poses whose explained shares differ by less cannot be told apart."""
SAME_DEG, SAME_MM = 5.0, 0.5
"""Poses that differ by less are taken for one."""
LOOKS = 4
"""Times that a guess is refined from where it led: a mesh looks other from ten degrees away."""
FITS = 0.95
"""Explained share of a searched pose that leaves no doubt: by ``benchmarks.pose_search`` wrong
ones, the right not being guessed, come to 0.942 at most, all 64 right ones to 0.969 and more."""


class Tracker:
    """Poses of one object, touch after touch."""

    def __init__(
        self,
        registration: str = "joint",
        model: ObjectModel | None = None,
        T_sensor_object: ArrayLike | None = None,
        gel: Gel | None = None,
    ) -> None:
        """Start without having seen anything.

        Args:
            registration: one of ``REGISTRATIONS``.
            model: what is known of the object; by default its first touch.
            T_sensor_object: its pose at the first touch; by default the identity where the first
                touch is the model, and searched where there is a model.
            gel: the sensor's, of its design: what travels over a curved one tilts, and is told from
                what turns. By default it is flat.

        Raises:
            WedgeError: the registration is unknown, the model is none, of another registration or
                on another gel, or the pose is not a rigid transform.
        """
        if registration not in REGISTRATIONS:
            raise WedgeError(
                f"there is no tracker {registration!r}: choose one of {', '.join(REGISTRATIONS)}."
            )
        gel = gel if gel is not None and gel.curved else None
        if model is not None:
            refuse_other_model(model, registration, REGISTRATIONS[registration], gel)
        start = None if T_sensor_object is None else rigid_or_none(T_sensor_object)
        if start is None and T_sensor_object is not None:
            raise WedgeError("T_sensor_object is not rigid: give a 4 x 4 transform [R t; 0 0 0 1].")
        self.registration, self._gel = REGISTRATIONS[registration], gel
        self.model: ObjectModel = TouchModel() if model is None else model
        given = self.model.surest_first()
        self._like: Touch | None = given[0].pyramid.touch if given else None
        """Whose pixels all touches share."""
        self.begun = False
        """Whether a pose was found yet."""
        self._knows_nothing = model is None
        self._searches = model is not None
        self._start = start
        self._last: Transform | None = start
        self._before: Touch | None = None
        self._estimate = PoseEstimate(state="lost", reason="nothing touches")
        self._keyframe: Keyframe | None = None
        self._recent: Keyframe | None = None
        self._sought: Keyframe | None = None
        """A touch for which no pose was found."""
        self._unsure = False
        """Whether the last search left doubt: poses that follow from it keep it."""
        self._most_px, self._most_mm = 0, 0.0

    def __call__(self, touch: Touch) -> PoseEstimate:
        """Take in the next touch.

        Raises:
            WedgeError: it is a frame or of another sensor, or the model is a mesh with more in it
                than can be drawn.
        """
        touch = self._like = laid(own(touch, self._like), self._gel)
        before, self._before = self._before, touch
        contact_px = int(np.count_nonzero(touch.contact))
        contact = touch.contact.view(np.uint8)
        deepest_mm = max(cv2.minMaxLoc(lifted(touch).depth_mm, contact)[1], 0.0)
        if contact_px < LEAST_CONTACT_PX:
            reason = "too little touches to be followed" if contact_px else "nothing touches"
            self._estimate = PoseEstimate(state="lost", reason=reason)
            self._sought = None
        elif not (np.isfinite(touch.gradient).all() and np.isfinite(touch.depth_mm).all()):
            self._estimate = PoseEstimate(state="lost", reason="slopes or depths are not finite")
        elif contact_px < LEAST_SHARE * self._most_px or deepest_mm < LEAST_DEPTH * self._most_mm:
            self._estimate = PoseEstimate(state="lost", reason="too little of the object touches")
        elif before is not None and np.array_equal(before.gradient, touch.gradient):
            if self._estimate.state != "lost":
                return replace(self._estimate, state="frozen", reason="the stream stands still")
        elif self._knows_nothing:
            self._estimate = self._first(touch)
        elif self._last is None:
            self._estimate = self._searched(touch)
        else:
            known = self._recent is not None
            found = self._followed(touch, self._last)
            adrift = found.state == "weak" and found.rotation_std_deg > ADRIFT_DEG
            if adrift or (self._estimate.state == "lost" and found.state != "tracking"):
                found = self._recognized(touch, found)
            if self._searches and self._estimate.state == "lost":
                # Who gave the first pose knows it; a touch after a loss must show where it is.
                if found.state == "lost" or (known and found.state == "weak"):
                    found = self._searched(touch)
            self._estimate = found
            if found.state == "tracking" and self._unsure:
                reason = "the touch by which it was found left it in doubt"
                self._estimate = replace(found, state="weak", reason=reason)
        if self._estimate.state == "tracking" and contact_px < LEAST_IN_FRAME * self._most_px:
            if reaches_border(touch.contact):
                reason = "most of the object lies beyond the frame's border"
                self._estimate = replace(self._estimate, state="weak", reason=reason)
        if self._estimate.T_sensor_object is not None:
            self._last, self.begun = self._estimate.T_sensor_object, True
            self._most_px = max(self._most_px, contact_px)
            self._most_mm = max(self._most_mm, deepest_mm)
        return self._estimate

    def _first(self, touch: Touch) -> PoseEstimate:
        """The first touch becomes the object."""
        pose = np.eye(4) if self._start is None else self._start
        self._knows_nothing = False
        exact = np.zeros((6, 6))
        self._keyframe = keyframe(touch, pose, exact, self.registration)
        self.model.learn(self._keyframe)
        return PoseEstimate(
            state="tracking", T_sensor_object=pose, covariance=exact, overlap=1.0, explained=1.0
        )

    def _followed(self, touch: Touch, last: Transform) -> PoseEstimate:
        """From the last known pose."""
        seen = self._seen(touch)
        known = self._keyframe or self.model.near(last, touch)
        if known is None:
            return PoseEstimate(state="lost", reason="the object should not touch here")
        found = self._compared(known, seen, last)
        for other in (self._recent, self.model.near(last, touch)):
            if not self._believable(found) and other is not None and other is not known:
                known, found = other, self._compared(other, seen, last)
        if found.T_sensor_object is None:
            self._keyframe = None
            return found
        step = found.T_sensor_object @ inverse(last)
        if angle_deg(step) > LONGEST_STEP_DEG or moved_mm(known, step) > LONGEST_STEP_MM:
            return disbelieved(found, "the object jumped")
        if not self._believable(found):
            return disbelieved(found, "not sure that it is the same object again")
        self._keyframe = known
        assert found.covariance is not None
        self._recent = replace(
            seen, T_sensor_object=found.T_sensor_object, covariance=found.covariance
        )
        if found.overlap < KEYFRAME_OVERLAP or remoteness(known, found.T_sensor_object) > SWITCH:
            found = self._switched(seen, touch, found)
        return self._made_sure(seen, found)

    def _believable(self, found: PoseEstimate) -> bool:
        """Whether it is a pose; after a loss, one of which enough is seen to tell it from others.

        A pattern that repeats, as studs do, fits half of itself one step further as well.
        """
        if found.state == "lost" or self._estimate.state != "lost":
            return found.state != "lost"
        return found.explained >= FOUND_AGAIN and found.overlap >= KEYFRAME_OVERLAP

    def _made_sure(self, seen: Keyframe, found: PoseEstimate) -> PoseEstimate:
        """Where there is doubt, ask the keyframe whose pose is surest; else say it."""
        assert found.T_sensor_object is not None
        if found.state == "tracking" and is_certain(found, seen.middle):
            return found
        reached = (
            item
            for item in self.model.surest_first()
            if item is not self._keyframe and remoteness(item, found.T_sensor_object) < 1
        )
        surest = next(reached, None)
        if surest is not None:
            again = self._compared(surest, seen, found.T_sensor_object)
            if again.state == "tracking" and is_certain(again, seen.middle):
                self._keyframe = surest
                return again
        if found.state != "tracking":
            return found
        return replace(found, state="weak", reason="touches before did not show every motion")

    def _switched(self, seen: Keyframe, touch: Touch, found: PoseEstimate) -> PoseEstimate:
        """Go over to a nearer keyframe: an old one that agrees, else this touch."""
        assert found.T_sensor_object is not None and self._recent is not None
        near = self.model.near(found.T_sensor_object, touch)
        if near is not None and near is not self._keyframe:
            again = self._compared(near, seen, found.T_sensor_object)
            closer = remoteness(near, found.T_sensor_object) < SWITCH
            if closer and again.state == "tracking" and again.overlap > KEYFRAME_OVERLAP:
                self._keyframe = near
                return again
        self._keyframe = self._recent
        self.model.learn(self._recent)
        return found

    def _recognized(self, touch: Touch, doubtful: PoseEstimate) -> PoseEstimate:
        """When lost or adrift, the pose of a keyframe that looks like this, wherever that was."""
        seen = self._seen(touch)
        for known in self.model.surest_first()[:RECOGNIZED]:
            found = self._compared(known, seen, known.T_sensor_object)
            sure = found.state == "tracking" and found.explained > FOUND_AGAIN
            if sure and found.overlap > KEYFRAME_OVERLAP and is_certain(found, seen.middle):
                self._keyframe = known
                return found
        return doubtful

    def _searched(self, touch: Touch) -> PoseEstimate:
        """Where no pose is known, or the last one does not lead here: every guess of the model."""
        seen, lost = self._seen(touch), "no pose of the object fits this touch"
        if self._sought is not None:
            same = agreement(self._sought.pyramid, seen.pyramid, np.eye(4))
            if min(same.overlap, same.explained) > FITS:
                return PoseEstimate(state="lost", reason=lost)
        results: list[tuple[PoseEstimate, Keyframe, Transform]] = []
        last: tuple[PoseEstimate, Keyframe, Transform] | None = None
        for known, guess in self._guesses(touch):
            found, known = self._led(known, seen, guess)
            if found.T_sensor_object is not None:
                results.append((found, known, found.T_sensor_object))
                last = results[-1] if guess is self._last else last
        results.sort(key=lambda item: -item[0].explained)
        if not results or results[0][0].explained < FOUND_AGAIN:
            self._sought = seen
            return PoseEstimate(state="lost", reason=lost)
        best, known, pose = results[0]
        alike = self.model.alike
        if last is not None and best.state == "weak" and best.explained - last[0].explained < ALIKE:
            best, known, pose = last  # what a touch does not show stays as it was
        for other, near, elsewhere in results:
            between = elsewhere @ nearest_turn(elsewhere, pose, alike) @ inverse(pose)
            rival = other.reason != UNLIKE or best.state == "weak"
            rival = rival and best.explained - other.explained < ALIKE
            if rival and (angle_deg(between) > SAME_DEG or moved_mm(near, between) > SAME_MM):
                best = replace(best, state="weak", reason="several poses fit this touch")
        fits = best.explained >= FITS and best.overlap >= KEYFRAME_OVERLAP
        if best.state == "tracking" and not fits:
            best = replace(best, state="weak", reason="no pose of the object fits this touch well")
        self._unsure = best.state != "tracking"
        # Of poses that look the same the one is told that is turned least.
        turn = nearest_turn(pose, np.eye(4) if self._last is None else self._last, alike)
        assert best.covariance is not None
        covariance = turned_covariance(best.covariance, turn)
        best = replace(best, T_sensor_object=pose @ turn, covariance=covariance)
        self._keyframe = turned(known, turn)
        self._recent = replace(seen, T_sensor_object=pose @ turn, covariance=covariance)
        return best

    def _led(
        self, known: Keyframe, seen: Keyframe, guess: Transform
    ) -> tuple[PoseEstimate, Keyframe]:
        """Where a guess leads to, compared anew from there; the first look decides nothing yet."""
        start = guess @ inverse(known.T_sensor_object)
        for look in range(LOOKS):
            found = self.registration.align(known.prepared, seen.prepared, start)
            estimate = self._judged(known, seen, found)
            astray = look and estimate.T_sensor_object is None
            if look + 1 == LOOKS or astray or not is_rigid(found.T_current_reference):
                break
            pose = straightened(found.T_current_reference @ known.T_sensor_object)
            near = self.model.near(pose, seen.pyramid.touch, close=True)
            if near is None or near is known:
                break
            known, start = near, pose @ inverse(near.T_sensor_object)
        return estimate, known

    def _guesses(self, touch: Touch) -> Iterator[tuple[Keyframe, Transform]]:
        """The last pose, and the model's guesses."""
        if (last := self._last) is not None and (near := self.model.near(last, touch)) is not None:
            yield near, last
        yield from self.model.guesses(touch)

    def _seen(self, touch: Touch) -> Keyframe:
        """The touch prepared; its pose is not known yet."""
        return keyframe(touch, np.eye(4), np.zeros((6, 6)), self.registration)

    def _compared(self, known: Keyframe, seen: Keyframe, guess: Transform) -> PoseEstimate:
        """The pose by one keyframe."""
        start = guess @ inverse(known.T_sensor_object)
        found = self.registration.align(known.prepared, seen.prepared, start)
        return self._judged(known, seen, found)

    def _judged(self, known: Keyframe, seen: Keyframe, found: Alignment) -> PoseEstimate:
        """How far an alignment with a keyframe can be believed."""
        if not is_rigid(found.T_current_reference):
            return PoseEstimate(state="lost", reason=UNMATCHED)
        judged = agreement(known.pyramid, seen.pyramid, found.T_current_reference)
        overlap, explained = judged.overlap, judged.explained
        if overlap < LEAST_OVERLAP or explained < LEAST_EXPLAINED:
            little = "too little in common with what was seen before"
            reason = little if overlap < LEAST_OVERLAP else UNMATCHED
            return PoseEstimate(state="lost", reason=reason, overlap=overlap, explained=explained)
        added = turned_covariance(found.covariance, known.T_sensor_object)
        estimate = PoseEstimate(
            state="tracking",
            T_sensor_object=straightened(found.T_current_reference @ known.T_sensor_object),
            covariance=known.covariance + added,
            overlap=overlap,
            explained=explained,
        )
        if judged.alike < LEAST_ALIKE:
            return replace(estimate, state="weak", reason=UNLIKE)
        if explained < FOUND_AGAIN:
            return replace(estimate, state="weak", reason="matches in part what was seen before")
        turn_deg, shift_mm = greatest_std(found.covariance, known.middle)
        if not turn_deg < WEAK_DEG:
            return replace(estimate, state="weak", reason="a rotation is not seen by this touch")
        if not shift_mm < WEAK_MM:
            return replace(estimate, state="weak", reason="a shift is not seen by this touch")
        return estimate
