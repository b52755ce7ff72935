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

import math
from dataclasses import dataclass
from functools import partial
from typing import ClassVar

import numpy as np

from recon.pose.cells import LENGTHS_MM, Variances, noise_between
from recon.pose.equations import ROWS, Equations, equations_of, linearized, undoubted
from recon.pose.level import Level
from recon.pose.pyramid import Pyramid
from recon.pose.registration import PRIOR, Alignment, Touch
from recon.pose.rigid import Transform, Twist, motion, skew
from recon.pose.rim import rim
from recon.pose.template import STENCIL, residuals

STEPS_PER_LEVEL = 8
STILL = 1e-4
"""A step of so many radians, and ten times as many mm, ends the finest level."""
ALMOST_STILL = 30 * STILL
"""The same of the levels before, which only serve as its guess."""
SHOWN_PX, SHOWN_SLOPE, LARGEST_SHOWN = 1.5, 0.1, 4.0
"""It moves pixels so far in the mean, unless slopes change by more, or it were far from likely."""
AHEAD, BACK = [9, 2, 4], [6, 8, 1]
"""Of three rows of a small motion, where it shows the turn about x, y and z, and its negative."""
WHITE_LEFT = (0.25, 0.075, 0.015)
"""By level: of white noise's variance, what reading and halving leave."""


@dataclass(frozen=True, kw_only=True)
class Joint:
    """Slopes and depth together."""

    prepares: ClassVar[type] = Pyramid

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
                equations = linearized(template, level, guess)
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


def _shown(equations: Equations, level: Level, guess: Transform, twist: Twist) -> float:
    """How much of what the derivatives say of a motion is seen when it is made there and back.

    The correlation of both, weighted as in the equations. Of a round thing that spins, too, the
    derivatives say something, by how edges lie between the pixels: farther on they lie otherwise.
    """
    template = equations.template.few
    weight = equations.weight[ROWS, :: equations.template.every]
    moved = skew(twist[:3])[:2] @ template.points.T + twist[3:5, None]
    told = (twist.astype(np.float32) @ template.change.reshape(6, -1)).reshape(3, -1)
    far_mm, steep = np.array([np.linalg.norm(moved), np.linalg.norm(told[:2])]) / np.sqrt(
        len(template.points)
    )
    pitch_mm = math.sqrt(level.pitch_mm[0] * level.pitch_mm[1])
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
    length_px = np.array(LENGTHS_MM[1:]) / math.sqrt(level.pitch_mm[0] * level.pitch_mm[1])
    steepness = np.minimum(1 / (2 * length_px**2) / (STENCIL**2).sum(), 1)
    white = noise[0] * WHITE_LEFT[level.halvings]
    return float((white + noise[1:] @ steepness) / (white + noise[1:].sum()))


def _with_rim(
    found: Equations, reference: Pyramid, current: Pyramid, guess: Transform
) -> Equations:
    """The equations at the guess they led to, with heights of the rim beside its depths."""
    equations = linearized(found.template, current.level(0), guess) or found
    edge = rim(reference, current, equations.weight[0] > 0, guess)
    if edge is None:
        return equations
    variance = equations.variance
    weight, residual = equations.weight.copy(), equations.residual.copy()
    rim_weight = edge.weight * edge.believed(variance, equations.covariance())
    # What is doubted of all heights together is doubted of the rim's as well.
    whole = float(weight[1].sum()) / equations.depth_share + rim_weight * len(edge.residual)
    share = undoubted(found.template, variance, whole)
    weight[1] *= share / equations.depth_share
    depth, added = weight[1, edge.pixels], share * rim_weight
    pull = depth * residual[2, edge.pixels] + added * edge.residual
    weight[1, edge.pixels] = depth + added
    residual[2, edge.pixels] = pull / (depth + added)
    return equations_of(found.template, weight, residual, equations.noise, variance, share)


def _small_twist(start: Transform, end: Transform) -> Twist:
    """The twist between two transforms that differ little, to first order."""
    between = start[:3, :3].T @ (end - start)[:3]  # of the rotations, less the identity
    turn = (between.take(AHEAD) - between.take(BACK)) / 2
    return np.concatenate([turn, between[:, 3]])
