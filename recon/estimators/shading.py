# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""How the gel's colour answers its tilt, as a model of few numbers.

Light changes slowly from place to place: the colour's change, as a share of the blank gel's, is
close to a cubic of the normal's components times a quadratic of the place. Ten presses fix that
nearly as well as forty do.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Float32, Float64, Int32

Pairs = Float32[np.ndarray, "n 2"]
Colors = Float32[np.ndarray, "n c"]
Light = Float32[np.ndarray, "p c"]
"""The blank gel's colours as polynomials of the position."""
Shading = Float[np.ndarray, "t k"]
"""The share of each term in the change of each colour."""

LIGHT_POWERS = tuple((i, j) for i in range(5) for j in range(5 - i))
"""Powers of x and y: the blank gel's colour is smooth."""
PLACE_POWERS = tuple((i, j) for i in range(3) for j in range(3 - i))
"""Powers of x and y that the shading varies with."""
PENALTIES = (10.0, 1.0, 1e-1, 3e-2, 1e-2, 1e-3, 1e-4, 1e-5)
"""Tried; shares of each term's own square. Terms weigh by the square of their place's power."""
SAME_EVERYWHERE = 0.03
"""What terms that do not vary with the place weigh instead."""
FOLDS = 4
"""Parts of the presses, each of which is left out once to choose the penalty."""
DARKEST = 0.02
"""Of full scale: a blank gel darker than this is taken to be as bright as this."""


def fit_light(position: Pairs, blank: Colors) -> Light:
    """The blank gel's light from its colours at some positions (-1 to 1)."""
    terms = _powers(position.astype(np.float64), LIGHT_POWERS)
    found = np.linalg.lstsq(terms, blank.astype(np.float64), rcond=None)[0]
    return np.asarray(found, np.float32)


def blank_colors(light: Light, position: Pairs) -> Colors:
    """The blank gel's colours at some positions (-1 to 1), of full scale."""
    return np.asarray(np.clip(_powers(position, LIGHT_POWERS) @ light, 0, 1))


def whole_colors(light: Light, position: Pairs) -> Colors:
    """What colours change by shares of: the blank gel's, none below ``DARKEST``."""
    return np.maximum(blank_colors(light, position), DARKEST)


@dataclass(frozen=True, kw_only=True)
class Taught:
    """Pixels to learn from."""

    color: Colors
    """Prepared differences to the blank gel."""
    position: Pairs
    slopes: Pairs
    """Of the dent, mm/mm."""
    cap: Float32[np.ndarray, " n"]
    """How deep its ball goes below the contact's rim, in shares of the frame's shorter side."""
    press: Int32[np.ndarray, " n"]

    def __getitem__(self, chosen: np.ndarray) -> "Taught":
        """The chosen pixels."""
        return Taught(**{name: values[chosen] for name, values in vars(self).items()})


def color_changes(shading: Shading, slopes: Pairs, position: Pairs) -> Colors:
    """Of the colours, as shares of the blank gel's, where it has some slopes at some positions."""
    return changes_by(shading, shading_terms(slopes, position))


def changes_by(shading: Shading, terms: Float64[np.ndarray, "n t"]) -> Colors:
    """The same from what ``shading_terms`` gives."""
    return np.asarray(terms @ shading, np.float32)


def shading_terms(slopes: Pairs, position: Pairs) -> Float64[np.ndarray, "n t"]:
    """Each product of up to three of the normal's components with each power of the place."""
    places = _powers(position.astype(np.float64), PLACE_POWERS)
    products = tilt_terms(slopes)[:, :, None] * places[:, None, :]
    return products.reshape(len(slopes), products.shape[1] * products.shape[2])


def fit_shading(taught: Taught, light: Light) -> Shading:
    """Fit by least squares, with the penalty that predicts left-out presses best.

    Gel that is taught as flat is not looked at: the model is exact there.
    """
    tilted = taught[np.flatnonzero(taught.slopes.any(1))]
    terms = shading_terms(tilted.slopes, tilted.position)
    wanted = (tilted.color / whole_colors(light, tilted.position)).astype(np.float64)
    fold = np.unique(tilted.press, return_inverse=True)[1] % FOLDS
    own = [(terms[fold == k], wanted[fold == k]) for k in np.unique(fold)]
    squares = [inputs.T @ inputs for inputs, _ in own]
    products = [inputs.T @ change for inputs, change in own]
    square, product = np.sum(squares, axis=0), np.sum(products, axis=0)
    varies = np.array([SAME_EVERYWHERE + (i + j) ** 2 for i, j in PLACE_POWERS])
    weight = np.diag(np.diag(square) * np.tile(varies, terms.shape[1] // len(varies)))

    def missed(penalty: float) -> float:
        total = 0.0
        for (inputs, change), inner, outer in zip(own, squares, products, strict=True):
            shares = _solved(square - inner + penalty * weight, product - outer)
            total += float(((inputs @ shares - change) ** 2).sum())
        return total

    best = min(PENALTIES, key=missed)
    return _solved(square + best * weight, product)


def answers_at(shading: Shading, position: Pairs) -> Float64[np.ndarray, "n tilts k"]:
    """How the colours' changes at some positions answer each of ``tilt_terms``."""
    places = _powers(position.astype(np.float64), PLACE_POWERS)
    terms = shading.reshape(-1, places.shape[1], shading.shape[1])
    return np.einsum("np,tpk->ntk", places, terms)


def tilt_terms(slopes: Pairs) -> Float64[np.ndarray, "n t"]:
    """The products of up to three of the normal's components that colours answer."""
    gx, gy = slopes.T.astype(np.float64)
    upright = 1 / np.sqrt(1 + gx**2 + gy**2)
    x, y, fallen = gx * upright, gy * upright, 1 - upright
    tilts = [x, y, fallen, x**2 - y**2, x * y, x * fallen, y * fallen]
    tilts += [x**3 - 3 * x * y**2, 3 * x**2 * y - y**3]
    return np.stack(tilts, 1)


def _powers(position: np.ndarray, powers: tuple[tuple[int, int], ...]) -> np.ndarray:
    highest = 1 + max(i for i, _ in powers)

    def each(along: np.ndarray) -> list[np.ndarray]:
        some, which = np.unique(along, return_inverse=True)  # a frame has few, and powers are slow
        return [(some**i)[which] for i in range(highest)]

    x, y = (each(along) for along in position.T)
    return np.stack([x[i] * y[j] for i, j in powers], 1)


def _solved(square: Float64[np.ndarray, "t t"], product: Float64[np.ndarray, "t c"]) -> np.ndarray:
    return np.asarray(np.linalg.lstsq(square, product, rcond=None)[0])
