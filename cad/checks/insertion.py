# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Every body can be put in: driven along its way, turns included, past all that stands there.

Between two poses no point moves farther than ``STEP_MM``, so what the check does not see is less
than half of that deep, and nothing as thick as a wall can be passed over.
"""

from collections.abc import Iterator, Mapping

import manifold3d
import numpy as np

from cad.assembly import Assembly, Step
from cad.checks.fit import TOLERANCE_MM3, boxes_meet
from cad.motions import Pose, Way, moved, poses
from cad.result import Result

STEP_MM = 0.2

Bodies = Mapping[str, manifold3d.Manifold]


def check_insertion(assembly: Assembly, bodies: Bodies) -> list[Result]:
    """Largest volume that a step's bodies cut from what stands there, along their way in."""
    results = []
    for step in assembly.steps:
        if assembly.standing(step):
            worst, where = _worst_on_the_way(assembly, step, bodies)
            results.append(
                Result("insertion", step.id, worst, "mm³", TOLERANCE_MM3, "at most", where)
            )
    return results


def _worst_on_the_way(assembly: Assembly, step: Step, bodies: Bodies) -> tuple[float, str]:
    worst, where, count = 0.0, "", 0
    for name in assembly.moving(step):
        way = assembly.way(step, name)
        for other in assembly.standing(step):
            for travelled, volume in overlaps(bodies[name], bodies[other], way):
                count += 1
                if volume > worst:
                    worst = volume
                    where = f"{name} touches {other} {travelled:.1f} mm before its place"
    fine = f"{count} poses at most {STEP_MM:g} mm apart" if count else "never close to each other"
    return worst, where if worst > TOLERANCE_MM3 else fine


def overlaps(
    body: manifold3d.Manifold, other: manifold3d.Manifold, way: Way
) -> Iterator[tuple[float, float]]:
    """(distance in mm from its place, common volume in mm³) wherever the two come close."""
    box = np.array(body.bounding_box()).reshape(2, 3)
    corners = np.array(np.meshgrid(*box.T)).reshape(3, -1).T
    other_box = np.array(other.bounding_box())
    stops = [
        (travelled, pose)
        for travelled, pose in poses(way, box, STEP_MM)
        if boxes_meet(_box(moved(corners, pose)), other_box)
    ]
    if not stops:
        return
    near = _piece(other, [_box(moved(corners, pose)) for _, pose in stops])
    for travelled, pose in stops:
        yield travelled, float((body.transform(pose[:3]) ^ near).volume())


def _box(corners: Pose) -> np.ndarray:
    """Lowest and highest of (n, 3) points, as (6,)."""
    return np.concatenate([corners.min(axis=0), corners.max(axis=0)])


def _piece(other: manifold3d.Manifold, boxes: list[np.ndarray]) -> manifold3d.Manifold:
    """The part of a body that the boxes reach."""
    low, high = np.min(boxes, axis=0)[:3], np.max(boxes, axis=0)[3:]
    return other ^ manifold3d.Manifold.cube(tuple(high - low)).translate(tuple(low))
