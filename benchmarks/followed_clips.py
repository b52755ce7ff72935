# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Real clips of gripped objects through all that `wedge track` does, by units of another sensor.

    python -m benchmarks.followed_clips

The benchmark follows the same clips by the tracker alone (`benchmarks.clips`). Here frames that are
doubted begin no object, as `recon.follower` has it, and poses of others are weak. Each clip is
followed until its object has left, from its first frame and from the first at which the gripper
presses firmly. Both ways: there to the last firm frame and back to the first, by one tracker, and
back alone by a tracker that starts there anew.
"""

import argparse
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from benchmarks.clips import (
    CLIPS,
    WATCHED_FRAMES,
    apart,
    borrowed,
    clip,
    grip,
    learnt_elsewhere,
)
from recon.calibration import Calibration
from recon.follower import doubted, followed
from recon.pipeline import Reconstruction, Reconstructor
from recon.plausible import doubt_word
from recon.pose.estimate import PoseEstimate
from recon.pose.tracker import Tracker

ESTIMATORS = ("mlp", "default")


@dataclass(frozen=True, kw_only=True)
class Followed:
    """What was said of one clip."""

    begin: int
    """The first frame that was followed."""
    firm: int
    """Frames while the gripper presses firmly,"""
    doubted: int
    """of these, whose depth means little, as is said,"""
    posed: int
    """and with a pose."""
    returned: tuple[float, float]
    """Degrees and mm between the poses of the first firm frame; infinite without both."""
    returned_anew: tuple[float, float]
    after: int
    """Frames with a pose after the object has left, of ``WATCHED_FRAMES``."""


@dataclass(frozen=True, kw_only=True)
class Seen:
    """A frame as reconstructed."""

    touch: Reconstruction
    doubt: str


def follow(track: Tracker, frames: Iterable[Seen]) -> list[PoseEstimate]:
    """Poses, as the command gives them."""
    return [
        doubted(
            followed(track, seen.touch, seen.doubt),
            seen.touch.markers,
            still=False,
            doubt=seen.doubt,
        )
        for seen in frames
    ]


def follow_clip(name: str, unit: Calibration) -> list[Followed]:
    """One clip from its first frame, and from the first firm one."""
    frames, force = clip(name)
    first, last, left = grip(force)
    lent = borrowed(unit, frames[0])
    reconstruct = Reconstructor(lent)
    touches = [reconstruct(frame) for frame in frames[: left + WATCHED_FRAMES]]
    seen = [Seen(touch=touch, doubt=doubt_word(touch, lent)) for touch in touches]
    return [_followed(seen, begin, (first, last, left)) for begin in (0, first)]


def _followed(seen: Sequence[Seen], begin: int, span: tuple[int, int, int]) -> Followed:
    first, last, left = span
    there = follow(Tracker(), seen[begin:])
    firm, back = there[first - begin : last + 1 - begin], seen[first : last + 1][::-1]
    both_ways = follow(Tracker(), [*seen[begin : last + 1], *back[1:]])
    anew = follow(Tracker(T_sensor_object=firm[-1].T_sensor_object), back)
    touch = seen[first].touch
    return Followed(
        begin=begin,
        firm=len(firm),
        doubted=sum(bool(item.doubt) for item in back),
        posed=sum(item.T_sensor_object is not None for item in firm),
        returned=apart(touch, both_ways[first - begin], both_ways[-1]),
        returned_anew=apart(touch, firm[0], anew[-1]),
        after=sum(item.T_sensor_object is not None for item in there[left - begin :]),
    )


def main() -> None:
    """Measure and print."""
    argparse.ArgumentParser(
        prog="python -m benchmarks.followed_clips", description=__doc__
    ).parse_args()
    print("unit | clip | begin | firm | doubted | with a pose | there and back | anew | after")
    for estimator in ESTIMATORS:
        unit = learnt_elsewhere(estimator)
        for name in CLIPS:
            for found in follow_clip(name, unit):
                ways = [
                    f"{angle:.2f}°, {shift:.2f} mm"
                    for angle, shift in (found.returned, found.returned_anew)
                ]
                counts = (found.begin, found.firm, found.doubted, found.posed)
                cells = [estimator, name, *map(str, counts), *ways, str(found.after)]
                print(" | ".join(cells), flush=True)


if __name__ == "__main__":
    main()
