# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Values under the dots, from those around them: one name, seven methods.

``zero``, ``nearest``, ``linear`` and ``cubic`` are what the paper compares ("Markers"):
``scipy.interpolate.griddata`` from the pixels around the dots. ``harmonic`` and ``biharmonic``
solve for a membrane and for a thin plate that the pixels around a dot hold with springs, and
``surface`` for two plates that must be the slopes of one surface: ``recon.markers.elastic``.
"""

from collections.abc import Callable
from functools import lru_cache

import numpy as np
from scipy.interpolate import griddata
from scipy.spatial import QhullError

from recon.arrays import ContactMask
from recon.markers.elastic import ElasticFill, Field, beside, nearest_known
from sensor.errors import WedgeError
from sensor.toml import Pair

METHODS = ("zero", "nearest", "linear", "cubic", "harmonic", "biharmonic", "surface")
Fill = Callable[[Field], Field]
"""Takes a field with anything in the hidden pixels and returns it with them filled."""


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
    aspect = mm_per_px[1] / mm_per_px[0]
    return _prepared(hidden.tobytes(), hidden.shape, method, aspect)(gradient)


def prepare_fill(
    hidden: ContactMask,
    method: str = "surface",
    mm_per_px: Pair = (1.0, 1.0),
) -> Fill:
    """All that depends only on where the dots are, done once; arguments as above.

    Raises:
        WedgeError: no method has that name.
    """
    if method not in METHODS:
        raise WedgeError(f"no way of filling is called {method!r}: known are {', '.join(METHODS)}.")
    around = beside(hidden)
    if method == "zero" or not around.any():
        return lambda field: np.where(hidden[..., None], field.dtype.type(0), field)
    if method == "nearest":
        return _nearest(hidden, around)
    if method in ("linear", "cubic"):
        return _interpolated(hidden, around, method)
    return ElasticFill(hidden, method, mm_per_px[1] / mm_per_px[0])


@lru_cache(maxsize=4)
def _prepared(hidden: bytes, shape: tuple[int, int], method: str, aspect: float) -> Fill:
    mask = np.frombuffer(hidden, bool).reshape(shape)
    return prepare_fill(mask, method, (1.0, aspect))


def _nearest(hidden: ContactMask, around: ContactMask) -> Fill:
    places, sources = nearest_known(hidden, around)

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
        try:
            found = griddata(known, field[around], places, method=method)
        except QhullError:  # what is known spans no triangle
            return filled
        filled[hidden] = np.where(np.isfinite(found), found, filled[hidden])
        return filled

    return fill
