# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""How well a motion between two touches accounts for what both show."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float32

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
    contacts = [
        int(np.count_nonzero(item.values[..., 3])) for item in (reference.level(index), level)
    ]
    common = int(np.count_nonzero(seen)) * contacts[0] / len(template.points)
    slopes = template.slopes.T
    expected, found = _across(slopes), _across(slopes + residual[:2])
    energy, left = (float((part**2 @ seen).sum()) for part in (expected, found - expected))
    has_details = np.count_nonzero(reference.details(index).any(1) & seen) >= LEAST_PX
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
    found = looked_up(detail, carried(template.points, T_current_reference).T).T
    there = reference.details(index).T * (found[3] > 0.5)
    here = T_current_reference[:2, :2].T.astype(np.float32) @ found[:2] * (found[3] > 0.5)
    product = float(np.linalg.norm(there) * np.linalg.norm(here))
    return float((there * here).sum()) / max(product, 1e-9)


def _across(slopes: Float32[np.ndarray, "2 n"]) -> Float32[np.ndarray, "2 n"]:
    """Unit normals along x and y: slopes of a steep side would outweigh all others."""
    across: Float32[np.ndarray, "2 n"] = slopes / np.sqrt(1 + (slopes**2).sum(0))
    return across
