# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""What stands under a dot as the least energy of a membrane or of plates around it.

A membrane (``harmonic``) or a thin plate (``biharmonic``) is held with springs by the pixels around
a dot: noise there is averaged, not copied. ``surface`` fills both slopes at once, as two plates
that must be the slopes of one surface: the curl of a gradient is zero, so what is known of one
slope says how the other goes on. What such an energy puts under a dot is a fixed matrix times the
values around it: made once for a shape of dot that comes often, and kept while dots stand still.
Before, and where dots move, the shape's equations are solved, a band.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property, lru_cache

import cv2
import numpy as np
from jaxtyping import Float, Float32, Float64, Int64
from scipy import ndimage
from scipy.linalg import cholesky_banded
from scipy.linalg.lapack import dpbtrs
from scipy.spatial import KDTree

from recon.arrays import ContactMask

Field = Float[np.ndarray, "h w c"]
RING_PX: Mapping[str, int] = {"harmonic": 1, "biharmonic": 3, "surface": 2}
"""How far around a dot pixels are listened to."""
STIFFNESS: Mapping[str, float] = {"harmonic": 0.05, "biharmonic": 0.3, "surface": 0.1}
"""Of the membrane or plate against the springs: what noise is averaged over."""
CURL_STIFFNESS = 10.0
"""How firmly the two plates of ``surface`` are held to be slopes of one."""
WIDEST_GROUP = 1.5
"""Dots whose matrices differ in size by less than this factor are filled in one product."""
LARGEST_PX = 500
TILE_PX = 16
"""Hidden pixels that hang together are cut into tiles of this side where they are more."""
EVERY_SIDE = np.ones((3, 3), np.uint8)

FEW = 0.3
"""Share of dots up to which those alone are filled around which not all is zero, as it is around
most dots of slopes: more are quicker in one product."""
OFTEN = 3
"""Fillings of one shape of dot after which its matrix is made, which costs as much as some."""

Block = tuple[Int64[np.ndarray, "k n"], Int64[np.ndarray, "k m"], Float32[np.ndarray, "k n m"]]
"""Of k dots: places to fill, places listened to, both padded with the dot's own; the matrices."""
Made = tuple[list["_Dot"], list[Block], list[Block]]
"""The dots that are solved, and the matrices of the others, for fields and for planes."""

Planes = Float[np.ndarray, "c h w"]


