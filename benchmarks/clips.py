# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Real clips of gripped objects: followed forward, then backward by a tracker that starts anew.

No clip has labelled ball presses. The colours of a press depend on where the lights sit, and the
other lab's Wedge has them where the clips' has: so slopes come from a network that learnt from its
presses, laid into the clips' own pad corners with the clip's own blank frame. Depths are therefore
rough; a motion and its way back can still be compared.
"""

import csv
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from recon.arrays import Frame
from recon.calibration import Calibration, calibrate
from recon.pipeline import Reconstruction, Reconstructor
from recon.pose.estimate import PoseEstimate
from recon.pose.registration import contact_points
from recon.pose.rigid import angle_deg, applied, inverse
from recon.pose.tracker import Tracker
from recon.presses import read_presses
from sensor.dataset import read_dataset
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
class ThereAndBack:
    """One clip, followed in both directions."""

    name: str
    frames: int
    """While the gripper presses firmly."""
    apart_deg: float
    """Between the first firm frame's pose and what the way back makes of it."""
    apart_mm: float
    """Of the middle of the contact."""
    stated_deg: float
    """Standard deviation that the way back states for its end; infinite where it is lost."""
    stated: str
    """Its state there."""
    returned_deg: float
    """The same by one tracker that goes there and back, and so meets its keyframes again."""
    returned_mm: float
    gone: int
    """Frames after the object has left."""
    gone_lost: int
    """Of these, reported as lost."""
    touches: Sequence[Reconstruction]
    forward: Sequence[PoseEstimate]


def learnt_elsewhere(estimator: str = "mlp") -> Calibration:
    """The other lab's unit."""
    dataset = read_dataset(dataset_folder(LEARNT_FROM))
    return calibrate(
        dataset,
        read_presses(dataset),
        estimator=estimator,
        serial=LEARNT_FROM,
        created="2026-01-01",
        metrics={},
        seed=0,
    )


def borrowed(unit: Calibration, frame: Frame) -> Calibration:
    """A unit's colours with the clips' geometry and a clip's blank frame."""
    source = shared_folder() / "wedge-mit" / wedge_mit.CORNERS_FILE
    width, height = (
        round(side / pitch)
        for side, pitch in zip(wedge_mit.PAD_SIZE_MM, wedge_mit.MM_PER_PX, strict=True)
    )
    card = replace(
        unit.card,
        mm_per_px=wedge_mit.MM_PER_PX,
        frame_size_px=(frame.shape[1], frame.shape[0]),
        size_px=(width, height),
        corners_px=wedge_mit._corners_px(source),
        pad_size_mm=wedge_mit.PAD_SIZE_MM,
        markers=None,
    )
    return replace(unit, card=card, background=frame)


def clip(name: str) -> tuple[list[Frame], list[float]]:
    """The frames of a clip, raw, and the force in N at each."""
    known = next(item for item in wedge_mit.CLIPS if item.name == name)
    folder = shared_folder() / "wedge-mit"
    with (folder / f"{known.path}_force_width.csv").open(newline="") as stream:
        force = [abs(float(row["force_N"])) for row in csv.DictReader(stream)]
    return list(wedge_mit._frames(folder / f"{known.path}.avi")), force


def grip(force: Sequence[float]) -> tuple[int, int, int]:
    """The first and the last firm frame, and the first after the object has left."""
    firm = [index for index, value in enumerate(force) if value >= FIRM_N]
    left = next(i for i in range(firm[-1], len(force)) if force[i] < GONE_N) + GONE_FRAMES
    return firm[0], firm[-1], left


def there_and_back(name: str, unit: Calibration, tracker: str = "joint") -> ThereAndBack:
    """Follow a clip while the gripper presses firmly, go on until the end, and follow it back.

    By the tracker alone, which also gets frames that `wedge track` would doubt: for these see
    ``benchmarks.followed_clips``.
    """
    frames, force = clip(name)
    first, last, left = grip(force)
    reconstruct = Reconstructor(borrowed(unit, frames[0]))
    touches = [reconstruct(frame) for frame in frames[first : left + WATCHED_FRAMES]]
    held = last - first + 1
    track = Tracker(tracker)
    forward = [track(touch) for touch in touches]
    again = Tracker(tracker, T_sensor_object=forward[held - 1].T_sensor_object)
    backward = [again(touch) for touch in touches[held - 1 :: -1]]
    both_ways = Tracker(tracker)
    there_again = [both_ways(touch) for touch in (*touches[:held], *touches[held - 2 :: -1])]
    apart_deg, apart_mm = apart(touches[0], forward[0], backward[-1])
    returned_deg, returned_mm = apart(touches[0], there_again[0], there_again[-1])
    gone = forward[left - first :]
    return ThereAndBack(
        name=name,
        frames=held,
        apart_deg=apart_deg,
        apart_mm=apart_mm,
        stated_deg=backward[-1].rotation_std_deg,
        stated=backward[-1].state,
        returned_deg=returned_deg,
        returned_mm=returned_mm,
        gone=len(gone),
        gone_lost=sum(item.state == "lost" for item in gone),
        touches=touches,
        forward=forward,
    )


def apart(touch: Reconstruction, one: PoseEstimate, other: PoseEstimate) -> tuple[float, float]:
    """Angle between two poses, and how far apart they put the middle of a touch."""
    if one.T_sensor_object is None or other.T_sensor_object is None:
        return np.inf, np.inf
    between = other.T_sensor_object @ inverse(one.T_sensor_object)
    middle = contact_points(touch).mean(0)
    return angle_deg(between), float(np.linalg.norm(applied(between, middle) - middle))
