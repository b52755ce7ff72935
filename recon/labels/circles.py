# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Where a ball touched, from its own shading: mends circles that were drawn by hand."""

from collections.abc import Iterable
from dataclasses import dataclass

import cv2
import numpy as np
from jaxtyping import Float32, Float64
from scipy.optimize import least_squares

from recon.arrays import Difference
from sensor.dataset import BallLabel
from sensor.toml import Pair

Column = Float64[np.ndarray, " n"]
Table = Float64[np.ndarray, "n k"]
Energy = Float32[np.ndarray, "h w"]
Drawn = tuple[float, float, float]
"""x and y of a circle's centre, and its radius."""

FARTHEST_SHIFT = 1 / 3
"""Of the circle's radius."""
START = 0.85
"""Of the drawn radius: circles are drawn round the visible disc, which is too wide."""
LARGEST = 0.95
"""Of the ball's radius: no gel follows a ball up to its equator."""
REACH = 2.0
"""Drawn radii from the drawn centre, up to which pixels are looked at."""
PIXELS, ROUNDS = 2000, 3
GLANCED = 500
"""Pixels of a first look at each of several circles, in one round."""
HOPELESS = 0.5
"""Of the best quality at that look: what explains less is not the ball. With 0 all are fitted to
the end, and of 200 presses of five sets ``python -m validation.circles`` prints the same."""


@dataclass(frozen=True, kw_only=True)
class Circle:
    """A contact circle and how well its ball explains the picture."""

    center_px: Pair
    radius_px: float
    quality: float
    """0 to 1: the share of the shading near the circle that a ball explains, times the share of
    the frame's shading that lies near the circle, so that a ball's holder lowers it."""
    shading_px: Pair | None = None
    """The shading's centre, of a circle that was found."""
    spread: float | None = None
    """Of its outline (``recon.labels.outline``), in radii; ``None`` if that did not centre it."""

    def label(
        self, file: str, size_px: tuple[int, int], ball_radius_mm: float | None = None
    ) -> BallLabel:
        """As ``labels.csv`` keeps it: rounded, its centre inside the frame.

        Args:
            file: of the frame.
            size_px: width and height of the unwarped frame.
            ball_radius_mm: where the frame's ball is not the dataset's.
        """
        (x_px, y_px), (width, height) = self.center_px, size_px
        return BallLabel(
            file=file,
            center_x_px=round(min(max(x_px, 0.0), width - 1.0), 2),
            center_y_px=round(min(max(y_px, 0.0), height - 1.0), 2),
            contact_radius_px=round(self.radius_px, 2),
            ball_radius_mm=ball_radius_mm,
            quality=round(self.quality, 3),
        )


def refit_circle(
    difference: Difference,
    center_px: Pair,
    radius_px: float,
    ball_radius_px: float,
    reach: float = REACH,
) -> Circle:
    """Move and resize a circle until a ball of known radius explains the shading best.

    Colours are taken as a polynomial of the surface normal, the normal as the ball's inside the
    circle and as fading exponentially outside, where the gel hangs free. The polynomial is solved
    for at each step (variable projection; Golub and Pereyra, 2003); printed dots and dust are
    weighted down (Cauchy). A disc looks wider than this circle because the gel around it slopes
    too. Pixels must be square.

    Args:
        difference: frame minus background, in the gel plane.
        center_px: of the circle that was drawn.
        radius_px: of the circle that was drawn, good to a third.
        ball_radius_px: of the ball.
        reach: pixels up to this many drawn radii from the drawn centre are looked at.
    """
    start = (*center_px, radius_px)
    return _fitted(difference, _energy(difference), start, ball_radius_px, reach, PIXELS, ROUNDS)


def refit_circles(
    difference: Difference, drawn: Iterable[Drawn], ball_radius_px: float
) -> list[Circle]:
    """The same of several circles of one frame, only glanced at where they can be no ball.

    Args:
        difference: frame minus background, in the gel plane.
        drawn: x and y of each circle's centre, and its radius.
        ball_radius_px: of the ball.
    """
    starts, energy = list(drawn), _energy(difference)

    def fitted(start: Drawn, pixels: int, rounds: int) -> Circle:
        return _fitted(difference, energy, start, ball_radius_px, REACH, pixels, rounds)

    glanced = [fitted(start, GLANCED, 1) for start in starts]
    best = max((circle.quality for circle in glanced), default=0.0)
    return [
        circle if circle.quality < HOPELESS * best else fitted(start, PIXELS, ROUNDS)
        for circle, start in zip(glanced, starts, strict=True)
    ]


