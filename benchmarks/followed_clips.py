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
from collections.abc import Iterable, Iterator

from benchmarks.clips import CLIPS, Seen, borrowed, clip, learnt_elsewhere, there_and_back
from recon.calibration import Calibration
from recon.follower import doubted, followed
from recon.pipeline import Reconstructor
from recon.plausible import doubt_word
from recon.pose.estimate import PoseEstimate
from recon.pose.tracker import Tracker

ESTIMATORS = ("mlp", "default")


def as_the_command(track: Tracker, frames: Iterable[Seen]) -> list[PoseEstimate]:
    """Poses, as `wedge track` gives them."""
    return [
        doubted(
            followed(track, seen.touch, seen.doubt),
            seen.touch.markers,
            still=False,
            doubt=seen.doubt,
        )
        for seen in frames
    ]


def rows(name: str, unit: Calibration) -> Iterator[list[str]]:
    """What is said of one clip from its first frame, and from the first firm one."""
    frames, grip = clip(name)
    lent = borrowed(unit, frames[0])
    reconstruct = Reconstructor(lent)
    touches = [reconstruct(frame) for frame in frames]
    seen = [Seen(touch=touch, doubt=doubt_word(touch, lent)) for touch in touches]
    firm = seen[grip.first : grip.last + 1]
    for begin in (0, grip.first):
        found = there_and_back(seen[begin:], grip.since(begin), as_the_command)
        counts = (begin, len(firm), sum(bool(item.doubt) for item in firm), _posed(found.firm))
        both = found.returned, found.returned_anew
        ways = [f"{angle:.2f}°, {shift:.2f} mm" for angle, shift in both]
        yield [name, *map(str, counts), *ways, str(_posed(found.gone))]


def _posed(poses: Iterable[PoseEstimate]) -> int:
    return sum(pose.T_sensor_object is not None for pose in poses)


def main() -> None:
    """Measure and print."""
    argparse.ArgumentParser(
        prog="python -m benchmarks.followed_clips", description=__doc__
    ).parse_args()
    print("unit | clip | begin | firm | doubted | with a pose | there and back | anew | after")
    for estimator in ESTIMATORS:
        unit = learnt_elsewhere(estimator)
        for name in CLIPS:
            for row in rows(name, unit):
                print(" | ".join([estimator, *row]), flush=True)


if __name__ == "__main__":
    main()
