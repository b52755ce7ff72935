# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Where a ball touched, from its own shading: mends circles that were drawn by hand."""

from collections.abc import Iterable
from dataclasses import dataclass

import cv2
import numpy as np
from jaxtyping import Bool, Float32

from recon.arrays import Difference
from recon.labels.ball_fit import Column, Near, Parameters, fit_ball, unexplained
from recon.medians import PER_MAD, channel_medians
from sensor.dataset import BallLabel
from sensor.toml import Pair

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
PIXELS, ROUNDS, ENOUGH = 2000, 3, 1e-6
GLANCED, ENOUGH_GLANCED = 500, 1e-3
"""The same for a first look at each of several circles, in one round."""
HOPELESS = 0.5
"""Share of the best quality at that look; a circle below it is not the ball. With 0 all are fitted
to the end, and of 70 presses of two sets ``python -m validation.circles`` prints the same."""


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

    What a ball looks like ``recon.labels.ball_fit`` says; printed dots and dust are weighted down
    (Cauchy). A disc looks wider than this circle because the gel around it slopes too. Pixels must
    be square.

    Args:
        difference: frame minus background, in the gel plane.
        center_px: of the circle that was drawn.
        radius_px: of the circle that was drawn, good to a third.
        ball_radius_px: of the ball.
        reach: pixels up to this many drawn radii from the drawn centre are looked at.
    """
    start = (*center_px, radius_px)
    return _fitted(difference, _energy(difference), start, ball_radius_px, reach, glance=False)


def refit_center(
    difference: Difference, drawn: Drawn, ball_radius_px: float, reach: float
) -> Drawn:
    """The same circle, which nobody asks how well it explains the picture; arguments as above."""
    x, y, radius, _ = _contact(difference, drawn, ball_radius_px, reach, glance=False).parameters
    return float(x), float(y), float(radius)


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

    def fitted(start: Drawn, glance: bool) -> Circle:
        return _fitted(difference, energy, start, ball_radius_px, REACH, glance=glance)

    glanced = [fitted(start, glance=True) for start in starts]
    best = max((circle.quality for circle in glanced), default=0.0)
    return [
        circle if circle.quality < HOPELESS * best else fitted(start, glance=False)
        for circle, start in zip(glanced, starts, strict=True)
    ]


def _fitted(
    difference: Difference,
    energy: Energy,
    start: Drawn,
    ball_radius_px: float,
    reach: float,
    *,
    glance: bool,
) -> Circle:
    """A drawn circle fitted to the pixels near it, and how well its ball explains them."""
    contact = _contact(difference, start, ball_radius_px, reach, glance=glance)
    near, weight, error = contact.near, contact.weight, contact.error
    # Weighted alike, so that neither printed dots nor another object's outline pass as explained.
    left = float(((weight * error) ** 2).mean())
    signal = max(float((weight**2 * (near.color**2).sum(0)).mean()), 1e-12)
    center_x, center_y, radius, _ = contact.parameters
    center = (float(center_x), float(center_y))
    return Circle(
        center_px=center,
        radius_px=float(radius),
        quality=max(0.0, 1 - left / signal) * _share_near(energy, center, 2.2 * radius),
    )


@dataclass(frozen=True, kw_only=True)
class _Contact:
    """A ball's contact, fitted to the pixels near it."""

    parameters: Parameters
    near: Near
    weight: Column
    """Of each pixel, by its error."""
    error: Column


def _contact(
    difference: Difference, start: Drawn, ball_radius_px: float, reach: float, *, glance: bool
) -> _Contact:
    """A drawn circle fitted to the pixels near it."""
    pixels, rounds, enough = (GLANCED, 1, ENOUGH_GLANCED) if glance else (PIXELS, ROUNDS, ENOUGH)
    center_px, radius_px = start[:2], start[2]
    near = _pixels_near(difference, center_px, reach * radius_px, pixels)
    shift = FARTHEST_SHIFT * radius_px
    lowest = np.array([center_px[0] - shift, center_px[1] - shift, 0.4 * radius_px, np.log(0.5)])
    largest = min(1.8 * radius_px, LARGEST * ball_radius_px)
    highest = np.array([center_px[0] + shift, center_px[1] + shift, largest, np.log(radius_px)])
    first = np.array([*center_px, START * radius_px, np.log(radius_px / 4)])
    parameters = np.clip(first, lowest + 1e-6, highest - 1e-6)
    weight = np.ones(len(near.x_px))
    for _ in range(rounds):
        parameters = fit_ball(near, weight, ball_radius_px, parameters, (lowest, highest), enough)
        rest = unexplained(parameters, near, weight, ball_radius_px)
        error = np.sqrt((rest**2).sum(0)) / weight
        scale = max(PER_MAD * float(np.median(error)), 1e-9)
        weight = 1 / np.sqrt(1 + (error / (2 * scale)) ** 2)
    return _Contact(parameters=parameters, near=near, weight=weight, error=error)


def _pixels_near(difference: Difference, center_px: Pair, reach_px: float, most: int) -> Near:
    """Pixels near a centre, of so many at most."""
    width = difference.shape[1]
    near = np.flatnonzero(_within(difference.shape[:2], center_px, reach_px))
    if len(near) > most:  # drawn, as a regular grid would be blind to doubled pixels
        near = np.random.default_rng(0).choice(near, most, replace=False)
    y_px, x_px = (places.astype(np.float64) for places in np.divmod(near, width))
    color = np.ascontiguousarray(difference.reshape(-1, 3)[near].T, np.float64)
    return Near(x_px=x_px, y_px=y_px, color=color)


def _energy(difference: Difference) -> Energy:
    """How much each pixel is shaded, squared; dots and noise ignored."""
    smooth = cv2.GaussianBlur(cv2.medianBlur(difference, 5), (0, 0), 3)
    energy: Energy = ((smooth - channel_medians(smooth)) ** 2).sum(2)
    return energy


def _share_near(energy: Energy, center_px: Pair, reach_px: float) -> float:
    """Share of the frame's shading that lies near a centre; its frame ignored."""
    edge = max(1, min(energy.shape) // 24)
    near = _within(energy.shape, center_px, reach_px)[edge:-edge, edge:-edge]
    energy = energy[edge:-edge, edge:-edge]
    return float(energy[near].sum() / max(energy.sum(), 1e-12))


def _within(shape: tuple[int, ...], center_px: Pair, reach_px: float) -> Bool[np.ndarray, "h w"]:
    """Which pixels of a frame lie near a centre."""
    x, y = (np.arange(count) - center for count, center in zip(shape[::-1], center_px, strict=True))
    within: Bool[np.ndarray, "h w"] = np.sqrt(x**2 + (y**2)[:, None]) < reach_px
    return within
