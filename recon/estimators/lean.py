# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""How far a domed gel leans against the slopes that its balls' caps have.

A label says the ball's own slope. The dent's slope, which integrates to its depth, is that plus the
lean of the untouched gel; on a flat gel they are the same. Colour says the dent's: where it did not
change, the gel did not tilt. So the slopes that balls are labelled with differ from a function of
colour and place, zero where the colour is, by a lean that grows along each axis. Function and lean
are fitted at once, by least squares.
"""

from itertools import combinations_with_replacement

import numpy as np
from jaxtyping import Bool, Float32, Float64

from recon.pixels import Pixels

GENTLE = 0.8
"""Slopes below are looked at: their colours are close to a cubic polynomial."""
LOOKED_AT = 15_000
FOLDS = 4
"""Parts of the presses, each of which is left out once to learn how certain a lean is."""
FEWEST_PRESSES = 8

BESIDE = 5
"""Columns of the equations beside those of shading: 1, x, y, and the slopes along x and y."""

Lean = Float32[np.ndarray, "2 2"]
"""For x and for y: the lean in the frame's middle, and how much more it is at the frame's edge."""

FLAT = np.zeros((2, 2), np.float32)


def lean_at(lean: Lean, position: Float32[np.ndarray, "*n 2"]) -> Float32[np.ndarray, "*n 2"]:
    """Slope to add to a ball's, mm/mm, at some positions (-1 to 1)."""
    return np.asarray(lean[:, 0] + lean[:, 1] * position, np.float32)


def fit_lean(pixels: Pixels, columns: list[int], axes: list[int]) -> Lean:
    """The lean that presses agree on; what they do not agree on is taken as flat.

    So is the lean along other axes than those that the colours show. The frame's middle is taken as
    level where there are no more colours than axes: that a dent keeps light away, as it does, is
    then not to be told from a slope.

    Args:
        pixels: labelled, of several presses.
        columns: of the colours that are looked at.
        axes: whose slopes they show, of 0 and 1.
    """
    gentle = np.linalg.norm(pixels.gradient, axis=1) < GENTLE
    chosen = pixels[pixels.contact & gentle]
    presses = np.unique(chosen.press)
    if len(presses) < FEWEST_PRESSES:
        return FLAT
    if len(chosen) > LOOKED_AT:
        random = np.random.default_rng(0)
        chosen = chosen[np.sort(random.choice(len(chosen), LOOKED_AT, replace=False))]
    equations = _equations(chosen, columns)
    fold = np.searchsorted(presses, chosen.press) % FOLDS
    free = np.zeros((2, 2), bool)
    free[axes] = [len(columns) > len(axes), True]
    # What is fitted to a part of the presses is fitted to the triangle of its equations as well.
    triangles = [np.linalg.qr(equations[fold == k], mode="r") for k in range(FOLDS)]
    least = len(chosen) * np.finfo(np.float64).eps
    whole = _fitted(np.concatenate(triangles), free, least)
    parts = np.stack(
        [
            _fitted(np.concatenate(triangles[:k] + triangles[k + 1 :]), free, least)
            for k in range(FOLDS)
        ]
    )
    variance = (FOLDS - 1) * parts.var(0)  # the jackknife's
    certain = np.maximum(0, 1 - variance / np.maximum(whole**2, 1e-12))
    return np.asarray(whole * certain, np.float32)


def _equations(pixels: Pixels, columns: list[int]) -> Float64[np.ndarray, "n t"]:
    """Of each pixel all that a slope may depend on, then the labelled slopes along x and y.

    That is products of one to three colours with a quadratic polynomial of the place, 1, x and y.
    """
    color = pixels.color[:, columns].astype(np.float64)
    color /= np.maximum(color.std(0), 1e-6)
    shades = [
        color[:, list(chosen)].prod(1)
        for count in (1, 2, 3)
        for chosen in combinations_with_replacement(range(len(columns)), count)
    ]
    x, y = pixels.position.T.astype(np.float64)
    places = [x**i * y**j for i in range(3) for j in range(3 - i)]
    own = [np.ones_like(x), x, y, *pixels.gradient.T]
    return np.stack([*(shade * place for shade in shades for place in places), *own], 1)


def _fitted(
    equations: Float64[np.ndarray, "n t"], free: Bool[np.ndarray, "2 2"], least: float
) -> Float64[np.ndarray, "2 2"]:
    """The lean by least squares; what is not ``free`` is zero.

    Args:
        equations: of ``_equations``, or the triangles of their parts.
        free: for x and for y, whether its lean in the middle is, and whether its growth is.
        least: singular values below that share of the largest are none.
    """
    terms, lean = equations.shape[1] - BESIDE, np.zeros((2, 2))
    for axis in np.flatnonzero(free.any(1)):
        own = np.array([terms, terms + 1 + axis])[free[axis]]
        known = equations[:, [*range(terms), *own]]
        found = np.linalg.lstsq(known, equations[:, terms + 3 + axis], rcond=least)[0]
        lean[axis, free[axis]] = -found[terms:]
    return lean
