# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Waves in which the Laplacian is diagonal: sines with a zero border, cosines with a free one.

Products with a table of sines take less time than a fast sine transform on the fields that are
solved for here: their lengths are even, and one more than an even length has few small factors.
Cosines are quicker by products on fields of less than about 100 x 100 only (``waves``).
"""

from functools import lru_cache

import numpy as np
from jaxtyping import Float32
from scipy import fft

from recon.integration.poisson import Boundary

Field = Float32[np.ndarray, "rows columns"]


@lru_cache(maxsize=16)
def waves(count: int, boundary: Boundary) -> Float32[np.ndarray, "n n"]:
    """Sines, or cosines, of ``count`` places along an axis, each a row of length 1.

    Do not write into them: they are kept.
    """
    transform, kind = (fft.dst, 1) if boundary == "dirichlet" else (fft.dct, 2)
    return np.asarray(transform(np.eye(count), type=kind, axis=0, norm="ortho"), np.float32)


def to_waves(field: Field, boundary: Boundary) -> Field:
    """How much of each wave a field has; the sum of its squares is the field's."""
    if boundary == "neumann":
        return np.asarray(fft.dctn(field, type=2, norm="ortho"))
    rows, columns = field.shape
    return np.asarray(waves(rows, boundary) @ field @ waves(columns, boundary).T)


def of_waves(spectrum: Field, boundary: Boundary) -> Field:
    """The field that has so much of each wave."""
    if boundary == "neumann":
        return np.asarray(fft.idctn(spectrum, type=2, norm="ortho"))
    rows, columns = spectrum.shape
    return np.asarray(waves(rows, boundary).T @ spectrum @ waves(columns, boundary))
