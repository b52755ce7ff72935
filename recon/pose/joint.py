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

Where a mesh's sides are so steep that its slopes do not show all of its depth, nobody knows how
much of that a sensor shows: nothing, or all of it where gel tents. Its heights then have a common
error as large as all of it, and weigh so much less.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from jaxtyping import Float, Float32

from recon.pose.level import Level
from recon.pose.noise import LENGTHS_MM, Variances, noise_between
from recon.pose.pyramid import LEAST_PX, Pyramid
from recon.pose.registration import PRIOR, Alignment, Touch
from recon.pose.rigid import Covariance, Transform, Twist, motion
from recon.pose.rim import rim
from recon.pose.template import STENCIL, TILES, Template, residuals, sums_by_tile

STEPS_PER_LEVEL = 8
STILL = 1e-4
"""A step of so many radians, and ten times as many mm, ends the finest level."""
ALMOST_STILL = 30 * STILL
"""The same of the levels before, which only serve as its guess."""
OUTLIER = 3.0
"""Residuals of so many standard deviations weigh half."""
RAYLEIGH_MEDIAN = 1.1774
LEAST_NOISE = 0.002
"""Of slopes: what no real gel is better than."""
LEAST_SHOWN = 0.5
"""Of what derivatives say of the least certain motion, to be believed: as much as noise tells."""
SHOWN_PX, SHOWN_SLOPE, LARGEST_SHOWN = 1.5, 0.1, 4.0
"""It moves pixels so far in the mean, unless slopes change by more, or it were far from likely."""
CORRELATED_PX = (8.0, 6.7, 6.7)
"""By level: so many residuals say as much as one of independent noise would. Smoothing lets
neighbours share noise; and what no surface can have is gone, half of the noise, but little of what
a motion could be taken for."""
WHITE_LEFT = (0.25, 0.075, 0.015)
"""By level: of white noise's variance, what reading and halving leave."""


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
        if equations is None:
            return Alignment(T_current_reference=guess, covariance=PRIOR.copy())
        noise = noise_between(reference.coarse, current.coarse, guess)
        if noise is None:
            return Alignment(T_current_reference=guess, covariance=equations.covariance())
        pretended = _pretended(noise, reference.level(min(reference.templates)))
        # Of white noise, residuals tell.
        pull = np.tensordot(noise[1:], reference.pulls(equations.depth_share)[1:], 1)
        level = current.level(min(reference.templates))
        covariance = equations.covariance(pretended, pull, partial(_shown, equations, level, guess))
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
    depth_share: float
    """Of depths' weights, what the doubt of the reference's depth leaves."""

    def step(self, away: Twist) -> Twist:
        """The twist, when the guess is ``away`` from where the search began."""
        weighted = (self.weight * self.residual).reshape(-1)
        pull = (self.template.by_twist @ weighted).astype(float)
        rigidity = self.variance * self.template.rigidity
        twist: Twist = np.linalg.solve(self.normal + rigidity, pull - rigidity @ away)
        return twist

    def covariance(
        self,
        pretended: float = 1.0,
        pull: Covariance | None = None,
        shown: Callable[[Twist], float] | None = None,
    ) -> Covariance:
        """Of the twist: what noise alone would leave, or what the residuals show, if that is more.

        Errors of a reconstruction are alike over millimetres. Sums of the equations over tiles of
        the contact show how much they scatter; a variance from these sums holds whatever the
        correlation within a tile (cluster-robust: Liang and Zeger, Biometrika 73(1), 1986). Where
        the covariance M of the sums over all of the contact is known, with H for the normal
        equations and R for the prior's part, which is worth as much noise, the twist's is
        (H + R)^-1 (M + R) (H + R)^-1; it counts where it is larger. No direction is less certain
        than before the touch.

        Args:
            pretended: how much the derivatives' noise seems to tell of a motion, as a share of what
                white noise would.
            pull: M; by default nobody knows it.
            shown: how much of what the derivatives say of a motion is seen when it is made; asked
                of the least certain one. With less than a half they tell of noise, or of pixels.
        """
        share, prior = float(self.weight[0].mean()), self.template.prior
        learned = self.normal - pretended * self.noise**2 / 2 * share * self.template.noise_change
        known, axes = np.linalg.eigh(prior.T @ learned @ prior / self.variance)
        known = np.maximum(known, 0)
        if shown is not None and shown(prior @ axes[:, 0]) < LEAST_SHOWN:
            known[0] = 0
        pulls = self.template.by_twist * (self.weight * self.residual).reshape(-1)
        pulls = pulls.reshape(6, 3, -1).sum(1)
        sums = sums_by_tile(pulls, self.template.tiles, TILES**2)
        scatter = ((sums - sums.mean(0)) @ prior @ axes / self.variance) ** 2
        growth = np.maximum(scatter.sum(0) / np.maximum(known, 1e-12), 1)
        deviation = np.sqrt(known / growth + 1)
        spread = axes / deviation
        if pull is not None:
            twists = axes * (deviation / (known + 1))
            more = share * twists.T @ prior.T @ pull @ prior @ twists / self.variance**2
            ratios, turned = np.linalg.eigh(more + np.diag((deviation / (known + 1)) ** 2))
            spread = spread @ (turned * np.sqrt(np.maximum(ratios, 1)))
            variances, axes = np.linalg.eigh(spread @ spread.T)
            spread = axes * np.sqrt(np.minimum(variances, 1))
        spread = prior @ spread
        return spread @ spread.T


