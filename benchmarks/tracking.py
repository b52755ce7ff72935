# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Tracking: steps of known size on five objects, a bead's whole roll, real clips there and back."""

import time
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from itertools import cycle
from statistics import median

import numpy as np
from scipy.spatial.transform import Rotation

from benchmarks.clips import (
    CLIPS,
    Seen,
    borrowed,
    by_tracker_alone,
    clip,
    learnt_elsewhere,
    there_and_back,
)
from benchmarks.measurement import Measurement, interleaved_ms, one_thread
from benchmarks.touches import SyntheticTouch, Thing, bead, motions, pressed, things
from recon.pipeline import Reconstructor
from recon.pose.estimate import PoseEstimate
from recon.pose.pyramid import Pyramid
from recon.pose.rigid import Transform, angle_deg, inverse, rigid, shift_mm, turn_and_shift
from recon.pose.tracker import REGISTRATIONS, Tracker
from validation.datasets import shared_folder
from validation.tracking import Roll, StepErrors

STEPS = 12
SEED = 1
ROLL_STEP_DEG = 2.5
ROLL_SIZE_PX, ROLL_MM_PER_PX = (160, 120), (0.1268, 0.1268)
BARS = {
    "cube corner": (0.09, 0.0024, 60),
    "shallow texture": (0.04, 0.0055, 24),
}
"""Degrees, mm, and the number of steps whose medians are held against them."""


def step_errors(
    names: Sequence[str], trackers: Sequence[str], steps: int = STEPS
) -> list[StepErrors]:
    """Each tracker on the same pairs of touches, so many of each object.

    Raises:
        WedgeError: a tracker's library is not installed.
    """
    found = []
    for name, thing in things().items():
        if name not in names:
            continue
        rng = np.random.default_rng(SEED)
        pairs = [
            (pressed(thing, np.eye(4), rng), pressed(thing, moved, rng), moved)
            for moved in motions(rng, steps)
        ]
        found += [_errors(name, tracker, pairs) for tracker in trackers]
    return found


def _errors(
    thing: str, tracker: str, pairs: Sequence[tuple[SyntheticTouch, SyntheticTouch, Transform]]
) -> StepErrors:
    registration = REGISTRATIONS[tracker]
    rows = []
    for first, second, moved in pairs:
        reference = registration.prepare(first)
        if isinstance(reference, Pyramid):
            _ = reference.templates, reference.coarse, reference.pulls(1.0)  # once per keyframe
        begun = time.process_time()
        found = registration.align(reference, registration.prepare(second), np.eye(4))
        taken = time.process_time() - begun
        left = inverse(moved) @ found.T_current_reference
        twist = turn_and_shift(left)
        square = float(twist @ np.linalg.solve(found.covariance, twist))
        rows.append((angle_deg(left), _off_mm(found.T_current_reference, moved), square, taken))
    angle, shift, _, taken = (median(column) for column in zip(*rows, strict=True))
    return StepErrors(
        thing=thing,
        tracker=tracker,
        steps=len(rows),
        angle_deg=angle,
        shift_mm=shift,
        squares=float(np.mean([row[2] for row in rows])),
        milliseconds=1e3 * taken,
    )


def _off_mm(found: Transform, true: Transform) -> float:
    return shift_mm(inverse(found) @ true)


def roll(trackers: Sequence[str] = ("joint", "gicp")) -> Roll:
    """Roll and follow."""
    thing: Thing = bead()
    center = np.array([0, 0, 5.0 - 0.8])
    rng = np.random.default_rng(3)
    running = {name: Tracker(name) for name in trackers}
    angles = np.arange(0, 360 + 1e-9, ROLL_STEP_DEG)
    errors: dict[str, list[float]] = {name: [] for name in trackers}
    estimates: list[PoseEstimate] = []
    touches: list[SyntheticTouch] = []
    for angle in angles:
        turn = Rotation.from_euler("y", angle, degrees=True).as_matrix()
        pose = rigid(turn, center - turn @ center)
        touch = pressed(thing, pose, rng, size_px=ROLL_SIZE_PX, mm_per_px=ROLL_MM_PER_PX)
        touches.append(touch)
        for name, track in running.items():
            estimate = track(touch)
            if name == trackers[0]:
                estimates.append(estimate)
            found = estimate.T_sensor_object
            errors[name].append(np.nan if found is None else angle_deg(inverse(pose) @ found))
    return Roll(true_deg=angles.tolist(), error_deg=errors, found=estimates, touches=touches)


