# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Weighted linear equations for the twist that improves a guess, and what doubt they leave."""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float32

from recon.kernels import compiled
from recon.medians import PER_MAD
from recon.pose.level import Level
from recon.pose.pyramid import LEAST_PX
from recon.pose.rigid import Covariance, Transform, Twist
from recon.pose.template import TILES, Template, residuals, sums_by_tile

OUTLIER = 3.0
"""Residuals of so many standard deviations weigh half."""
RAYLEIGH_MEDIAN = 1.1774
NORMAL_MEDIAN = 1 / PER_MAD
LEAST_NOISE = 0.002
"""Noise of slopes; no real gel has less."""
LEAST_SHOWN = 0.5
"""Of what derivatives say of the least certain motion, to be believed: as much as noise tells."""
CORRELATED_PX = (8.0, 6.7, 6.7)
"""By level: so many residuals say as much as one of independent noise would. Smoothing lets
neighbours share noise; and what no surface can have is gone, half of the noise, but little of what
a motion could be taken for."""
ROWS = [0, 0, 1]
"""Which weight slopes along x, along y and depths have."""


@dataclass(frozen=True, kw_only=True)
class Equations:
    """Weighted linear equations for the twist that improves a guess."""

    template: Template
    weight: Float32[np.ndarray, "2 n"]
    """Of each pixel's two slopes, and of its depth."""
    residual: Float32[np.ndarray, "3 n"]
    normal: Covariance
    pull: Twist
    """What residuals pull at the twist, by their weights."""
    noise: float
    """Standard deviation of a slope's residual."""
    variance: float
    """The same squared, for neighbours that share noise."""
    depth_share: float
    """Of depths' weights, what the doubt of the reference's depth leaves."""

    def step(self, away: Twist) -> Twist:
        """The twist, when the guess is ``away`` from where the search began."""
        rigidity = self.variance * self.template.rigidity
        twist: Twist = np.linalg.solve(self.normal + rigidity, self.pull - rigidity @ away)
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
        share, prior = float(self.weight[0].sum()) / self.weight.shape[1], self.template.prior
        learned = self.normal - pretended * self.noise**2 / 2 * share * self.template.noise_change
        known, axes = np.linalg.eigh(prior.T @ learned @ prior / self.variance)
        known = np.maximum(known, 0)
        if shown is not None and shown(prior @ axes[:, 0]) < LEAST_SHOWN:
            known[0] = 0
        pulls = np.einsum("jkn,kn->jn", self.template.change, self.weight[ROWS] * self.residual)
        sums = sums_by_tile(pulls, self.template.tiles, TILES**2)
        scatter = ((sums - sums.sum(0) / len(sums)) @ prior @ axes / self.variance) ** 2
        growth = np.maximum(scatter.sum(0) / np.maximum(known, 1e-12), 1)
        deviation = np.sqrt(known / growth + 1)
        spread = axes / deviation
        if pull is not None:
            scale = deviation / (known + 1)
            twists = axes * scale
            more = share * twists.T @ prior.T @ pull @ prior @ twists / self.variance**2
            ratios, turned = np.linalg.eigh(more + np.diag(scale**2))
            spread = spread @ (turned * np.sqrt(np.maximum(ratios, 1)))
            variances, axes = np.linalg.eigh(spread @ spread.T)
            spread = axes * np.sqrt(np.minimum(variances, 1))
        spread = prior @ spread
        return spread @ spread.T


