# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Few balls, as they would look elsewhere on the pad.

Networks that are told where a pixel lies learn by heart what single presses show there: a circle
that is a little off, dots that were filled in. Where many balls were pressed at one place that
averages out. So few balls are taught all over the pad: what their colours would change on the way
the model of the light (``shading``) says, and what it does not explain of them comes along.
"""

from dataclasses import replace

import numpy as np
from jaxtyping import Float32, Float64

from recon.estimators.lesson import FEW
from recon.estimators.shading import (
    Light,
    Shading,
    Taught,
    answers_at,
    tilt_terms,
    whole_colors,
)
from recon.pixels import Pixels

MOST = 3
"""How often a ball is taught elsewhere, at most."""
COVERED = 0.3
"""Share of the pad that contacts touch, from which on half of the networks are taught nothing
elsewhere: less is learnt by heart then, and the model of the light may err more."""
UNTOLD = 1.0, 2.0
"""Factors by which the part of a colour that the model of the light does not explain is multiplied
when a ball is moved, one for each half of the networks: the larger, the less of it is learnt by
heart. Where contacts touch ``COVERED`` of the pad, all moved balls have the first."""
CELLS = 32
"""Cells along each side of the pad; a contact touches one or does not."""
RIDGE = 1e-2
"""Of the mean square of a colour's answer: colours that answer alike are not told apart."""

Around = Float32[np.ndarray, "n a"]
Answers = Float64[np.ndarray, "n t k"]


def times_elsewhere(presses: int) -> int:
    """How often so many presses are taught elsewhere: they are then ``2 * FEW`` at most."""
    return max(0, min(MOST, 2 * FEW // presses - 1))


def covered_by(pixels: Pixels) -> float:
    """What share of the pad's cells holds a pixel of any contact."""
    inside = pixels.position[pixels.contact]
    cells = np.clip((inside + 1) * (CELLS / 2), 0, CELLS - 1).astype(int)
    return len(np.unique(cells @ [CELLS, 1])) / CELLS**2


def here_and_elsewhere(
    taught: Taught,
    around: Around,
    light: Light,
    shading: Shading,
    untold: Float64[np.ndarray, " times"],
    seed: int,
) -> tuple[Taught, Float32[np.ndarray, "m a"]]:
    """Pixels of dents as they are, then that many times elsewhere, and what lies around each.

    Args:
        taught: pixels of dents.
        around: what lies around them, all colours of each aspect.
        light: of the blank gel.
        shading: how its colours answer tilt.
        untold: how strongly what that does not explain of a colour comes along, each time.
        seed: draws the places.
    """
    random = np.random.default_rng([seed, 3])
    every = [(taught, around)]
    every += [elsewhere(taught, around, light, shading, some, random) for some in untold]
    joined = {
        name: np.concatenate([getattr(some, name) for some, _ in every]) for name in vars(taught)
    }
    return Taught(**joined), np.concatenate([beside for _, beside in every])


def elsewhere(
    taught: Taught,
    around: Around,
    light: Light,
    shading: Shading,
    untold: float,
    random: np.random.Generator,
) -> tuple[Taught, Around]:
    """The same dents, every pixel at a random place of its own, and what lies around it.

    Args:
        taught: pixels of dents.
        around: what lies around them, all colours of each aspect.
        light: of the blank gel.
        shading: how its colours answer tilt.
        untold: how strongly what that does not explain of a colour comes along.
        random: draws the places.
    """
    start = taught.position
    end = random.uniform(-1, 1, start.shape).astype(np.float32)
    before, after = (whole_colors(light, at) for at in (start, end))
    here, there = answers_at(shading, start), answers_at(shading, end)
    tilts = tilt_terms(taught.slopes)
    told_here, told_there = (np.einsum("nt,ntk->nk", tilts, answers) for answers in (here, there))
    on_the_way = _mixes(here, there, tilts[tilts.any(1)])
    beyond = np.einsum("nk,nkl->nl", taught.color / before - told_here, on_the_way)
    aspects = around.reshape(len(around), -1, taught.color.shape[1]) / before[:, None]
    moved = np.einsum("nak,nkl->nal", aspects, on_the_way) * after[:, None]
    color = ((told_there + untold * beyond) * after).astype(np.float32)
    around_there = moved.reshape(around.shape).astype(np.float32)
    return replace(taught, color=color, position=end), around_there


def _mixes(
    here: Answers, there: Answers, tilts: Float64[np.ndarray, "m t"]
) -> Float64[np.ndarray, "n k k"]:
    """What mix of the colours' changes here is closest to those there, of all tilts seen.

    Each pixel's by least squares over the tilts, with a ridge toward the same colours.
    """
    weighed = np.einsum("tu,nuk->ntk", tilts.T @ tilts / max(len(tilts), 1), here)
    square = np.einsum("ntk,ntl->nkl", weighed, here)
    product = np.einsum("ntk,ntl->nkl", weighed, there)
    count = here.shape[2]
    mean = np.trace(square, axis1=1, axis2=2)[:, None, None] / count
    ridge = (RIDGE * mean + 1e-12) * np.eye(count)
    return np.linalg.solve(square + ridge, product + ridge)