def _shown(equations: _Equations, level: Level, guess: Transform, twist: Twist) -> float:
    """How much of what the derivatives say of a motion is seen when it is made there and back.

    The correlation of both, weighted as in the equations. Of a round thing that spins, too, the
    derivatives say something, by how edges lie between the pixels: farther on they lie otherwise.
    """
    template, weight = equations.template.few, equations.weight[:, :: equations.template.every]
    moved = np.cross(twist[:3], template.points)[:, :2] + twist[3:5]
    told = template.change @ twist.astype(np.float32)
    far_mm, steep = (
        np.sqrt((part**2).sum(axis).mean()) for part, axis in ((moved, 1), (told[:2], 0))
    )
    pitch_mm = np.sqrt(np.prod(level.pitch_mm))
    share = 1 / max(far_mm / (SHOWN_PX * pitch_mm), steep / SHOWN_SLOPE, 1 / LARGEST_SHOWN)
    ahead, seen_ahead = residuals(template, level, guess @ motion(share * twist))
    back, seen_back = residuals(template, level, guess @ motion(-share * twist))
    weight, seen = weight * (seen_ahead & seen_back), back - ahead
    product = float((weight * told**2).sum()) * float((weight * seen**2).sum())
    return float((weight * told * seen).sum()) / max(np.sqrt(product), 1e-12)


def _pretended(noise: Variances, level: Level) -> float:
    """What slope errors' own derivatives seem to tell, as a share of what white ones would.

    Noise smoothed by l has derivatives of the variance 1 / (2 l^2).
    """
    length_px = np.array(LENGTHS_MM[1:]) / np.sqrt(np.prod(level.pitch_mm))
    steepness = np.minimum(1 / (2 * length_px**2) / (STENCIL**2).sum(), 1)
    white = noise[0] * WHITE_LEFT[level.halvings]
    return float((white + noise[1:] @ steepness) / (white + noise[1:].sum()))


def _linearized(template: Template, level: Level, guess: Transform) -> _Equations | None:
    """The equations at a guess; ``None`` where too little is seen."""
    residual, seen = residuals(template, level, guess)
    if np.count_nonzero(seen) < LEAST_PX:
        return None
    squares = residual[1:] ** 2
    squares[0] += residual[0] ** 2
    slope_median, depth_median = np.sqrt(_median(squares[:, seen]))
    noise = slope_median / RAYLEIGH_MEDIAN + LEAST_NOISE
    depth_noise = 1.4826 * depth_median + 1e-6
    limits = OUTLIER * np.array([[noise], [depth_noise]])
    slope_weight, depth_weight = seen / (1 + squares / (limits**2).astype(np.float32))
    variance = noise**2 * CORRELATED_PX[level.halvings]
    depth_weight *= template.depth_weight
    depth_share = _undoubted(template, variance, float(depth_weight.sum()))
    weight = np.empty_like(residual)
    weight[:2], weight[2] = slope_weight, depth_share * depth_weight
    change = template.by_twist
    return _Equations(
        template=template,
        weight=weight,
        residual=residual,
        normal=((weight.reshape(-1) * change) @ change.T).astype(float),
        noise=noise,
        variance=variance,
        depth_share=depth_share,
    )


def _median(squares: Float32[np.ndarray, "2 n"]) -> Float[np.ndarray, "2"]:
    """Of each row; of an even number the larger of the two in the middle."""
    middle = squares.shape[1] // 2
    return np.partition(squares, middle, axis=1)[:, middle].astype(float)


def _undoubted(template: Template, variance: float, weight: float) -> float:
    """Share of the weight of depths that doubt of them all together leaves.

    Args:
        template: of the reference.
        variance: of a residual of weight 1.
        weight: of all depths.
    """
    return 1 / (1 + weight * template.depth_doubt_mm2 / variance)


def _with_rim(
    found: _Equations, reference: Pyramid, current: Pyramid, guess: Transform
) -> _Equations:
    """The equations at the guess they led to, with heights of the rim beside its depths."""
    equations = _linearized(found.template, current.level(0), guess) or found
    edge = rim(reference, current, equations.weight[0] > 0, guess)
    if edge is None:
        return equations
    template, weight, residual = equations.template, equations.weight.copy(), equations.residual
    rim_weight = edge.weight * edge.believed(equations.variance, equations.covariance())
    # What is doubted of all heights together is doubted of the rim's as well.
    whole = float(weight[2].sum()) / equations.depth_share + rim_weight * len(edge.residual)
    share = _undoubted(template, equations.variance, whole)
    less, added = np.float32(share / equations.depth_share), np.float32(share * rim_weight)
    depths = (weight[2, :, None] * template.change[2]).T @ template.change[2]
    normal = equations.normal + (less - 1) * depths + added * (edge.change.T @ edge.change)
    weight[2] *= less
    depth, residual = weight[2, edge.pixels], residual.copy()
    pull = depth * residual[2, edge.pixels] + added * edge.residual
    weight[2, edge.pixels] = depth + added
    residual[2, edge.pixels] = pull / (depth + added)
    return replace(equations, weight=weight, residual=residual, normal=normal, depth_share=share)


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
