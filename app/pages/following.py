# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""The touched object's pose and the gel's dots, as the live page shows them."""

from dataclasses import dataclass

import cv2
import numpy as np
from scipy.spatial.transform import Rotation

from app.pages import pictures
from recon.arrays import ContactMask, DepthMap, Frame, GradientField
from recon.calibration import Calibration
from recon.markers.tracking import Tracked, marker_tracker
from recon.pose.registration import Touch
from recon.pose.rigid import Points
from recon.pose.tracker import PoseEstimate, Tracker
from sensor.toml import Pair
from validation.figures.tracking import anchor_on, overlay

FORGET_S = 1.0
"""Without a touch for so long, the next one is another object."""
EXAGGERATED = 3.0
"""Length of the dots' arrows."""
SHAFT, HALO = (255, 255, 255), (0, 0, 0)


@dataclass(frozen=True, kw_only=True)
class KeptTouch:
    """A touch that the next frame does not overwrite."""

    gradient: GradientField
    depth_mm: DepthMap
    contact: ContactMask
    mm_per_px: Pair


@dataclass(frozen=True, kw_only=True)
class Followed:
    """What the page shows of one moment."""

    picture: str
    """The gel with the object's axes, the state in words and the dots' arrows, as a data URL."""
    state: str
    pose: str
    markers: str


class Follower:
    """Follows what touches one sensor; its first touch is the object, its pose there the origin."""

    def __init__(self, unit: Calibration, background: Frame | None) -> None:
        self._unwarp = unit.unwarp
        self._dots = marker_tracker(
            self._unwarp(unit.background if background is None else background)
        )
        self._tracked: Tracked | None = None
        self._track = Tracker()
        self._anchor: Points | None = None
        self._touched_s = 0.0

    def __call__(self, frame: Frame, touch: Touch, now_s: float) -> Followed:
        """Take in a frame and what was reconstructed of it."""
        kept = KeptTouch(
            gradient=touch.gradient.copy(),
            depth_mm=touch.depth_mm.copy(),
            contact=touch.contact,
            mm_per_px=touch.mm_per_px,
        )
        found = self._track(kept)
        if found.reason != "nothing touches":
            self._touched_s = now_s
        elif now_s - self._touched_s > FORGET_S:
            self._track, self._anchor = Tracker(), None
        if self._anchor is None and found.T_sensor_object is not None:
            self._anchor = anchor_on(kept, found.T_sensor_object)
        image = self._unwarp(frame)
        shown = overlay(image, kept.contact, kept.mm_per_px, found, self._anchor)
        words = "none on this gel"
        if self._dots is not None:
            self._tracked = self._dots.track(image, self._tracked)
            _draw_arrows(shown, self._tracked, shown.shape[1] / image.shape[1])
            words = marker_words(self._tracked, kept.mm_per_px)
        return Followed(
            picture=pictures.as_url(shown),
            state=found.state,
            pose=pose_words(found),
            markers=words,
        )


def pose_words(found: PoseEstimate) -> str:
    """Turn and shift with a standard deviation each, or why there are none."""
    if found.T_sensor_object is None:
        return found.reason
    turn = np.degrees(Rotation.from_matrix(found.T_sensor_object[:3, :3]).as_rotvec())
    shift = found.T_sensor_object[:3, 3]
    return (
        "turn {:+.1f} {:+.1f} {:+.1f}° ± {:.1f}°, ".format(*turn, found.rotation_std_deg)
        + "shift {:+.2f} {:+.2f} {:+.2f} mm ± {:.2f} mm".format(*shift, found.translation_std_mm)
        + (f"; {found.reason}" if found.reason else "")
    )


def marker_words(tracked: Tracked, mm_per_px: Pair) -> str:
    """How many dots are seen and how far they have moved."""
    seen = tracked.seen
    count = f"{int(seen.sum())} of {len(seen)} dots seen"
    if not seen.any() or tracked.word == "lost":
        return f"{count}: lost"
    moved_mm = np.hypot(*tracked.displacement_mm(mm_per_px)[seen].T)
    return (
        f"{count}, moved {moved_mm.mean():.2f} mm on average, {moved_mm.max():.2f} mm at most"
        + (": jumped" if tracked.jumped else "")
    )


def _draw_arrows(picture: Frame, tracked: Tracked, scale: float) -> None:
    """From where each dot rests, longer than it moved; drawn into the picture."""
    rest = (tracked.markers.position_px + 0.5) * scale
    ends = rest + EXAGGERATED * scale * tracked.displacement_px
    for place, goal in zip(rest[tracked.seen], ends[tracked.seen], strict=True):
        start, end = ([round(float(along)) for along in point] for point in (place, goal))
        for color, thickness in ((HALO, 3), (SHAFT, 1)):
            cv2.arrowedLine(picture, start, end, color, thickness, cv2.LINE_AA, tipLength=0.3)