class ElasticFill:
    """Fills what one arrangement of dots hides."""

    def __init__(
        self, hidden: ContactMask, method: str, aspect: float, *, repeatable: bool = False
    ) -> None:
        """Find the dots.

        Args:
            hidden: (h, w), true under dots; some pixel is not.
            method: a key of ``RING_PX``.
            aspect: of a pixel's height to its width; only ``surface`` asks.
            repeatable: round alike whatever was filled before, which takes longer.
        """
        self._together, self._size = 2 if method == "surface" else 1, hidden.size
        self._repeatable = repeatable
        self._dots = _placed_dots(hidden, method, aspect, self._together)
        self._made: Made = self._dots, [], []
        far = hidden.copy()
        for dot in self._dots:
            far.flat[dot.places // self._together] = False
        # In the midst of a wide hidden area nothing is known within the ring.
        self._far = nearest_known(far, beside(hidden)) if far.any() else None

    def __call__(self, field: Field) -> Field:
        """A new field with hidden pixels filled; two slopes, or any values but for ``surface``."""
        filled = np.array(field, order="C")
        single, blocks, _ = self._prepared()
        if self._far is not None:
            places, sources = self._far
            pixels = filled.reshape(self._size, -1)
            pixels[places] = pixels[sources]
        values = filled.reshape(self._size * self._together, -1)
        for block in blocks:
            _multiply(values, block)
        for dot in single:
            values[dot.places] = dot.shape.solve(values[dot.sources])
        return filled

    def in_place(self, planes: Planes) -> None:
        """Fill the hidden pixels of planes that lie one behind the other."""
        assert planes.flags.c_contiguous
        single, _, blocks = self._prepared()
        pixels = planes.reshape(len(planes), -1)
        if self._far is not None:
            places, sources = self._far
            pixels[:, places] = pixels[:, sources]
        values = pixels.T if self._together == 1 else pixels.reshape(-1, 1)
        for block in blocks:
            _multiply(values, block)
        for dot in single:
            known = values[self._in_planes(dot.sources)]
            values[self._in_planes(dot.places)] = dot.shape.solve(known)

    def _prepared(self) -> Made:
        """With the matrices of the shapes that have come often by now.

        They change places with the dots at once: another thread may be filling.
        """
        if self._repeatable or all(dot.shape.solved < OFTEN for dot in self._made[0]):
            return self._made
        single = [dot for dot in self._dots if dot.shape.solved < OFTEN]
        blocks = _blocks([dot for dot in self._dots if dot.shape.solved >= OFTEN])
        in_planes = [
            (self._in_planes(places), self._in_planes(sources), weights)
            for places, sources, weights in blocks
        ]
        self._made = made = single, blocks, in_planes
        return made

    def _in_planes(self, values: Int64[np.ndarray, "*n"]) -> Int64[np.ndarray, "*n"]:
        """Where values that lie beside each other in pixels lie in planes."""
        return values % self._together * self._size + values // self._together


def _multiply(values: Float[np.ndarray, "_ _"], block: Block) -> None:
    """Fill dots by their matrices."""
    places, sources, weights = block
    known = values[sources]
    some = known.any((1, 2))
    if some.mean() > FEW:
        values[places] = weights @ known
    else:
        values[places] = 0
        for one in np.flatnonzero(some):  # no matrix is copied
            values[places[one]] = weights[one] @ known[one]


def beside(hidden: ContactMask) -> ContactMask:
    """The pixels around dots."""
    return np.asarray(cv2.dilate(hidden.view(np.uint8), EVERY_SIDE).view(bool) & ~hidden)


def nearest_known(
    hidden: ContactMask, around: ContactMask
) -> tuple[Int64[np.ndarray, " n"], Int64[np.ndarray, " n"]]:
    """Places of hidden pixels, and of those nearest to them of the pixels around dots."""
    _, chosen = KDTree(np.argwhere(around)).query(np.argwhere(hidden))
    return np.flatnonzero(hidden), np.flatnonzero(around)[chosen]


@dataclass(frozen=True, kw_only=True)
class _Dot:
    """A shape at its place."""

    places: Int64[np.ndarray, " n"]
    sources: Int64[np.ndarray, " m"]
    """What is filled and what is listened to, where the values of a pixel lie side by side."""
    shape: "_Shape"


def _placed_dots(hidden: ContactMask, method: str, aspect: float, together: int) -> list[_Dot]:
    """Every dot with something known around it; ``together`` values a pixel."""
    ring_px, width = RING_PX[method], hidden.shape[1]
    dots, covered = _parts(hidden), hidden.view(np.uint8)
    found: list[_Dot] = []
    for number, place in enumerate(ndimage.find_objects(dots), start=1):
        if place is None:
            continue
        top, left = (max(side.start - ring_px, 0) for side in place)
        window = np.s_[top : place[0].stop + ring_px, left : place[1].stop + ring_px]
        seen = covered[window] + (dots[window] == number)
        dot = _dot_in(seen.tobytes(), seen.shape, width, method, aspect)
        if dot is not None:
            corner = together * (top * width + left)
            moved = dot.places + corner, dot.sources + corner
            found.append(_Dot(places=moved[0], sources=moved[1], shape=dot.shape))
    return found


@lru_cache(maxsize=1024)
def _dot_in(
    seen: bytes, shape: tuple[int, int], width: int, method: str, aspect: float
) -> _Dot | None:
    """The dot in the upper left of a frame of that width, unless nothing is known around it.

    Args:
        seen: 2 under the dot, 1 under others, else 0.
        shape: of what is seen.
        width: of the frame.
        method: a key of ``RING_PX``.
        aspect: of a pixel's height to its width.
    """
    window, side = np.frombuffer(seen, np.uint8).reshape(shape), 2 * RING_PX[method] + 1
    dot = window == 2
    known = cv2.dilate(dot.view(np.uint8), np.ones((side, side), np.uint8)).view(bool)
    known &= window == 0
    if not known.any():
        return None
    together = 2 if method == "surface" else 1
    places, sources = (
        _each(rows * width + columns, together) for rows, columns in map(np.nonzero, (dot, known))
    )
    return _Dot(
        places=places,
        sources=sources,
        shape=_shape(dot.tobytes(), known.tobytes(), shape, method, aspect),
    )


def _each(pixels: Int64[np.ndarray, " n"], together: int) -> Int64[np.ndarray, " m"]:
    """The ``together`` values of each pixel, one after the other."""
    return (together * pixels[:, None] + np.arange(together)).ravel()


def _blocks(dots: list[_Dot]) -> list[Block]:
    """The matrices of dots, in groups of like size."""
    groups: list[list[_Dot]] = []
    for dot in sorted(dots, key=lambda dot: dot.shape.weights.size):
        if groups and dot.shape.weights.size <= WIDEST_GROUP * groups[-1][0].shape.weights.size:
            groups[-1].append(dot)
        else:
            groups.append([dot])
    return [_block(group) for group in groups]


def _parts(hidden: ContactMask) -> Int64[np.ndarray, "h w"]:
    """Every dot under its number; many dots that touch, as along an edge, in tiles."""
    dots, count = ndimage.label(hidden, EVERY_SIDE)
    sizes = np.bincount(dots.ravel())
    sizes[0] = 0
    if sizes.max() <= LARGEST_PX:
        return dots.astype(np.int64)
    rows, columns = np.indices(hidden.shape) // TILE_PX
    tile = rows * (columns.max() + 1) + columns
    large = (sizes > LARGEST_PX)[dots]
    return np.where(large, count + 1 + tile, dots).astype(np.int64)


def _block(group: list[_Dot]) -> Block:
    """Dots of like size, padded to the largest: what is filled twice is filled alike."""
    rows = max(len(dot.places) for dot in group)
    columns = max(len(dot.sources) for dot in group)
    weights = np.zeros((len(group), rows, columns), np.float32)
    for one, dot in zip(weights, group, strict=True):
        one[: len(dot.places), : len(dot.sources)] = dot.shape.weights
        one[len(dot.places) :] = one[len(dot.places) - 1]
    places = np.stack([_padded(dot.places, rows) for dot in group])
    return places, np.stack([_padded(dot.sources, columns) for dot in group]), weights


def _padded(values: Int64[np.ndarray, " n"], count: int) -> Int64[np.ndarray, " count"]:
    """As many, the last one again and again."""
    return np.pad(values, (0, count - len(values)), mode="edge")


class _Shape:
    """A dot and its surroundings, wherever they are: the factors of its energy."""

    def __init__(
        self, factors: Float64[np.ndarray, "b n"], filled: np.ndarray, listened: np.ndarray
    ) -> None:
        self._factors, self._filled, self._listened = factors, filled, listened
        self.solved = 0
        """How often; a benign race where two threads fill."""

    def solve(self, known: Float[np.ndarray, "m c"]) -> Float64[np.ndarray, "n c"]:
        """What stands under the dot, from what stands around it."""
        self.solved += 1
        pull = np.zeros((self._factors.shape[1], known.shape[1]))
        pull[self._listened] = known
        return self._solution(pull)[self._filled]

    @cached_property
    def weights(self) -> Float32[np.ndarray, "n m"]:
        """What each value around a dot adds to each value under it."""
        # The energy is symmetric, so a row of its inverse is a column.
        rows = self._solution(np.eye(self._factors.shape[1])[:, self._filled]).T
        return rows[:, self._listened].astype(np.float32)

    def _solution(self, pull: Float64[np.ndarray, "n k"]) -> Float64[np.ndarray, "n k"]:
        # LAPACK itself: scipy's cho_solve_banded takes three times as long to call it.
        return np.asarray(dpbtrs(self._factors, pull, lower=1)[0])


Terms = tuple[np.ndarray, float, np.ndarray]
"""Places (t, s), a factor and weights (s): of an energy ``factor * (weights @ u[places])^2``."""


@lru_cache(maxsize=1024)
def _shape(dot: bytes, known: bytes, shape: tuple[int, int], method: str, aspect: float) -> _Shape:
    """The energy of a dot, in factors.

    It is ``sum over known (u - g)^2 + stiffness * sum (differences of u)^2`` over the dot
    and the pixels around it: first differences for a membrane; second differences, the mixed one
    twice, for a plate. ``surface`` has two such u, and adds ``stiffness * sum (du_y/dx -
    du_x/dy)^2``. Where the frame's edge or another dot cuts the surroundings, the energy has fewer
    terms: a natural border. Pixels are numbered row by row and a term spans three rows at most,
    so the matrix is a band.
    """
    hidden, held = (np.frombuffer(mask, bool).reshape(shape) for mask in (dot, known))
    together = 2 if method == "surface" else 1
    number = np.full(shape, -1)
    number[hidden | held] = np.arange(np.count_nonzero(hidden | held))
    terms: list[Terms] = [
        (together * places + part, STIFFNESS[method], weights)
        for places, weights in (_terms(number, stencil) for stencil in STENCILS[method])
        for part in range(together)
    ]
    if method == "surface":
        along_x, weights_x = _terms(number, ALONG_X)
        along_y, weights_y = _terms(number, ALONG_Y)
        weights = np.concatenate([-weights_y / aspect, weights_x])
        both = np.concatenate([together * along_y, together * along_x + 1], 1)
        terms.append((both, CURL_STIFFNESS, weights))
    filled, listened = (_each(number[mask], together) for mask in (hidden, held))
    energy = _band(terms, together * (int(number.max()) + 1))
    energy[0, listened] += 1
    energy[0] += 1e-9
    factors = cholesky_banded(energy, overwrite_ab=True, lower=True, check_finite=False)
    return _Shape(factors, filled, listened)


def _band(terms: list[Terms], size: int) -> Float64[np.ndarray, "b n"]:
    """The sum of all terms as LAPACK's lower band of a symmetric matrix."""
    rows, columns, values = [], [], []
    for places, factor, weights in terms:
        term, first, second = np.nonzero(places[:, :, None] >= places[:, None, :])
        rows.append(places[term, first])
        columns.append(places[term, second])
        values.append((factor * np.outer(weights, weights))[first, second])
    column = np.concatenate(columns)
    below = np.concatenate(rows) - column
    height = int(below.max(initial=0)) + 1
    sums = np.bincount(below * size + column, np.concatenate(values), height * size)
    return sums.reshape(height, size)


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
