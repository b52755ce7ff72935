# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Values under the dots, from those around them: one name, seven methods.

``zero``, ``nearest``, ``linear`` and ``cubic`` are what the paper compares ("Markers"):
``scipy.interpolate.griddata`` from the pixels around the dots. ``harmonic`` and ``biharmonic``
solve for a membrane and for a thin plate that the pixels around a dot hold with springs: noise
there is averaged, not copied. ``surface`` fills both slopes at once, as two plates that must be
the slopes of one surface: the curl of a gradient is zero, so what is known of one slope says how
the other goes on. Each of the three is the minimum of a quadratic energy, so what it puts under a
dot is a fixed matrix times the values around it: made once for a shape of dot that comes often, and
kept while dots stand still. Before, and where dots move, the shape's equations are solved, a band.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np
from jaxtyping import Float, Float32, Float64, Int64
from scipy import ndimage
from scipy.interpolate import griddata
from scipy.linalg import cho_solve_banded, cholesky_banded
from scipy.spatial import KDTree

from recon.arrays import ContactMask
from sensor.errors import WedgeError
from sensor.toml import Pair

METHODS = ("zero", "nearest", "linear", "cubic", "harmonic", "biharmonic", "surface")
Field = Float[np.ndarray, "h w c"]
Fill = Callable[[Field], Field]
"""Takes a field with anything in the hidden pixels and returns it with them filled."""

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
EVERY_SIDE = np.ones((3, 3), bool)

FEW = 0.3
"""Share of dots up to which those alone are filled around which not all is zero, as it is around
most dots of slopes: more are quicker in one product."""
OFTEN = 3
"""Fillings of one shape of dot after which its matrix is made, which costs as much as some."""

Block = tuple[Int64[np.ndarray, "k n"], Int64[np.ndarray, "k m"], Float32[np.ndarray, "k n m"]]
"""Of k dots: places to fill, places listened to (both padded), and the matrices between them."""


def fill_gradients(
    gradient: Field,
    hidden: ContactMask,
    method: str = "surface",
    mm_per_px: Pair = (1.0, 1.0),
    *,
    repeatable: bool = False,
) -> Field:
    """A field with its hidden pixels filled from around them.

    Args:
        gradient: (h, w, 2), or (h, w, c) for every method but ``surface``; what stands in hidden
            pixels is ignored.
        hidden: (h, w), true under dots.
        method: one of ``METHODS``.
        mm_per_px: pixel pitch along x and y; only their ratio matters, and only to ``surface``.
        repeatable: round alike whatever was filled before, which takes longer: no matrix is made.

    Returns:
        A new field of the same dtype; pixels that are not hidden are untouched.

    Raises:
        WedgeError: no method has that name.
    """
    aspect = mm_per_px[1] / mm_per_px[0]
    return _prepared(hidden.tobytes(), hidden.shape, method, aspect, repeatable)(gradient)


def prepare_fill(
    hidden: ContactMask,
    method: str = "surface",
    mm_per_px: Pair = (1.0, 1.0),
    *,
    repeatable: bool = False,
) -> Fill:
    """All that depends only on where the dots are, done once; arguments as above.

    Raises:
        WedgeError: no method has that name.
    """
    if method not in METHODS:
        raise WedgeError(f"no way of filling is called {method!r}: known are {', '.join(METHODS)}.")
    around = ndimage.binary_dilation(hidden, EVERY_SIDE) & ~hidden
    if method == "zero" or not around.any():
        return lambda field: np.where(hidden[..., None], field.dtype.type(0), field)
    if method == "nearest":
        return _nearest(hidden, around)
    if method in ("linear", "cubic"):
        return _interpolated(hidden, around, method)
    return _elastic(hidden, method, mm_per_px[1] / mm_per_px[0], repeatable)


@lru_cache(maxsize=4)
def _prepared(
    hidden: bytes, shape: tuple[int, int], method: str, aspect: float, repeatable: bool
) -> Fill:
    mask = np.frombuffer(hidden, bool).reshape(shape)
    return prepare_fill(mask, method, (1.0, aspect), repeatable=repeatable)


def _nearest(hidden: ContactMask, around: ContactMask) -> Fill:
    known = np.flatnonzero(around)
    _, chosen = KDTree(np.argwhere(around)).query(np.argwhere(hidden))
    places, sources = np.flatnonzero(hidden), known[chosen]

    def fill(field: Field) -> Field:
        filled = field.copy()
        flat = filled.reshape(-1, field.shape[-1])
        flat[places] = flat[sources]
        return filled

    return fill


def _interpolated(hidden: ContactMask, around: ContactMask, method: str) -> Fill:
    """As in the paper: ``griddata`` from the pixels around the dots, anew for each field."""
    known, places = np.argwhere(around), np.argwhere(hidden)
    nearest = _nearest(hidden, around)

    def fill(field: Field) -> Field:
        filled = nearest(field)  # for what lies outside of all triangles, at the frame's edge
        found = griddata(known, field[around], places, method=method)
        filled[hidden] = np.where(np.isfinite(found), found, filled[hidden])
        return filled

    return fill


