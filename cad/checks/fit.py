# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""No two bodies share space, and parts that slide have their gap.

Bodies are intersected as meshes, which lie within 0.005 mm of the solids.
"""

from collections.abc import Mapping
from itertools import combinations

import manifold3d
import numpy as np

from cad.result import Result
from cad.steps import Assembly
from sensor.design import Wedge

TOLERANCE_MM3 = 0.005
"""Faces that touch overlap by rounding; a real clash is hundreds of times larger."""
Bodies = Mapping[str, manifold3d.Manifold]


def common_mm3(first: manifold3d.Manifold, second: manifold3d.Manifold) -> float:
    """Volume that two bodies share."""
    a, b = np.array(first.bounding_box()), np.array(second.bounding_box())
    boxes_meet = (a[:3] < b[3:]).all() and (b[:3] < a[3:]).all()  # their lowest, highest corners
    return float((first ^ second).volume()) if boxes_meet else 0.0


def check_interference(assembly: Assembly, bodies: Bodies) -> list[Result]:
    """Largest volume that two bodies of the finished sensor share."""
    worst, where = 0.0, ""
    for first, second in combinations(assembly.bodies, 2):
        volume = common_mm3(bodies[first], bodies[second])
        if volume > worst:
            worst, where = volume, f"{first} and {second}"
    pairs = len(assembly.bodies) * (len(assembly.bodies) - 1) // 2
    detail = where if worst > TOLERANCE_MM3 else f"{pairs} pairs"
    return [Result("interference", "assembly", worst, "mm³", TOLERANCE_MM3, "at most", detail)]


def check_clearances(design: Wedge, bodies: Bodies) -> list[Result]:
    """How far parts can be pushed to either side before they touch: the gap that was asked for."""
    slide = design.printing.sliding_clearance_mm
    press = design.printing.press_clearance_mm
    asked = [
        ("camera", "camera_holder", press),
        ("camera_holder", "case", slide),
        ("acrylic", "case", press),
        ("mirror", "case", slide),
    ]
    results = []
    for moved, fixed, bound in asked:
        gap = _least_gap(bodies[moved], bodies[fixed])
        results.append(
            Result("clearance", f"{moved} in {fixed}", gap, "mm", bound - 0.01, "at least",
                   f"designed for {bound:g} mm per side")
        )  # fmt: skip
    gap = float(bodies["mirror"].min_gap(bodies["acrylic"], 5.0))
    bound = design.mirror.foot_height_mm
    results.append(
        Result("clearance", "mirror over acrylic", gap, "mm", bound - 0.01, "at least",
               f"designed for {bound:g} mm")
    )  # fmt: skip
    return results


def _least_gap(moved: manifold3d.Manifold, fixed: manifold3d.Manifold) -> float:
    """The smaller gap of the two sides: the second is looked for only where the first is larger."""
    gap = _sideways_gap(moved, fixed, -1)
    return gap if _is_free(moved, fixed, gap) else _sideways_gap(moved, fixed, 1)


def _sideways_gap(moved: manifold3d.Manifold, fixed: manifold3d.Manifold, side: int) -> float:
    """Largest shift toward +y or -y without contact, in mm, found by halving between 0 and 1."""
    free, stuck = 0.0, 1.0
    if not _is_free(moved, fixed, 0.0):
        return 0.0
    while stuck - free > 0.002:
        middle = (free + stuck) / 2
        if _is_free(moved, fixed, side * middle):
            free = middle
        else:
            stuck = middle
    return free


def _is_free(moved: manifold3d.Manifold, fixed: manifold3d.Manifold, shift_mm: float) -> bool:
    """Whether a body, shifted along y, touches nothing of another."""
    return common_mm3(moved.translate((0.0, shift_mm, 0.0)), fixed) <= TOLERANCE_MM3
