# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""How well a motion between two touches accounts for what both show."""

from dataclasses import dataclass

import numpy as np

from recon.pose.level import looked_up
from recon.pose.pyramid import Pyramid, residuals
from recon.pose.rigid import Transform, applied


@dataclass(frozen=True, kw_only=True)
class Agreement:
    """How well a motion between two touches accounts for what both show."""

    overlap: float = 0.0
    """Share of the smaller contact in common."""
    explained: float = 0.0
    """Share of the energy of the slopes there."""
    alike: float = 0.0
    """Correlation of texture and edges there."""


def agreement(reference: Pyramid, current: Pyramid, T_current_reference: Transform) -> Agreement:
    """Judge a motion, at half resolution."""
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
    energy = float((template.slopes[seen] ** 2).sum())
    left = float((residual[:2, seen] ** 2).sum())
    there = looked_up(reference.level(index).detail, template.points[seen])[:, :2]
    moved = applied(T_current_reference, template.points[seen]).astype(np.float32)
    here = looked_up(level.detail, moved)[:, :2] @ T_current_reference[:2, :2]
    product = float(np.linalg.norm(there) * np.linalg.norm(here))
    return Agreement(
        overlap=min(common / max(min(contacts), 1), 1.0),
        explained=1 - left / max(energy, 1e-9),
        alike=float((there * here).sum()) / max(product, 1e-9),
    )
