# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""A ball's contact fitted to the colours near it.

Colours are taken as a polynomial of the surface normal, the normal as the ball's inside the circle
and as fading exponentially outside, where the gel hangs free. The polynomial is solved for at each
step (variable projection; Golub and Pereyra, 2003). How it changes with the step is left out of the
derivatives, which leaves the gradient as it is (Kaufman, 1975). Steps are those of Levenberg and
Marquardt: for four parameters scipy's ``least_squares`` spends half of its time on itself.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float64
from scipy.linalg.lapack import dposv

Column = Float64[np.ndarray, " n"]
Colors = Float64[np.ndarray, "3 n"]
Parameters = Float64[np.ndarray, "4"]
"""Centre along x and y and radius in pixels, and the logarithm of the length, also in pixels, over
which the slope fades outside."""

SCALE = (1.0, 1.0, 1.0, 0.3)
"""Of a step of each parameter."""
FIRST_DAMPING, MOST_STEPS = 1e-3, 40


@dataclass(frozen=True, kw_only=True)
class Near:
    """Pixels near a contact."""

    x_px: Column
    y_px: Column
    color: Colors
    """Frame minus background."""


def fit_ball(
    near: Near,
    weight: Column,
    ball_radius_px: float,
    first: Parameters,
    bounds: tuple[Parameters, Parameters],
    enough: float,
) -> Parameters:
    """The contact whose shading explains most of the colours.

    Args:
        near: the pixels.
        weight: of each pixel's error.
        ball_radius_px: of the ball.
        first: to begin with.
        bounds: lowest and highest of each parameter.
        enough: a step that changes the parameters, or what is unexplained, by a smaller share is
            the last.
    """
    seen, scale = near.color * weight, np.array(SCALE)
    lowest, highest = bounds
    at, damping = first, FIRST_DAMPING
    rest, change = _rest_and_change(at, near, seen, weight, ball_radius_px)
    for _ in range(MOST_STEPS):
        step = _step(rest, change, damping, (lowest - at, highest - at))
        tried = _rest_and_change(at + step, near, seen, weight, ball_radius_px)
        less = 1 - float(tried[0] @ tried[0]) / max(float(rest @ rest), 1e-300)
        if less > 0:
            at, damping, (rest, change) = at + step, damping / 10, tried
        else:
            damping *= 10
        is_small = np.linalg.norm(step / scale) < enough * np.linalg.norm(at / scale)
        if is_small or 0 <= less < enough:
            break
    return at


def _step(
    rest: np.ndarray, change: np.ndarray, damping: float, reach: tuple[np.ndarray, np.ndarray]
) -> np.ndarray:
    """Of Levenberg and Marquardt, within reach; what would leave it from its edge stays."""
    down, square = -change @ rest, change @ change.T
    square[np.diag_indices(4)] *= 1 + damping
    lowest, highest = reach
    free = np.flatnonzero(((down > 0) | (lowest < 0)) & ((down < 0) | (highest > 0)))
    step = np.zeros(4)
    step[free] = np.linalg.lstsq(square[np.ix_(free, free)], down[free], rcond=None)[0]
    return np.clip(step, lowest, highest)


def unexplained(
    parameters: Parameters, near: Near, weight: Column, ball_radius_px: float
) -> Colors:
    """Weighted colours less what the contact's shading explains of them."""
    return _rest(parameters, near, near.color * weight, weight, ball_radius_px)


# What follows is called thousands of times, so shapes are not checked at every call.
def _rest(
    parameters: np.ndarray, near: Near, seen: np.ndarray, weight: np.ndarray, ball_radius_px: float
) -> np.ndarray:
    """What is unexplained of weighted colours."""
    return without(seen, _terms(*_normal(parameters, near, ball_radius_px)) * weight)


def _normal(
    parameters: np.ndarray, near: Near, ball_radius_px: float
) -> tuple[np.ndarray, np.ndarray]:
    """The normal's components along x and y."""
    away_x, away_y, distance = _away(parameters, near)
    sine = _sine(_slope(parameters, distance, ball_radius_px))
    return -away_x * sine, -away_y * sine


