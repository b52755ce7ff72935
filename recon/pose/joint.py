# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Gauss-Newton on slopes and depth together, from coarse to fine.

The current touch is looked up where the guess puts the reference's points; its normals are turned
back and compared. So derivatives are those of the reference, taken once (Baker and Matthews, IJCV
56(3), 2004, call it inverse compositional).

The weight of depth against slopes follows from the noise. White noise on slopes makes that of
depth, its integral, so smooth that a contact's whole depth counts as one measurement; what it adds
to the slopes is the height of the contact, which they do not see. At full resolution one more step
takes in the height of the contact's rim, as far as it can be believed (``recon.pose.rim``).
"""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float32

from recon.pose.pyramid import LEAST_PX, Level, Pyramid, Template, residuals
from recon.pose.registration import Alignment, Touch
from recon.pose.rigid import Covariance, Transform, Twist, motion
from recon.pose.rim import rim

STEPS_PER_LEVEL = 8
STILL = 3e-5
"""A step of so many radians, and ten times as many mm, ends the finest level."""
ALMOST_STILL = 10 * STILL
"""The same of the levels before, which serve as its guess."""
OUTLIER = 3.0
"""Residuals of so many standard deviations weigh half."""
RAYLEIGH_MEDIAN = 1.1774
LEAST_NOISE = 0.002
"""Of slopes: what no real gel is better than."""
PRIOR_DEG, PRIOR_MM = 5.0, 0.5
"""Standard deviation of a motion nobody saw: where the touch says nothing, the guess stays."""
TILES = 5
"""Along each side of the contact."""
CORRELATED_PX = (8.0, 6.7, 6.7)
"""By level: so many residuals say as much as one of independent noise would. Smoothing lets
neighbours share noise; and what no surface can have is gone, half of the noise, but little of what
a motion could be taken for."""


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
        equations = None
        finest = min(reference.templates, default=None)
        for index, template in reference.templates.items():
            level = current.level(index)
            still = STILL if index == finest else ALMOST_STILL
            for _ in range(STEPS_PER_LEVEL):
                equations = _linearized(template, level, guess)
                if equations is None:
                    break
                step = equations.step(_small_twist(T_current_reference, guess))
                guess = guess @ motion(step)
                if np.abs(step[:3]).max() < still and np.abs(step[3:]).max() < 10 * still:
                    break
        if equations is not None and finest == 0:
            equations = _with_rim(equations, reference, current, guess)
            guess = guess @ motion(equations.step(_small_twist(T_current_reference, guess)))
        covariance = _prior() if equations is None else equations.covariance()
        return Alignment(T_current_reference=guess, covariance=covariance)


@dataclass(frozen=True, kw_only=True)
class _Equations:
    """Weighted linear equations for the twist that improves a guess."""

    template: Template
    weight: Float32[np.ndarray, "3 n"]
    residual: Float32[np.ndarray, "3 n"]
    normal: Covariance
    noise: float
    """Standard deviation of a slope's residual."""
    variance: float
    """The same squared, for neighbours that share noise."""

    @property
    def rigidity(self) -> Covariance:
        """What the prior adds to the normal equations."""
        return self.variance * np.linalg.inv(_prior())

    def step(self, away: Twist) -> Twist:
        """The twist, when the guess is ``away`` from where the search began."""
        weighted = (self.weight * self.residual).reshape(-1)
        pull = (self.template.change.reshape(-1, 6).T @ weighted).astype(float)
        twist: Twist = np.linalg.solve(self.normal + self.rigidity, pull - self.rigidity @ away)
        return twist

    def covariance(self) -> Covariance:
        """Of the twist: what noise alone would leave, or what the residuals show, if that is more.

        Errors of a reconstruction are alike over millimetres. Sums of the equations over tiles of
        the contact show how much they scatter; a variance from these sums holds whatever the
        correlation within a tile (cluster-robust: Liang and Zeger, Biometrika 73(1), 1986). No
        direction is less certain than before the touch.
        """
        share = float(self.weight[0].mean())
        learned = self.normal - self.noise**2 / 2 * share * self.template.noise_change
        scale = np.sqrt(np.diag(_prior()))  # in these units the prior is the identity
        known, axes = np.linalg.eigh(learned * np.outer(scale, scale) / self.variance)
        known = np.maximum(known, 0)
        equations = ((self.weight * self.residual)[..., None] * self.template.change).sum(0)
        tiles = self.template.tiles(TILES)
        sums = np.stack(
            [np.bincount(tiles, column, minlength=TILES**2) for column in equations.T], -1
        )
        scatter = ((sums - sums.mean(0)) * scale @ axes / self.variance) ** 2
        growth = np.maximum(scatter.sum(0) / np.maximum(known, 1e-12), 1)
        spread = scale[:, None] * axes / np.sqrt(known / growth + 1)
        return spread @ spread.T


def _prior() -> Covariance:
    return np.diag([np.radians(PRIOR_DEG) ** 2] * 3 + [PRIOR_MM**2] * 3)


def _linearized(template: Template, level: Level, guess: Transform) -> _Equations | None:
    """The equations at a guess; ``None`` where too little is seen."""
    residual, seen = residuals(template, level, guess)
    if np.count_nonzero(seen) < LEAST_PX:
        return None
    slope_error = np.hypot(residual[0], residual[1])
    noise = float(np.median(slope_error[seen])) / RAYLEIGH_MEDIAN + LEAST_NOISE
    depth_noise = 1.4826 * float(np.median(np.abs(residual[2][seen]))) + 1e-6
    slope_weight = seen / (1 + (slope_error / (OUTLIER * noise)) ** 2)
    depth_weight = seen / (1 + (residual[2] / (OUTLIER * depth_noise)) ** 2)
    weight = np.stack([slope_weight, slope_weight, template.depth_weight * depth_weight])
    weight = weight.astype(np.float32)
    change = template.change.reshape(-1, 6)
    return _Equations(
        template=template,
        weight=weight,
        residual=residual,
        normal=((weight.reshape(-1, 1) * change).T @ change).astype(float),
        noise=noise,
        variance=noise**2 * CORRELATED_PX[level.halvings],
    )


def _with_rim(
    found: _Equations, reference: Pyramid, current: Pyramid, guess: Transform
) -> _Equations:
    """The equations at the guess they led to, with heights of the rim beside its depths."""
    equations = _linearized(found.template, current.level(0), guess) or found
    edge = rim(reference, current, equations.weight[0] > 0, guess)
    if edge is None:
        return equations
    added = np.float32(edge.weight * edge.believed(equations.variance, equations.covariance()))
    weight, residual = equations.weight.copy(), equations.residual.copy()
    depth = weight[2, edge.pixels]
    pull = depth * residual[2, edge.pixels] + added * edge.residual
    weight[2, edge.pixels] = depth + added
    residual[2, edge.pixels] = pull / (depth + added)
    normal = equations.normal + added * (edge.change.T @ edge.change)
    return replace(equations, weight=weight, residual=residual, normal=normal)


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
