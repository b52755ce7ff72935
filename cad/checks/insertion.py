# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Every body can be put in: driven along its way, turns included, past all that stands there.

Between two poses no point moves farther than ``STEP_MM``, so what the check does not see is less
than half of that deep, and nothing as thick as a wall can be passed over.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import manifold3d
import numpy as np

from cad.checks.fit import TOLERANCE_MM3
from cad.motions import Way, poses
from cad.result import Result
from cad.steps import Assembly, Step

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
        stops = _stops(bodies[name], assembly.way(step, name))
        for other in assembly.standing(step):
            for travelled, volume in _overlaps(bodies[name], bodies[other], stops):
                count += 1
                if volume > worst:
                    worst = volume
                    where = f"{name} touches {other} {travelled:.1f} mm before its place"
    fine = f"{count} poses at most {STEP_MM:g} mm apart" if count else "never close to each other"
    return worst, where if worst > TOLERANCE_MM3 else fine


@dataclass(frozen=True)
class _Stops:
    """Where a body is looked at on its way in, from its place outward."""

    travelled_mm: np.ndarray
    """(n,) distance from its place."""
    poses: np.ndarray
    """(n, 4, 4)."""
    low_mm: np.ndarray
    high_mm: np.ndarray
    """(n, 3) corners of the box that the body's own box has there."""


def _stops(body: manifold3d.Manifold, way: Way) -> _Stops:
    box = np.array(body.bounding_box()).reshape(2, 3)
    corners = np.array(np.meshgrid(*box.T)).reshape(3, -1).T
    travelled, places = zip(*poses(way, box, STEP_MM), strict=True)
    stacked = np.stack(places)
    turned = corners @ stacked[:, :3, :3].transpose(0, 2, 1) + stacked[:, None, :3, 3]
    return _Stops(np.array(travelled), stacked, turned.min(axis=1), turned.max(axis=1))


def _overlaps(
    body: manifold3d.Manifold, other: manifold3d.Manifold, stops: _Stops
) -> Iterator[tuple[float, float]]:
    """(distance in mm from its place, common volume in mm³) wherever the two come close."""
    low, high = np.array(other.bounding_box()).reshape(2, 3)
    close = ((stops.low_mm < high) & (low < stops.high_mm)).all(axis=1)
    if not close.any():
        return
    near = _piece(other, stops.low_mm[close].min(axis=0), stops.high_mm[close].max(axis=0))
    for travelled, pose in zip(stops.travelled_mm[close], stops.poses[close], strict=True):
        yield float(travelled), float((body.transform(pose[:3]) ^ near).volume())


def _piece(
    other: manifold3d.Manifold, low_mm: np.ndarray, high_mm: np.ndarray
) -> manifold3d.Manifold:
    """The part of a body that lies in a box."""
    return other ^ manifold3d.Manifold.cube(tuple(high_mm - low_mm)).translate(tuple(low_mm))