def _away(parameters: np.ndarray, near: Near) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The direction away from the centre, and the distance from it."""
    x, y = near.x_px - parameters[0], near.y_px - parameters[1]
    distance = np.sqrt(x * x + y * y) + 1e-9
    return x / distance, y / distance, distance


def _slope(parameters: np.ndarray, distance: np.ndarray, ball_radius_px: float) -> np.ndarray:
    """Steepness at some distances from the centre."""
    _, _, radius, log_fade = parameters
    inside = np.minimum(distance, radius)
    fades = np.exp(-np.maximum(distance - radius, 0) / np.exp(log_fade))
    slope: np.ndarray = inside / np.sqrt(ball_radius_px**2 - inside**2) * fades
    return slope


def _sine(slope: np.ndarray) -> np.ndarray:
    """Of the angle whose tangent is the slope."""
    sine: np.ndarray = slope / np.sqrt(1 + slope * slope)
    return sine


def _terms(nx: np.ndarray, ny: np.ndarray) -> np.ndarray:
    """Terms of the colour, a row each: the normal's components up to the third power."""
    flat = nx * nx + ny * ny
    return np.stack([nx, ny, nx * ny, nx * nx - ny * ny, flat, nx * flat, ny * flat])


def _shares(values: np.ndarray, terms: np.ndarray) -> np.ndarray:
    """What share of each term explains each row of values best.

    Normal equations: few and well scaled, and many times faster here than an orthogonal basis.
    """
    square, products = terms @ terms.T, terms @ values.T
    _, shares, fault = dposv(square, products)
    if fault:  # terms that depend on each other
        shares = np.linalg.lstsq(square, products, rcond=None)[0]
    found: np.ndarray = shares.T
    return found


def without(values: np.ndarray, terms: np.ndarray) -> np.ndarray:
    """Rows of values less their projection on the terms."""
    return values - _shares(values, terms) @ terms


def _rest_and_change(
    parameters: np.ndarray, near: Near, seen: np.ndarray, weight: np.ndarray, ball_radius_px: float
) -> tuple[np.ndarray, np.ndarray]:
    """What is unexplained, in one row, and how it changes with each parameter, a row each."""
    _, _, radius, log_fade = parameters
    away_x, away_y, distance = _away(parameters, near)
    slope = _slope(parameters, distance, ball_radius_px)
    sine = _sine(slope)
    nx, ny = -away_x * sine, -away_y * sine
    terms = _terms(nx, ny) * weight
    shares = _shares(seen, terms)
    by_nx, by_ny = _by_normal(shares, nx, ny) * weight
    by_sine = by_nx * away_x + by_ny * away_y
    # Of the slope: by the distance, the radius, and the fade.
    fade, beyond = np.exp(log_fade), np.maximum(distance - radius, 0)
    is_beyond = distance > radius
    height = np.sqrt(ball_radius_px**2 - np.minimum(distance, radius) ** 2)
    ball = ball_radius_px**2 / (height * height * height)
    cosine = 1 / np.sqrt(1 + slope * slope)
    of_sine = cosine * cosine * cosine
    outward = by_sine * (np.where(is_beyond, -slope / fade, ball) * of_sine)
    turned = sine / distance
    changes = np.stack(
        [
            outward * away_x + (by_nx - by_sine * away_x) * turned,
            outward * away_y + (by_ny - by_sine * away_y) * turned,
            -by_sine * (is_beyond * (ball * np.exp(-beyond / fade) + slope / fade) * of_sine),
            -by_sine * (slope * beyond / fade * of_sine),
        ]
    )
    change = -without(changes.reshape(12, -1), terms).reshape(4, -1)
    return (seen - shares @ terms).ravel(), change


def _by_normal(shares: np.ndarray, nx: np.ndarray, ny: np.ndarray) -> np.ndarray:
    """How the colours change with the normal's components; (2, colour, pixel)."""
    both, xx, yy = 2 * nx * ny, nx * nx, ny * ny
    x, y, mixed, apart, flat, x_flat, y_flat = shares.T[:, :, None]
    by_nx = x + mixed * ny + 2 * (flat + apart) * nx + x_flat * (3 * xx + yy) + y_flat * both
    by_ny = y + mixed * nx + 2 * (flat - apart) * ny + y_flat * (3 * yy + xx) + x_flat * both
    return np.stack([by_nx, by_ny])
