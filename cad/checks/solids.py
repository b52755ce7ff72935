# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Every part is one closed body of the volume it should have."""

import math
from collections.abc import Mapping

import cadquery as cq
import trimesh

from cad.layout import Layout
from cad.parts import mold
from cad.parts.jigs import ball_jig_volume_mm3
from cad.result import Result
from sensor.design import Gel, Wedge


def check_solids(
    solids: Mapping[str, cq.Solid], meshes: Mapping[str, trimesh.Trimesh]
) -> list[Result]:
    """Every part is one valid solid, and its mesh one closed surface of the same volume."""
    results = []
    for name, mesh in meshes.items():
        solid = solids[name]
        sound = solid.isValid() and mesh.is_watertight and mesh.is_winding_consistent
        whole = sound and mesh.body_count == 1
        state = "valid, watertight" if whole else "open or in pieces"
        results.append(Result("solid", name, float(whole), "closed body", 1, "at least", state))
        error = abs(mesh.volume / solid.Volume() - 1) * 100 if sound else math.nan
        results.append(Result("mesh volume", name, error, "% off the solid", 0.2, "at most"))
    return results


def check_closed_forms(design: Wedge, solids: Mapping[str, cq.Solid]) -> list[Result]:
    """Volumes that a formula gives: the solids must agree to a millionth."""
    expected = {
        "ball_jig": ball_jig_volume_mm3(),
        "mold_flat": _flat_mold_mm3(design.gel),
        "mold_lid": _lid_mm3(design),
    }
    results = []
    for name, volume in expected.items():
        error = abs(solids[name].Volume() / volume - 1) * 1e6
        detail = f"{volume:.3f} mm³"
        results.append(Result("closed form", name, error, "ppm", 1.0, "at most", detail))
    return results


def _rounded_block_mm3(gel: Gel, height: float) -> float:
    area = (gel.pad_length_mm + 2 * mold.RIM) * (gel.pad_width_mm + 2 * mold.RIM)
    return (area - (4 - math.pi) * 2.0**2) * height


def _ring_mm3(gel: Gel, gap: float, height: float) -> float:
    def area(margin: float) -> float:
        return (gel.pad_length_mm + 2 * margin) * (gel.pad_width_mm + 2 * margin)

    return (area(mold.GROOVE_OUTSIDE - gap) - area(mold.GROOVE_INSIDE + gap)) * height


def _flat_mold_mm3(gel: Gel) -> float:
    cavity = gel.pad_length_mm * gel.pad_width_mm * gel.thickness_mm
    gate = mold.GROOVE_INSIDE * mold.GATE_DEPTH
    way_out = (mold.RIM - mold.GROOVE_OUTSIDE) * mold.GROOVE_DEPTH
    notches = 4 * mold.OVERFLOW_WIDTH * (gate + way_out)
    block = _rounded_block_mm3(gel, gel.thickness_mm + mold.FLOOR)
    return block - cavity - notches - _ring_mm3(gel, 0, mold.GROOVE_DEPTH)


def _lid_mm3(design: Wedge) -> float:
    gap, height = Layout(design).slide, mold.GROOVE_DEPTH - 0.2
    ridge = mold.GROOVE_OUTSIDE - mold.GROOVE_INSIDE - 2 * gap
    notches = 4 * mold.OVERFLOW_WIDTH * ridge * height
    ring = _ring_mm3(design.gel, gap, height) - notches
    return _rounded_block_mm3(design.gel, mold.LID) + ring