def measure() -> Iterator[Measurement]:
    """Every figure of tracking."""
    for thing, (bar_deg, bar_mm, steps) in BARS.items():
        (item,) = step_errors([thing], ["joint"], steps)
        what = f"tracking a {thing}, {steps} steps of 2.5° and 0.2 mm, slope noise 0.05"
        yield Measurement(name=f"{what}: angle", value=item.angle_deg, unit="°", bar=bar_deg)
        yield Measurement(name=f"{what}: shift", value=item.shift_mm, unit="mm", bar=bar_mm)
    yield from timed()
    rolled = roll()
    for name, errors in rolled.error_deg.items():
        before = errors[round(315 / ROLL_STEP_DEG)]  # later touches meet the first keyframe again
        yield Measurement(
            name=f"{name}: a bead rolled by 315°, 160x120",
            value=float(before),
            unit="° off",
        )
        yield Measurement(
            name=f"{name}: a bead rolled by 360°, 160x120",
            value=float(errors[-1]),
            unit="° off",
            bar=2.0 if name == "joint" else None,
        )
    if (shared_folder() / "wedge-mit").is_dir():  # may not be redistributed
        yield from _clips()


def _clips() -> Iterator[Measurement]:
    """Real objects, gripped and let go."""
    unit = learnt_elsewhere()
    for name in CLIPS:
        frames, grip = clip(name)
        reconstruct = Reconstructor(borrowed(unit, frames[0]))
        touches = [Seen(touch=reconstruct(frame)) for frame in frames[grip.first :]]
        found = there_and_back(touches, grip.since(grip.first), by_tracker_alone)
        anew: str = found.anew.state
        if np.isfinite(found.returned_anew[0]):
            anew += f", ± {found.anew.rotation_std_deg:.1f}°"
        # The first way ends at the picture that it began with: the second one says more.
        for way, (angle, shift) in (
            ("there and back", found.returned),
            (f"back by a new tracker ({anew})", found.returned_anew),
        ):
            what = f"{name}: {way}, {len(found.firm)} frames"
            yield Measurement(name=what, value=angle, unit="°", bar=1.0)
            yield Measurement(name=what, value=shift, unit="mm", bar=0.1)
        yield Measurement(
            name=f"{name}: frames with a pose after the object has left, of {len(found.gone)}",
            value=float(sum(pose.state != "lost" for pose in found.gone)),
            unit="",
            bar=0.0,
        )


def timed() -> Iterator[Measurement]:
    """Time of one step beside GICP's, and of all that a tracker does with a touch, in turn."""
    with one_thread():
        for name in BARS:
            yield from _timed(name)


def _timed(name: str) -> Iterator[Measurement]:
    rng = np.random.default_rng(SEED)
    thing = things()[name]
    first = pressed(thing, np.eye(4), rng)
    second, third = (pressed(thing, moved, rng) for moved in motions(rng, 2))
    track = Tracker()
    track(first)
    calls: list[Callable[[], object]] = [partial(next, map(track, cycle([second, third])))]
    for registration in REGISTRATIONS.values():
        reference = registration.prepare(first)
        calls.append(partial(_step, registration, reference, second))
    whole, ours, gicp, _ = interleaved_ms(calls, rounds=15)
    yield Measurement(
        name=f"joint: one step on a {name} against GICP, one thread",
        value=ours / gicp,
        unit=f"ratio ({ours:.1f} ms)",
    )
    yield Measurement(
        name=f"joint: a tracker's answer to a touch of a {name}, 320x240, one thread",
        value=whole,
        unit=f"ms ({1e3 / whole:.0f} touches/s)",
        bar=10.0,
    )


def _step(registration: object, reference: object, touch: SyntheticTouch) -> None:
    registration.align(reference, registration.prepare(touch), np.eye(4))  # type: ignore[attr-defined]