def _elastic(hidden: ContactMask, method: str, aspect: float, repeatable: bool) -> Fill:
    together = 2 if method == "surface" else 1
    dots = _placed_dots(hidden, method, aspect, together)
    reached = np.zeros(together * hidden.size, bool)
    for dot in dots:
        reached[dot.places] = True
    # In the midst of a wide hidden area nothing is known within the ring.
    far = hidden & ~reached.reshape(*hidden.shape, together)[..., 0]
    around = ndimage.binary_dilation(hidden, EVERY_SIDE) & ~hidden
    rough = _nearest(far, around) if far.any() else None
    blocks: list[Block] = []
    single = dots

    def fill(field: Field) -> Field:
        nonlocal blocks, single
        if not repeatable and any(dot.shape.solved >= OFTEN for dot in single):
            single = [dot for dot in dots if dot.shape.solved < OFTEN]
            blocks = _blocks([dot for dot in dots if dot.shape.solved >= OFTEN], reached.size)
        values = (field if rough is None else rough(field)).reshape(hidden.size * together, -1)
        # Padding reads and writes one row beyond the field.
        flat = np.empty((len(values) + 1, values.shape[1]), field.dtype)
        flat[:-1] = values
        flat[-1] = 0
        for places, sources, weights in blocks:
            known = flat[sources]
            some = known.any((1, 2))
            if some.mean() > FEW:
                flat[places] = weights @ known
            else:
                flat[places] = 0
                for one in np.flatnonzero(some):  # no matrix is copied
                    flat[places[one]] = weights[one] @ known[one]
        for dot in single:
            flat[dot.places] = dot.shape.solve(flat[dot.sources])
        return flat[:-1].reshape(field.shape)

    return fill


@dataclass(frozen=True, kw_only=True)
class _Dot:
    """A shape at its place."""

    places: Int64[np.ndarray, " n"]
    sources: Int64[np.ndarray, " m"]
    """What is filled and what is listened to, as rows of the field."""
    shape: "_Shape"


def _placed_dots(hidden: ContactMask, method: str, aspect: float, together: int) -> list[_Dot]:
    """Every dot with something known around it; ``together`` values a pixel."""
    ring_px = RING_PX[method]
    width = hidden.shape[1]
    dots = _parts(hidden)
    found: list[_Dot] = []
    for number, place in enumerate(ndimage.find_objects(dots), start=1):
        if place is None:
            continue
        top, left = (max(side.start - ring_px, 0) for side in place)
        window = np.s_[top : place[0].stop + ring_px, left : place[1].stop + ring_px]
        dot = dots[window] == number
        known = ndimage.binary_dilation(dot, EVERY_SIDE, iterations=ring_px) & ~hidden[window]
        if not known.any():
            continue
        places, sources = (
            _each((rows + top) * width + columns + left, together)
            for rows, columns in map(np.nonzero, (dot, known))
        )
        shape = _shape(dot.tobytes(), known.tobytes(), dot.shape, method, aspect)
        found.append(_Dot(places=places, sources=sources, shape=shape))
    return found


def _each(pixels: Int64[np.ndarray, " n"], together: int) -> Int64[np.ndarray, " m"]:
    """The ``together`` values of each pixel, one after the other."""
    return (together * pixels[:, None] + np.arange(together)).ravel()


def _blocks(dots: list[_Dot], beyond: int) -> list[Block]:
    """The matrices of dots, in groups of like size."""
    groups: list[list[_Dot]] = []
    for dot in sorted(dots, key=lambda dot: dot.shape.weights.size):
        if groups and dot.shape.weights.size <= WIDEST_GROUP * groups[-1][0].shape.weights.size:
            groups[-1].append(dot)
        else:
            groups.append([dot])
    return [_block(group, beyond) for group in groups]


def _parts(hidden: ContactMask) -> Int64[np.ndarray, "h w"]:
    """Every dot under its number; many dots that touch, as along an edge, in tiles."""
    dots, count = ndimage.label(hidden, EVERY_SIDE)
    sizes = np.bincount(dots.ravel())
    sizes[0] = 0
    rows, columns = np.indices(hidden.shape) // TILE_PX
    tile = rows * (columns.max() + 1) + columns
    large = (sizes > LARGEST_PX)[dots]
    return np.where(large, count + 1 + tile, dots).astype(np.int64)


def _block(group: list[_Dot], beyond: int) -> Block:
    """Dots of like size, padded to the largest."""
    rows = max(len(dot.places) for dot in group)
    columns = max(len(dot.sources) for dot in group)
    all_places = np.full((len(group), rows), beyond, np.int64)
    all_sources = np.full((len(group), columns), beyond, np.int64)
    all_weights = np.zeros((len(group), rows, columns), np.float32)
    for index, dot in enumerate(group):
        all_places[index, : len(dot.places)] = dot.places
        all_sources[index, : len(dot.sources)] = dot.sources
        all_weights[index, : len(dot.places), : len(dot.sources)] = dot.shape.weights
    return all_places, all_sources, all_weights


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
        return np.asarray(cho_solve_banded((self._factors, True), pull, check_finite=False))


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
        first, second = np.broadcast_arrays(places[:, :, None], places[:, None, :])
        product = np.broadcast_to(factor * np.outer(weights, weights), first.shape)
        lower = first >= second
        rows.append(first[lower])
        columns.append(second[lower])
        values.append(product[lower])
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
    padded = np.pad(number, ((0, 2), (0, 2)), constant_values=-1)
    height, width = number.shape
    places = np.stack(
        [padded[row : row + height, column : column + width] for row, column, _ in stencil], -1
    )
    return places[(places >= 0).all(-1)], np.array([weight for *_, weight in stencil])
