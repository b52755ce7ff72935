# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""How well a motion between two touches accounts for what both show."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float32

from recon.kernels import compiled
from recon.pose.level import looked_up
from recon.pose.pyramid import LEAST_PX, Pyramid
from recon.pose.rigid import Transform
from recon.pose.template import carried, residuals


@dataclass(frozen=True, kw_only=True)
class Agreement:
    """How well a motion between two touches accounts for what both show."""

    overlap: float = 0.0
    """Share of the smaller contact in common."""
    explained: float = 0.0
    """Share of the energy of the normals there, as far as they lean."""
    alike: float = 0.0
    """Correlation of texture and edges there."""


def agreement(reference: Pyramid, current: Pyramid, T_current_reference: Transform) -> Agreement:
    """Judge a motion, at half resolution; details that are too fine for that, at full."""
    index = 1 if 1 in reference.templates else reference.finest
    if index not in reference.templates:
        return Agreement()
    template, level = reference.templates[index], current.level(index)
    residual, seen = residuals(template, level, T_current_reference)
    if not seen.any():
        return Agreement()
    contacts = reference.level(index).contact_px, level.contact_px
    common = int(np.count_nonzero(seen)) * contacts[0] / len(template.points)
    energy, left = _energies(template.slopes.T, residual, seen)
    has_details = np.count_nonzero(reference.details(index).any(0) & seen) >= LEAST_PX
    looked_at = index if has_details else reference.finest
    return Agreement(
        overlap=min(common / max(min(contacts), 1), 1.0),
        explained=1 - left / max(energy, 1e-9),
        alike=_alike(reference, current, T_current_reference, looked_at),
    )


def _alike(
    reference: Pyramid, current: Pyramid, T_current_reference: Transform, index: int
) -> float:
    """Correlation of details at one resolution."""
    template, detail = reference.templates[index], current.level(index).detail
    found = looked_up(detail, carried(template.points, T_current_reference))
    there = reference.details(index) * (found[3] > 0.5)
    here = T_current_reference[:2, :2].T.astype(np.float32) @ found[:2] * (found[3] > 0.5)
    product = float(np.linalg.norm(there) * np.linalg.norm(here))
    return float((there * here).sum()) / max(product, 1e-9)


def _take_energies(
    slopes: Float32[np.ndarray, "2 n"],
    residual: Float32[np.ndarray, "3 n"],
    seen: Bool[np.ndarray, " n"],
) -> tuple[float, float]:
    """Of unit normals' parts along the gel, and of what is left over of them.

    Slopes of a steep side would outweigh all others.
    """
    one = np.float32(1)
    energy = left = np.float32(0)
    for k in range(len(seen)):
        x, y = slopes[0, k], slopes[1, k]
        found_x, found_y = x + residual[0, k], y + residual[1, k]
        square, found = x * x + y * y, one / np.sqrt(one + found_x * found_x + found_y * found_y)
        expected = one / np.sqrt(one + square)
        off_x, off_y = found_x * found - x * expected, found_y * found - y * expected
        energy += seen[k] * square * expected * expected
        left += seen[k] * (off_x * off_x + off_y * off_y)
    return float(energy), float(left)


_energies = compiled(_take_energies)
