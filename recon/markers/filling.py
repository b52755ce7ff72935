# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Values under the dots, from those around them: one name, seven methods.

``zero``, ``nearest``, ``linear`` and ``cubic`` are what the paper compares ("Markers"):
``scipy.interpolate.griddata`` from the pixels around the dots. ``harmonic`` and ``biharmonic``
solve for a membrane and for a thin plate that the pixels around a dot hold with springs: noise
there is averaged, not copied. ``surface`` fills both slopes at once, as two plates that must be
the slopes of one surface: the curl of a gradient is zero, so what is known of one slope says how
the other goes on. Each of the three is the minimum of a quadratic energy, so what it puts under a
dot is a fixed matrix times the values around it: made once for a shape of dot, and kept while
dots stand still.
"""

from collections.abc import Callable, Mapping
from functools import lru_cache

import numpy as np
from jaxtyping import Float, Float32, Float64, Int64
from scipy import ndimage
from scipy.interpolate import griddata
from scipy.linalg import cho_factor, cho_solve
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

Block = tuple[Int64[np.ndarray, "k n"], Int64[np.ndarray, "k m"], Float32[np.ndarray, "k n m"]]
"""Of k dots: places to fill, places listened to (both padded), and the matrices between them."""


def fill_gradients(
    gradient: Field,
    hidden: ContactMask,
    method: str = "surface",
    mm_per_px: Pair = (1.0, 1.0),
) -> Field:
    """A field with its hidden pixels filled from around them.

    Args:
        gradient: (h, w, 2), or (h, w, c) for every method but ``surface``; what stands in hidden
            pixels is ignored.
        hidden: (h, w), true under dots.
        method: one of ``METHODS``.
        mm_per_px: pixel pitch along x and y; only their ratio matters, and only to ``surface``.

    Returns:
        A new field of the same dtype; pixels that are not hidden are untouched.

    Raises:
        WedgeError: no method has that name.
    """
    return _prepared(hidden.tobytes(), hidden.shape, method, mm_per_px[1] / mm_per_px[0])(gradient)


def prepare_fill(
    hidden: ContactMask, method: str = "surface", mm_per_px: Pair = (1.0, 1.0)
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
    return _elastic(hidden, method, mm_per_px[1] / mm_per_px[0])


@lru_cache(maxsize=4)
def _prepared(hidden: bytes, shape: tuple[int, int], method: str, aspect: float) -> Fill:
    return prepare_fill(np.frombuffer(hidden, bool).reshape(shape), method, (1.0, aspect))


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


def _elastic(hidden: ContactMask, method: str, aspect: float) -> Fill:
    together = 2 if method == "surface" else 1
    blocks = _blocks(hidden, method, aspect, together)
    reached = np.zeros(together * hidden.size + 1, bool)
    for places, _, _ in blocks:
        reached[places] = True
    # In the midst of a wide hidden area nothing is known within the ring.
    far = hidden & ~reached[:-1].reshape(*hidden.shape, together)[..., 0]
    around = ndimage.binary_dilation(hidden, EVERY_SIDE) & ~hidden
    rough = _nearest(far, around) if far.any() else None

    def fill(field: Field) -> Field:
        values = (field if rough is None else rough(field)).reshape(hidden.size * together, -1)
        # Padding reads and writes one row beyond the field.
        flat = np.empty((len(values) + 1, values.shape[1]), field.dtype)
        flat[:-1] = values
        flat[-1] = 0
        for places, sources, weights in blocks:
            flat[places] = weights @ flat[sources]
        return flat[:-1].reshape(field.shape)

    return fill


def _blocks(hidden: ContactMask, method: str, aspect: float, together: int) -> list[Block]:
    """The matrices of all dots, in groups of like size; ``together`` values a pixel in one."""
    ring_px = RING_PX[method]
    width = hidden.shape[1]
    dots = _parts(hidden)
    found: list[tuple[np.ndarray, np.ndarray, np.ndarray]] = []
    for number, place in enumerate(ndimage.find_objects(dots), start=1):
        if place is None:
            continue
        top, left = (max(side.start - ring_px, 0) for side in place)
        window = np.s_[top : place[0].stop + ring_px, left : place[1].stop + ring_px]
        dot = dots[window] == number
        known = ndimage.binary_dilation(dot, EVERY_SIDE, iterations=ring_px) & ~hidden[window]
        if not known.any():
            continue
        weights = _weights(dot.tobytes(), known.tobytes(), dot.shape, method, aspect)
        places, sources = (
            np.add.outer(np.arange(together), together * ((rows + top) * width + columns + left))
            for rows, columns in map(np.nonzero, (dot, known))
        )
        found.append((places.ravel(), sources.ravel(), weights))
    found.sort(key=lambda item: item[2].size)
    groups: list[list[tuple[np.ndarray, np.ndarray, np.ndarray]]] = []
    for item in found:
        if groups and item[2].size <= WIDEST_GROUP * groups[-1][0][2].size:
            groups[-1].append(item)
        else:
            groups.append([item])
    return [_block(group, together * hidden.size) for group in groups]


def _parts(hidden: ContactMask) -> Int64[np.ndarray, "h w"]:
    """Every dot under its number; many dots that touch, as along an edge, in tiles."""
    dots, count = ndimage.label(hidden, EVERY_SIDE)
    sizes = np.bincount(dots.ravel())
    sizes[0] = 0
    rows, columns = np.indices(hidden.shape) // TILE_PX
    tile = rows * (columns.max() + 1) + columns
    large = (sizes > LARGEST_PX)[dots]
    return np.where(large, count + 1 + tile, dots).astype(np.int64)


def _block(group: list[tuple[np.ndarray, np.ndarray, np.ndarray]], beyond: int) -> Block:
    """Dots of like size, padded to the largest."""
    rows = max(len(places) for places, _, _ in group)
    columns = max(len(sources) for _, sources, _ in group)
    all_places = np.full((len(group), rows), beyond, np.int64)
    all_sources = np.full((len(group), columns), beyond, np.int64)
    all_weights = np.zeros((len(group), rows, columns), np.float32)
    for index, (places, sources, weights) in enumerate(group):
        all_places[index, : len(places)] = places
        all_sources[index, : len(sources)] = sources
        all_weights[index, : len(places), : len(sources)] = weights
    return all_places, all_sources, all_weights


@lru_cache(maxsize=1024)
def _weights(
    dot: bytes, known: bytes, shape: tuple[int, int], method: str, aspect: float
) -> Float32[np.ndarray, "n m"]:
    """What each value around a dot adds to each value under it.

    Minimises ``sum over known (u - g)^2 + stiffness * sum (differences of u)^2`` over the dot
    and the pixels around it: first differences for a membrane; second differences, the mixed one
    twice, for a plate. ``surface`` has two such u, one after the other, and adds ``stiffness *
    sum (du_y/dx - du_x/dy)^2``. Where the frame's edge or another dot cuts the surroundings, the
    energy has fewer terms: a natural border.
    """
    hidden, held = (np.frombuffer(mask, bool).reshape(shape) for mask in (dot, known))
    part = hidden | held
    number = np.full(shape, -1)
    number[part] = np.arange(part.sum())
    bending = np.concatenate([_terms(number, stencil) for stencil in STENCILS[method]])
    energy = STIFFNESS[method] * bending.T @ bending
    energy[np.diag_indices_from(energy)] += held[part] + 1e-9
    filled, listened = number[hidden], number[held]
    if method == "surface":
        curl = np.concatenate([-_terms(number, ALONG_Y) / aspect, _terms(number, ALONG_X)], 1)
        energy = np.kron(np.eye(2), energy) + CURL_STIFFNESS * curl.T @ curl
        filled, listened = (
            np.concatenate([chosen, chosen + part.sum()]) for chosen in (filled, listened)
        )
    # The energy is symmetric, so a row of its inverse is a column.
    rows = cho_solve(cho_factor(energy), np.eye(len(energy))[:, filled]).T
    return rows[:, listened].astype(np.float32)


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


def _terms(number: Int64[np.ndarray, "h w"], stencil: Stencil) -> Float64[np.ndarray, "t n"]:
    """One row for every place where the whole stencil lies on numbered pixels."""
    padded = np.pad(number, ((0, 2), (0, 2)), constant_values=-1)
    height, width = number.shape
    parts = np.stack(
        [padded[row : row + height, column : column + width] for row, column, _ in stencil], -1
    )
    parts = parts[(parts >= 0).all(-1)]
    terms = np.zeros((len(parts), number.max() + 1))
    for column, (_, _, weight) in enumerate(stencil):
        terms[np.arange(len(parts)), parts[:, column]] = weight
    return terms
