# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""How exact tracked poses are, on touches whose pose is known."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from recon.pose.estimate import PoseEstimate
from recon.pose.registration import Touch


@dataclass(frozen=True, kw_only=True)
class StepErrors:
    """Errors of single steps of 2.5 degrees and 0.2 mm from one noisy touch to another."""

    thing: str
    tracker: str
    steps: int
    angle_deg: float
    """Median."""
    shift_mm: float
    squares: float
    """Mean of the squared error in units of the reported covariance; 6 where that is right."""
    milliseconds: float
    """Processor time to prepare the touch and to align it."""


@dataclass(frozen=True, kw_only=True)
class Roll:
    """A textured bead rolled once round beneath the gel, at a quarter of a frame's pixels."""

    true_deg: Sequence[float]
    error_deg: Mapping[str, Sequence[float]]
    """By tracker; NaN where lost."""
    found: Sequence[PoseEstimate]
    """By the first tracker."""
    touches: Sequence[Touch]
