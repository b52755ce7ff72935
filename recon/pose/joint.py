# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Gauss-Newton on slopes and depth together, from coarse to fine.

The current touch is looked up where the guess puts the reference's points; its normals are turned
back and compared. So derivatives are those of the reference, taken once (Baker and Matthews, IJCV
56(3), 2004, call it inverse compositional).

The weight of depth against slopes follows from the noise. White noise on slopes makes that of
depth, its integral, so smooth that a contact's whole depth counts as one measurement; what it adds
to the slopes is the height of the contact, which they do not see.
"""

from dataclasses import dataclass

import numpy as np

from recon.pose.pyramid import LEAST_PX, Level, Pyramid, Template, residuals
from recon.pose.registration import Alignment, Touch
from recon.pose.rigid import Covariance, Transform, Twist, motion

STEPS_PER_LEVEL = 8
STILL = 1e-5
"""A step of so many radians, and ten times as many mm, ends a level."""
OUTLIER = 3.0
"""Residuals of so many standard deviations weigh half."""
RAYLEIGH_MEDIAN = 1.1774
LEAST_NOISE = 0.002
"""Of slopes: what no real gel is better than."""
PRIOR_DEG, PRIOR_MM = 5.0, 0.5
"""Standard deviation of a motion nobody saw: where the touch says nothing, the guess stays."""
CORRELATED_PX = (5.0, 3.35, 3.35)
"""By level: after smoothing, neighbours share noise, and so many say as much as one alone would."""


@dataclass(frozen=True, kw_only=True)
class Joint:
    """Slopes and depth together."""

    def prepare(self, touch: Touch) -> Pyramid:
        """The touch at several resolutions."""
        return Pyramid(touch)

    def align(
        self, reference: Pyramid, current: Pyramid, T_current_reference: Transform
    ) -> Alignment:
        """Refine a guess from the coarsest level to the finest."""
        guess = T_current_reference
        covariance = _prior()
        for index, template in reference.templates.items():
            level = current.levels[index]
            for _ in range(STEPS_PER_LEVEL):
                step, covariance = _step(template, level, guess, T_current_reference)
                guess = guess @ motion(step)
                if np.abs(step[:3]).max() < STILL and np.abs(step[3:]).max() < 10 * STILL:
                    break
        return Alignment(T_current_reference=guess, covariance=covariance)


def _prior() -> Covariance:
    return np.diag([np.radians(PRIOR_DEG) ** 2] * 3 + [PRIOR_MM**2] * 3)


def _step(
    template: Template, level: Level, guess: Transform, first: Transform
) -> tuple[Twist, Covariance]:
    """The twist that improves a guess, and the covariance of what it leads to."""
    residual, seen = residuals(template, level, guess)
    if np.count_nonzero(seen) < LEAST_PX:
        return np.zeros(6), _prior()
    slope_error = np.hypot(residual[0], residual[1])
    noise = (
        float(np.median(slope_error[seen])) / 1.1774 + LEAST_NOISE
    )  # the median of a Rayleigh law
    depth_noise = 1.4826 * float(np.median(np.abs(residual[2][seen]))) + 1e-6
    slope_weight = seen / (1 + (slope_error / (OUTLIER * noise)) ** 2)
    depth_weight = seen / (1 + (residual[2] / (OUTLIER * depth_noise)) ** 2)
    weight = np.stack([slope_weight, slope_weight, template.depth_weight * depth_weight])
    weight = weight.reshape(-1, 1).astype(np.float32)
    change = template.change.reshape(-1, 6)
    weighted = weight * change
    normal = (weighted.T @ change).astype(float)
    variance = noise**2 * CORRELATED_PX[level.halvings]
    rigidity = variance * np.linalg.inv(_prior())
    away = _small_twist(first, guess)
    pull = (weighted.T @ residual.reshape(-1)).astype(float) - rigidity @ away
    step = np.linalg.solve(normal + rigidity, pull)
    learned = normal - noise**2 / 2 * float(slope_weight.mean()) * template.noise_change
    values, axes = np.linalg.eigh(learned)
    honest = (axes * np.maximum(values, 0)) @ axes.T + rigidity
    return step, variance * np.linalg.inv(honest)


def _small_twist(start: Transform, end: Transform) -> Twist:
    """The twist between two transforms that differ little, to first order."""
    between = start[:3, :3].T @ end[:3, :3]
    turn = 0.5 * np.array(
        [
            between[2, 1] - between[1, 2],
            between[0, 2] - between[2, 0],
            between[1, 0] - between[0, 1],
        ]
    )
    return np.concatenate([turn, start[:3, :3].T @ (end[:3, 3] - start[:3, 3])])