def _fitted(
    difference: Difference,
    energy: Energy,
    start: Drawn,
    ball_radius_px: float,
    reach: float,
    pixels: int,
    rounds: int,
) -> Circle:
    """A drawn circle after so many rounds, by so many pixels near it."""
    center_px, radius_px = start[:2], start[2]
    x, y, color = _pixels_near(difference, center_px, reach * radius_px, pixels)
    shift = FARTHEST_SHIFT * radius_px
    lowest = np.array([center_px[0] - shift, center_px[1] - shift, 0.4 * radius_px, np.log(0.5)])
    largest = min(1.8 * radius_px, LARGEST * ball_radius_px)
    highest = np.array([center_px[0] + shift, center_px[1] + shift, largest, np.log(radius_px)])
    first = np.array([*center_px, START * radius_px, np.log(radius_px / 4)])
    parameters = np.clip(first, lowest + 1e-6, highest - 1e-6)
    weight = np.ones(len(x))
    for _ in range(rounds):
        parameters = least_squares(
            _unexplained,
            parameters,
            bounds=(lowest, highest),
            x_scale=[1, 1, 1, 0.3],
            diff_step=1e-3,
            max_nfev=40,
            args=(x, y, color, weight, ball_radius_px),
        ).x
        rest = _unexplained(parameters, x, y, color, weight, ball_radius_px)
        error = np.sqrt((rest.reshape(color.shape) ** 2).sum(1)) / weight
        scale = max(1.4826 * float(np.median(error)), 1e-9)
        weight = 1 / np.sqrt(1 + (error / (2 * scale)) ** 2)
    center_x, center_y, radius, _ = parameters
    # Weighted alike, so that neither printed dots nor another object's outline pass as explained.
    unexplained = float(((weight * error) ** 2).mean())
    signal = max(float((weight**2 * (color**2).sum(1)).mean()), 1e-12)
    center = (float(center_x), float(center_y))
    near = _share_near(energy, center, 2.2 * radius)
    return Circle(
        center_px=center,
        radius_px=float(radius),
        quality=max(0.0, 1 - unexplained / signal) * near,
    )


# The fit calls these two thousands of times, so their shapes are not checked at every call.
def _unexplained(
    parameters: np.ndarray,
    x: np.ndarray,
    y: np.ndarray,
    color: np.ndarray,
    weight: np.ndarray,
    ball_radius_px: float,
) -> np.ndarray:
    """Weighted colours less their projection on the shading's terms, in one row."""
    terms = _shading(parameters, x, y, ball_radius_px)
    terms *= weight
    seen = color * weight[:, None]
    # Normal equations: few and well scaled, and many times faster here than an orthogonal basis.
    shares = np.linalg.lstsq(terms @ terms.T, terms @ seen, rcond=None)[0]
    rest: np.ndarray = seen - terms.T @ shares
    return rest.ravel()


def _shading(
    parameters: np.ndarray, x: np.ndarray, y: np.ndarray, ball_radius_px: float
) -> np.ndarray:
    """Terms of the colour, a row each: the normal's components up to the third power.

    Parameters are the centre, the radius, and the logarithm of the length over which the slope
    fades outside.
    """
    center_x, center_y, radius, log_fade = parameters
    dx, dy = x - center_x, y - center_y
    distance = np.sqrt(dx * dx + dy * dy) + 1e-9
    inside = np.minimum(distance, radius)
    slope = inside / np.sqrt(ball_radius_px**2 - inside**2)
    slope = slope * np.exp(-np.maximum(distance - radius, 0) / np.exp(log_fade))
    sine = slope / np.sqrt(1 + slope**2)
    nx, ny = -dx / distance * sine, -dy / distance * sine
    flat = sine**2
    return np.stack([nx, ny, nx * ny, nx**2 - ny**2, flat, nx * flat, ny * flat])


def _pixels_near(
    difference: Difference, center_px: Pair, reach_px: float, most: int
) -> tuple[Column, Column, Table]:
    """Positions and colours of pixels near a centre, of so many at most."""
    height, width = difference.shape[:2]
    y, x = np.mgrid[0:height, 0:width]
    near = np.flatnonzero(np.hypot(x - center_px[0], y - center_px[1]) < reach_px)
    if len(near) > most:  # drawn, as a regular grid would be blind to doubled pixels
        near = np.random.default_rng(0).choice(near, most, replace=False)
    color = difference.reshape(-1, 3)[near].astype(np.float64)
    return x.ravel()[near].astype(np.float64), y.ravel()[near].astype(np.float64), color


def _energy(difference: Difference) -> Energy:
    """How much each pixel is shaded, squared; dots and noise ignored."""
    smooth = cv2.GaussianBlur(cv2.medianBlur(difference, 5), (0, 0), 3)
    energy: Energy = ((smooth - np.median(smooth, (0, 1))) ** 2).sum(2)
    return energy


def _share_near(energy: Energy, center_px: Pair, reach_px: float) -> float:
    """Share of the frame's shading that lies near a centre; its frame ignored."""
    edge = max(1, min(energy.shape) // 24)
    y, x = np.mgrid[0 : energy.shape[0], 0 : energy.shape[1]]
    y, x, energy = (part[edge:-edge, edge:-edge] for part in (y, x, energy))
    near = np.hypot(x - center_px[0], y - center_px[1]) < reach_px
    return float(energy[near].sum() / max(energy.sum(), 1e-12))
