# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Real clips of gripped objects: followed forward, then backward by a tracker that starts anew.

No clip has labelled ball presses. The colours of a press depend on where the lights sit, and the
other lab's Wedge has them where the clips' has: so slopes come from a network that learnt from its
presses, laid into the clips' own pad corners with the clip's own blank frame. Depths are therefore
rough; a motion and its way back can still be compared.
"""

import csv
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from recon.arrays import Frame
from recon.calibration import Calibration, unit_of_set
from recon.pipeline import Reconstruction
from recon.pose.estimate import PoseEstimate
from recon.pose.registration import contact_middle
from recon.pose.rigid import angle_deg, applied, inverse
from recon.pose.tracker import Tracker
from sensor.dataset import read_dataset
from sensor.toml import Pair
from validation.datasets import dataset_folder, shared_folder
from validation.importers import wedge_mit

LEARNT_FROM = "wedge-lab"
CLIPS = ("wedge-mit-bolt", "wedge-mit-golf-ball", "wedge-mit-strawberry")
FIRM_N = 15.0
"""Tracking is judged while the gripper presses at least so hard."""
GONE_N, GONE_FRAMES = 1.0, 3
"""The object has left so many frames after the force fell below that."""
WATCHED_FRAMES = 8
"""After the object has left."""


@dataclass(frozen=True, kw_only=True)
class Grip:
    """Frames of a clip by their numbers."""

    first: int
    """The first at which the gripper presses firmly,"""
    last: int
    """and the last."""
    left: int
    """The first after the object has left."""

    def since(self, begin: int) -> "Grip":
        """The same, counted from a frame."""
        return Grip(first=self.first - begin, last=self.last - begin, left=self.left - begin)


@dataclass(frozen=True, kw_only=True)
class Seen:
    """A frame as reconstructed."""

    touch: Reconstruction
    doubt: str = ""
    """Why its depth means little, where that was asked."""


Follow = Callable[[Tracker, Iterable[Seen]], Sequence[PoseEstimate]]
"""What is made of frames with a tracker: a pose for each."""


@dataclass(frozen=True, kw_only=True)
class ThereAndBack:
    """One clip, followed in both directions."""

    firm: Sequence[PoseEstimate]
    """While the gripper presses firmly."""
    gone: Sequence[PoseEstimate]
    """After the object has left."""
    returned: Pair
    """Degrees, and mm of the middle of the contact, between the poses of the first firm frame, by
    one tracker that goes there and back and so meets its keyframes again. Infinite without both."""
    returned_anew: Pair
    """The same by a tracker that starts anew at the last firm frame and goes back alone."""
    anew: PoseEstimate
    """What that says at its end."""


def learnt_elsewhere(estimator: str = "mlp") -> Calibration:
    """The other lab's unit."""
    return unit_of_set(read_dataset(dataset_folder(LEARNT_FROM)), estimator)


def borrowed(unit: Calibration, frame: Frame) -> Calibration:
    """A unit's colours with the clips' geometry and a clip's blank frame."""
    width, height = (
        round(side / pitch)
        for side, pitch in zip(wedge_mit.PAD_SIZE_MM, wedge_mit.MM_PER_PX, strict=True)
    )
    card = replace(
        unit.card,
        mm_per_px=wedge_mit.MM_PER_PX,
        frame_size_px=(frame.shape[1], frame.shape[0]),
        size_px=(width, height),
        corners_px=wedge_mit.pad_corners_px(_source()),
        pad_size_mm=wedge_mit.PAD_SIZE_MM,
        markers=None,
    )
    return replace(unit, card=card, background=frame)


def clip(name: str) -> tuple[list[Frame], Grip]:
    """The frames of a clip, raw, until its object has left and some more, and which are which."""
    known, source = next(item for item in wedge_mit.CLIPS if item.name == name), _source()
    with wedge_mit.force_file(known, source).open(newline="") as stream:
        force = [abs(float(row["force_N"])) for row in csv.DictReader(stream)]
    firm = [index for index, value in enumerate(force) if value >= FIRM_N]
    left = next(i for i in range(firm[-1], len(force)) if force[i] < GONE_N) + GONE_FRAMES
    frames = list(wedge_mit.clip_frames(known, source))[: left + WATCHED_FRAMES]
    return frames, Grip(first=firm[0], last=firm[-1], left=left)


def by_tracker_alone(track: Tracker, frames: Iterable[Seen]) -> list[PoseEstimate]:
    """Poses of frames of which `wedge track` would doubt some: see ``followed_clips`` for these."""
    return [track(seen.touch) for seen in frames]


def there_and_back(frames: Sequence[Seen], grip: Grip, follow: Follow) -> ThereAndBack:
    """Follow a clip from its first frame to its end, and from the last firm frame back.

    Args:
        frames: of the clip, from the one with which to begin.
        grip: counted from there.
        follow: gives the poses.
    """
    there = follow(Tracker(), frames)
    firm, back = there[grip.first : grip.last + 1], frames[grip.first : grip.last + 1][::-1]
    both_ways = follow(Tracker(), [*frames[: grip.last + 1], *back[1:]])
    anew = follow(Tracker(T_sensor_object=firm[-1].T_sensor_object), back)
    touch = frames[grip.first].touch
    return ThereAndBack(
        firm=firm,
        gone=there[grip.left :],
        returned=_apart(touch, both_ways[grip.first], both_ways[-1]),
        returned_anew=_apart(touch, firm[0], anew[-1]),
        anew=anew[-1],
    )


def _apart(touch: Reconstruction, one: PoseEstimate, other: PoseEstimate) -> Pair:
    """Angle between two poses, and how far apart they put the middle of a touch."""
    if one.T_sensor_object is None or other.T_sensor_object is None:
        return np.inf, np.inf
    between = other.T_sensor_object @ inverse(one.T_sensor_object)
    middle = contact_middle(touch)
    return angle_deg(between), float(np.linalg.norm(applied(between, middle) - middle))


def _source() -> Path:
    return shared_folder() / "wedge-mit"