def linearized(template: Template, level: Level, guess: Transform) -> Equations | None:
    """The equations at a guess; ``None`` where too little is seen."""
    residual, seen = residuals(template, level, guess)
    weight, squares = np.empty((2, len(seen)), np.float32), np.empty((2, len(seen)), np.float32)
    count = _squares(residual, seen, squares)
    if count < LEAST_PX:
        return None
    # Of an even number the larger of the two in the middle.
    middle = np.partition(squares[:, :count], count // 2, axis=1)[:, count // 2]
    noise = math.sqrt(middle[0]) / RAYLEIGH_MEDIAN + LEAST_NOISE
    depth_noise = math.sqrt(middle[1]) / NORMAL_MEDIAN + 1e-6
    variance = noise**2 * CORRELATED_PX[level.halvings]
    whole = _weights(residual, seen, OUTLIER * noise, OUTLIER * depth_noise, weight)
    depth_share = undoubted(template, variance, template.depth_weight * whole)
    weight[1] *= depth_share * template.depth_weight
    return equations_of(template, weight, residual, noise, variance, depth_share)


def _take_squares(
    residual: Float32[np.ndarray, "3 n"],
    seen: Bool[np.ndarray, " n"],
    squares: Float32[np.ndarray, "2 n"],
) -> int:
    """Of slopes and depths, those that are seen, one after another; how many they are."""
    count = 0
    for k in range(len(seen)):
        squares[0, count] = residual[0, k] ** 2 + residual[1, k] ** 2
        squares[1, count] = residual[2, k] ** 2
        count += seen[k]
    return count


def _take_weights(
    residual: Float32[np.ndarray, "3 n"],
    seen: Bool[np.ndarray, " n"],
    slope_limit: float,
    depth_limit_mm: float,
    weight: Float32[np.ndarray, "2 n"],
) -> float:
    """1 / (1 + r^2 / limit^2) where both touch, else 0; the sum of depths'."""
    slope, depth = np.float32(1 / slope_limit**2), np.float32(1 / depth_limit_mm**2)
    one, whole = np.float32(1), np.float32(0)
    for k in range(len(seen)):
        square = residual[0, k] ** 2 + residual[1, k] ** 2
        weight[0, k] = seen[k] / (one + slope * square)
        weight[1, k] = seen[k] / (one + depth * residual[2, k] ** 2)
        whole += weight[1, k]
    return float(whole)


def equations_of(
    template: Template,
    weight: Float32[np.ndarray, "2 n"],
    residual: Float32[np.ndarray, "3 n"],
    noise: float,
    variance: float,
    depth_share: float,
) -> Equations:
    """Sum the equations of all pixels.

    Args:
        template: of the reference.
        weight: as in ``Equations``, as are the others.
        residual: of slope x, slope y and depth.
        noise: standard deviation of a slope's residual.
        variance: of neighbours that share noise.
        depth_share: of depths' weights, what doubt leaves.
    """
    sums = np.empty((6, 7), np.float32)
    _sums(template.change, residual, weight, sums)
    return Equations(
        template=template,
        weight=weight,
        residual=residual,
        normal=sums[:, :6].astype(float),
        pull=sums[:, 6].astype(float),
        noise=noise,
        variance=variance,
        depth_share=depth_share,
    )


def _take_sums(
    change: Float32[np.ndarray, "6 3 n"],
    residual: Float32[np.ndarray, "3 n"],
    weight: Float32[np.ndarray, "2 n"],
    sums: Float32[np.ndarray, "6 7"],
) -> None:
    """Products of the changes by each two parts of a twist, and with the residuals."""
    for i in range(6):
        for j in range(i + 1):
            total = np.float32(0)
            for k in range(residual.shape[1]):
                slopes = change[i, 0, k] * change[j, 0, k] + change[i, 1, k] * change[j, 1, k]
                total += weight[0, k] * slopes + weight[1, k] * change[i, 2, k] * change[j, 2, k]
            sums[i, j] = sums[j, i] = total
        total = np.float32(0)
        for k in range(residual.shape[1]):
            slopes = change[i, 0, k] * residual[0, k] + change[i, 1, k] * residual[1, k]
            total += weight[0, k] * slopes + weight[1, k] * change[i, 2, k] * residual[2, k]
        sums[i, 6] = total


_squares, _weights, _sums = (compiled(loop) for loop in (_take_squares, _take_weights, _take_sums))


def undoubted(template: Template, variance: float, weight: float) -> float:
    """Share of the weight of depths that doubt of them all together leaves.

    Args:
        template: of the reference.
        variance: of a residual of weight 1.
        weight: of all depths.
    """
    return 1 / (1 + weight * template.depth_doubt_mm2 / variance)
