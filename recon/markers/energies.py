# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""The energy of a membrane or of plates in and around one dot, and what they are at its least.

Each is a small system of equations, a band, factored once for all dots of a shape.
"""

from collections.abc import Mapping
from functools import cached_property

import numpy as np
from jaxtyping import Bool, Float, Float32, Float64, Int64
from scipy.linalg import cholesky_banded
from scipy.linalg.lapack import dpbtrs, spbtrs

STIFFNESS: Mapping[str, float] = {"harmonic": 0.05, "biharmonic": 0.3, "surface": 0.1}
"""Of the membrane or plate against the springs: what noise is averaged over."""
CURL_STIFFNESS = 10.0
"""How firmly the two plates of ``surface`` are held to be slopes of one."""
FIRM = 0.1
"""Dots held so firmly are solved for in single precision, to 1e-5 of what stands around them: the
least diagonal element of their factors. Those with hardly anything around them are not."""
MANY = 16
"""So many dots of one shape are filled in one product, with a matrix that takes as long to make as
some fillings."""


class Shape:
    """A dot and its surroundings, wherever they are."""

    def __init__(
        self,
        hidden: Bool[np.ndarray, "h w"],
        held: Bool[np.ndarray, "h w"],
        method: str,
        aspect: float,
    ) -> None:
        """Of the pixels under a dot, and those that are listened to."""
        self.filled_px, self.listened_px = map(int, map(np.count_nonzero, (hidden, held)))
        self._together, self._method, self._aspect = _together(method), method, aspect
        self._number = np.full(hidden.shape, -1)
        some = hidden | held
        self._number[some] = np.arange(np.count_nonzero(some))
        self._filled, self._listened = (
            _each(self._number[mask], self._together) for mask in (hidden, held)
        )

    def solve(self, known: Float[np.ndarray, "k m c"]) -> Float[np.ndarray, "k n c"]:
        """What stands under k such dots, from what stands around each."""
        count, _, channels = known.shape
        columns = count * channels // self._together
        apart = known.reshape(count, len(self._listened), -1).swapaxes(0, 1).reshape(-1, columns)
        found = self._solution(apart) if count < MANY else self.weights @ apart
        solved = found.reshape(-1, count, columns // count)
        return solved.swapaxes(0, 1).reshape(count, -1, channels)

    @cached_property
    def weights(self) -> Float32[np.ndarray, "n m"]:
        """What each value around a dot adds to each value under it."""
        return self._solution(np.eye(len(self._listened))).astype(np.float32)

    def _solution(self, known: Float[np.ndarray, "m k"]) -> Float[np.ndarray, "n k"]:
        """In the dot, for k columns of values around it."""
        factors = self._factors
        pull = np.zeros((factors.shape[1], known.shape[1]), factors.dtype, order="F")
        pull[self._listened] = known
        # LAPACK itself: scipy's cho_solve_banded takes three times as long to call it.
        solve = spbtrs if factors.dtype == np.float32 else dpbtrs
        solved, _ = solve(factors, pull, lower=1, overwrite_b=1)
        return np.asarray(solved[self._filled])

    @cached_property
    def _factors(self) -> Float[np.ndarray, "b n"]:
        """Those of its energy.

        It is ``sum over known (u - g)^2 + stiffness * sum (differences of u)^2`` over the dot
        and the pixels around it: first differences for a membrane; second differences, the mixed
        one twice, for a plate. ``surface`` has two such u, and adds ``stiffness * sum (du_y/dx -
        du_x/dy)^2``. Where the frame's edge or another dot cuts the surroundings, the energy has
        fewer terms: a natural border. Pixels are numbered row by row and a term spans three rows
        at most, so the matrix is a band.
        """
        method, together, number = self._method, self._together, self._number
        terms: list[Terms] = [
            (together * places + part, STIFFNESS[method], weights)
            for places, weights in (_terms(number, stencil) for stencil in STENCILS[method])
            for part in range(together)
        ]
        if method == "surface":
            along_x, weights_x = _terms(number, ALONG_X)
            along_y, weights_y = _terms(number, ALONG_Y)
            weights = np.concatenate([-weights_y / self._aspect, weights_x])
            both = np.concatenate([together * along_y, together * along_x + 1], 1)
            terms.append((both, CURL_STIFFNESS, weights))
        energy = _band(terms, together * (int(number.max()) + 1))
        energy[0, self._listened] += 1
        energy[0] += 1e-9
        factors = cholesky_banded(energy, overwrite_ab=True, lower=True, check_finite=False)
        return np.asarray(factors, np.float32 if factors[0].min() > FIRM else np.float64)


def _together(method: str) -> int:
    """Values of a pixel that are solved for together."""
    return 2 if method == "surface" else 1


def _each(pixels: Int64[np.ndarray, " n"], together: int) -> Int64[np.ndarray, " m"]:
    """The ``together`` values of each pixel, one after the other."""
    return (together * pixels[:, None] + np.arange(together)).ravel()


Terms = tuple[np.ndarray, float, np.ndarray]
"""Places (t, s), a factor and weights (s): of an energy ``factor * (weights @ u[places])^2``."""


def _band(terms: list[Terms], size: int) -> Float64[np.ndarray, "b n"]:
    """The sum of all terms as LAPACK's lower band of a symmetric matrix."""
    columns, below, values = [], [], []
    for places, factor, weights in terms:
        # Which of a term's places come after which is the same wherever it is.
        first, second = np.nonzero((places[:1, :, None] >= places[:1, None, :]).all(0))
        columns.append(places[:, second].ravel())
        below.append(places[:, first].ravel() - columns[-1])
        values.append(np.tile(factor * weights[first] * weights[second], len(places)))
    column, row = np.concatenate(columns), np.concatenate(below)
    height = int(row.max(initial=0)) + 1
    sums = np.bincount(column * height + row, np.concatenate(values), size * height)
    return sums.reshape(size, height).T  # as LAPACK has its arrays


Stencil = tuple[tuple[int, int, float], ...]
PLATE: tuple[Stencil, ...] = (
    ((0, 0, 1.0), (0, 1, -2.0), (0, 2, 1.0)),
    ((0, 0, 1.0), (1, 0, -2.0), (2, 0, 1.0)),
    ((0, 0, 2**0.5), (0, 1, -(2**0.5)), (1, 0, -(2**0.5)), (1, 1, 2**0.5)),
)
STENCILS: Mapping[str, tuple[Stencil, ...]] = {
    "harmonic": (((0, 0, 1.0), (0, 1, -1.0)), ((0, 0, 1.0), (1, 0, -1.0))),
    "biharmonic": PLATE,
    "surface": PLATE,
}
"""Differences as (row, column, weight)."""
ALONG_X: Stencil = ((0, 0, -0.5), (0, 1, 0.5), (1, 0, -0.5), (1, 1, 0.5))
ALONG_Y: Stencil = ((0, 0, -0.5), (0, 1, -0.5), (1, 0, 0.5), (1, 1, 0.5))
"""Slopes between four pixels."""


def _terms(
    number: Int64[np.ndarray, "h w"], stencil: Stencil
) -> tuple[Int64[np.ndarray, "t s"], Float64[np.ndarray, " s"]]:
    """The numbers at every place where the whole stencil is on numbered pixels; its weights."""
    height, width = number.shape
    padded = np.full((height + 2, width + 2), -1)
    padded[:height, :width] = number
    places = np.stack(
        [padded[row : row + height, column : column + width] for row, column, _ in stencil], -1
    )
    return places[(places >= 0).all(-1)], np.array([weight for *_, weight in stencil])
