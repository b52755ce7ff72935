# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""How the gel's colour answers its tilt, as a model of few numbers, and pixels moved by it.

Few presses leave most of the pad untouched, and networks guess there. But light changes slowly from
place to place: the colour's change, as a share of the blank gel's, is close to a cubic of the
normal's components times a quadratic of the place, and ten presses fix that nearly as well as forty
do. The model is not inverted. It moves taught pixels: to another place and another azimuth, with
the same steepness and half as much again of the model's error, so that slopes are as likely as they
were and colours no cleaner. The networks learn from moved pixels beside the real ones.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float32, Float64, Int32

Pairs = Float32[np.ndarray, "n 2"]
Colors = Float32[np.ndarray, "n c"]
Light = Float32[np.ndarray, "p c"]
"""The blank gel's colours as polynomials of the position."""

LIGHT_POWERS = tuple((i, j) for i in range(5) for j in range(5 - i))
"""Powers of x and y: the blank gel's colour is smooth."""
PLACE_POWERS = tuple((i, j) for i in range(3) for j in range(3 - i))
"""Powers of x and y that the shading varies with."""
PENALTIES = (1e-1, 3e-2, 1e-2, 1e-3, 1e-4, 1e-5)
"""Tried; shares of each term's own square. Terms weigh by the square of their place's power."""
SAME_EVERYWHERE = 0.03
"""What terms that do not vary with the place weigh instead."""
FOLDS = 4
"""Parts of the presses, each of which is left out once to choose the penalty."""
DARKEST = 0.02
"""Of full scale: a blank gel darker than this is taken to be as bright as this."""
FEW_PRESSES = 10
"""All pixels are moved, once. Of more presses, only a share that falls with their square."""

ROUGHER = 1.5
"""Errors of moved pixels over the model's: other shapes shade and light themselves more."""


def fit_light(position: Pairs, blank: Colors) -> Light:
    """The blank gel's light from its colours at some positions (-1 to 1)."""
    terms = _powers(position.astype(np.float64), LIGHT_POWERS)
    found = np.linalg.lstsq(terms, blank.astype(np.float64), rcond=None)[0]
    return np.asarray(found, np.float32)


def blank_colors(light: Light, position: Pairs) -> Colors:
    """The blank gel's colours at some positions (-1 to 1), of full scale."""
    return np.asarray(np.clip(_powers(position, LIGHT_POWERS) @ light, 0, 1))


@dataclass(frozen=True, kw_only=True)
class Taught:
    """Pixels to learn from."""

    color: Colors
    """Prepared differences to the blank gel."""
    position: Pairs
    slopes: Pairs
    """Of the dent, mm/mm."""
    press: Int32[np.ndarray, " n"]

    def __getitem__(self, chosen: np.ndarray) -> "Taught":
        """The chosen pixels."""
        return Taught(**{name: values[chosen] for name, values in vars(self).items()})


@dataclass(frozen=True, kw_only=True)
class Shading:
    """The fitted model."""

    light: Light
    shares: Float64[np.ndarray, "t c"]
    """Of each term in the relative change of each colour."""

    def colors(self, slopes: Pairs, position: Pairs) -> Colors:
        """Differences to the blank gel where the gel has some slopes at some positions."""
        blank = blank_colors(self.light, position)
        change = (_terms(slopes, position) @ self.shares) * np.maximum(blank, DARKEST)
        return np.asarray(np.clip(change, -blank, 1 - blank), np.float32)


def fit_shading(taught: Taught, light: Light) -> Shading:
    """Fit by least squares, with the penalty that predicts left-out presses best.

    Gel that is taught as flat is not looked at: the model is exact there.
    """
    tilted = taught[np.flatnonzero(taught.slopes.any(1))]
    terms = _terms(tilted.slopes, tilted.position)
    blank = np.maximum(blank_colors(light, tilted.position), DARKEST)
    wanted = (tilted.color / blank).astype(np.float64)
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
    return Shading(light=light, shares=_solved(square + best * weight, product))


def moved(taught: Taught, light: Light, seed: int) -> Taught:
    """Pixels like the taught ones elsewhere on the pad, tilted another way; drawn with the seed."""
    random = np.random.default_rng(seed)
    share = min(1.0, FEW_PRESSES / len(np.unique(taught.press))) ** 2
    chosen = random.choice(len(taught.press), round(share * len(taught.press)), replace=False)
    source = taught[np.sort(chosen)]
    model = fit_shading(taught, light)
    error = source.color - model.colors(source.slopes, source.position)
    position = random.uniform(-1, 1, source.position.shape).astype(np.float32)
    azimuth = random.uniform(0, 2 * np.pi, len(position))
    steepness = np.linalg.norm(source.slopes, axis=1, keepdims=True)
    directions = np.stack([np.cos(azimuth), np.sin(azimuth)], 1)
    slopes = np.asarray(steepness * directions, np.float32)
    return Taught(
        color=np.asarray(model.colors(slopes, position) + ROUGHER * error, np.float32),
        position=position,
        slopes=slopes,
        press=source.press,
    )


def _powers(position: np.ndarray, powers: tuple[tuple[int, int], ...]) -> np.ndarray:
    highest = 1 + max(i for i, _ in powers)
    x, y = ([along**i for i in range(highest)] for along in position.T)
    return np.stack([x[i] * y[j] for i, j in powers], 1)


def _terms(slopes: Pairs, position: Pairs) -> Float64[np.ndarray, "n t"]:
    """Each product of up to three of the normal's components with each power of the place."""
    gx, gy = slopes.T.astype(np.float64)
    upright = 1 / np.sqrt(1 + gx**2 + gy**2)
    x, y, fallen = gx * upright, gy * upright, 1 - upright
    tilts = [x, y, fallen, x**2 - y**2, x * y, x * fallen, y * fallen]
    tilts += [x**3 - 3 * x * y**2, 3 * x**2 * y - y**3]
    places = _powers(position.astype(np.float64), PLACE_POWERS)
    return (np.stack(tilts, 1)[:, :, None] * places[:, None, :]).reshape(len(slopes), -1)


def _solved(square: Float64[np.ndarray, "t t"], product: Float64[np.ndarray, "t c"]) -> np.ndarray:
    return np.asarray(np.linalg.lstsq(square, product, rcond=None)[0])
