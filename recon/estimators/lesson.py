# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""What the default estimator learns from one press: contact, the elastic collar beside it, zeros.

Outside the contact circle, of radius a, an elastic half-space hangs free with the slope (Johnson,
Contact Mechanics, 1985, section 4.2; r is the distance over a)

    slope(r) = slope(1) (2 r / pi) (asin(1/r) - sqrt(1 - 1/r^2) / r),

which falls steeply at first and then ever more slowly. A circle drawn round the visible disc takes
that collar for contact; one that lets the slope fade at once is too small. Both bias every slope,
so the circle's radius is fitted anew here, with that collar stretched to suit the gel. The collar
is a lesson as well: colours there are darker than in the contact, as the dent keeps some light
away, and would be taken for steeper slopes by who has never seen them. How much of it is taught
``default_fit`` decides: a circle's collar is a fit to colours, which scatter farther than skin
slopes. Beside a ball pressed in so deep that none is fitted, gel is flat sooner.
"""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float
from scipy.optimize import least_squares

from recon.estimators.default import prepared_colors
from recon.pixels import (
    DEEPEST,
    RIM_PX,
    STEEPEST,
    BallPress,
    Pixels,
    blank_at,
    cap_height_mm,
    positions,
)

PIXELS = 1500
"""Most pixels from a press's contact, and from its collar: neighbours say nearly the same."""
FEW = 15
"""Up to so many presses are few, and each teaches more pixels."""
PIXELS_OF_FEW = 6000
"""The same for one of few presses, whose grain would else be learnt by heart."""
FLAT_FROM = 2.8
"""Contact radii from the centre beyond which gel is taught as flat: a collar has 6 % of the rim's
slope there."""
DEEP_FLAT_FROM = 1.8
"""The same beside balls pressed in deeper than ``DEEPEST``: their collars are short for them. Where
others fill the frame, gel is taught as flat from here on, at 15 % of the rim's slope, or nowhere.
"""
LOOKED_AT = 1500
REACH = 2.5
"""Contact radii from the centre up to which the circle is fitted."""
SMALLEST, LARGEST = 0.75, 1.35
"""Bounds of the fitted radius, in labelled ones."""
STRETCH = (0.3, 10.0)
"""Bounds of the collar's stretch; gel that is thin against its contact rises faster than a
half-space."""


def lesson_pixels(press: BallPress, index: int, seed: int, presses: int) -> Pixels:
    """The pixels to learn from of one of so many presses.

    Settled colours, then what lies around them; the press' index and the seed draw the pixels.
    """
    most = PIXELS_OF_FEW if presses <= FEW else PIXELS
    seen = prepared_colors(press.difference)
    contact_fit = fit_elastic(replace(press, difference=seen[..., :3]))
    radius_mm = contact_fit.radius_mm
    x_mm, y_mm = press.offsets_mm
    distance_mm = np.hypot(x_mm, y_mm)
    ball_mm = press.ball_radius_mm
    random = np.random.default_rng([seed, index])
    contact = np.flatnonzero(distance_mm < min(radius_mm, STEEPEST * ball_mm))
    if len(contact) > most:
        contact = np.sort(random.choice(contact, most, replace=False))
    clear = DEEP_FLAT_FROM if contact_fit.stretch is None else FLAT_FROM
    far_mm = max(float(np.quantile(distance_mm, 0.8)), DEEP_FLAT_FROM * radius_mm)
    flat_from_mm = min(clear * radius_mm, far_mm)
    flat = np.flatnonzero(distance_mm >= flat_from_mm)
    flat = np.sort(random.choice(flat, min(len(flat), max(1, len(contact))), replace=False))
    collar = np.zeros(0, np.intp)
    if contact_fit.stretch is not None:
        collar = np.flatnonzero((distance_mm > radius_mm) & (distance_mm < flat_from_mm))
        collar = np.sort(random.choice(collar, min(len(collar), most), replace=False))
    taken = np.concatenate([contact, flat, collar])
    counts = len(contact), len(flat), len(collar)
    is_contact = np.repeat((True, False, False), counts)
    is_flat = np.repeat((False, True, False), counts)
    away_mm = distance_mm.ravel()[taken]
    slope = contact_fit.slopes(away_mm, ball_mm) / np.maximum(away_mm, 1e-9)
    cap_mm = cap_height_mm(radius_mm, ball_mm)
    gradient = -np.stack([x_mm.ravel()[taken], y_mm.ravel()[taken]], 1) * slope[:, None]
    return Pixels(
        color=seen.reshape(-1, seen.shape[2])[taken],
        position=positions(press.size_px).reshape(-1, 2)[taken],
        gradient=np.where(is_flat[:, None], 0, gradient).astype(np.float32),
        contact=is_contact,
        press=np.full(len(taken), index, np.int32),
        place=taken.astype(np.int32),
        hidden=np.zeros(len(taken), bool) if press.hidden is None else press.hidden.ravel()[taken],
        blank=blank_at(press, taken),
        collar=np.full(len(taken), contact_fit.collar_mm / press.shorter_side_mm, np.float32),
        cap=np.full(len(taken), cap_mm / press.shorter_side_mm, np.float32),
    )


@dataclass(frozen=True, kw_only=True)
class ElasticContact:
    """A ball's contact, and how fast the gel beside it rises."""

    radius_mm: float
    stretch: float | None
    """Of the half-space's collar toward the rim; ``None`` where none was fitted."""

    @property
    def collar_mm(self) -> float:
        """The length on which the collar rises as a half-space's does on the contact's radius."""
        return np.nan if self.stretch is None else self.radius_mm / self.stretch

    def slopes(
        self, away_mm: Float[np.ndarray, " n"], ball_radius_mm: float
    ) -> Float[np.ndarray, " n"]:
        """Steepness at some distances from the centre: the ball's, then the fading collar's."""
        inside = away_mm if self.stretch is None else np.minimum(away_mm, self.radius_mm)
        height = np.sqrt(np.maximum(ball_radius_mm**2 - inside**2, ball_radius_mm**2 / 100))
        beyond = np.maximum(away_mm / self.radius_mm - 1, 0) * (self.stretch or 0)
        return inside / height * elastic_fade(1 + beyond)


def fit_elastic(press: BallPress) -> ElasticContact:
    """The contact for which ball and elastic collar explain the shading best."""
    x_mm, y_mm = press.offsets_mm
    labelled = press.contact_radius_mm
    if labelled > DEEPEST * press.ball_radius_mm:
        radius_mm = labelled * (1 - RIM_PX / press.contact_radius_px)
        return ElasticContact(radius_mm=radius_mm, stretch=None)
    near = np.flatnonzero(np.hypot(x_mm, y_mm) < REACH * labelled)
    if len(near) > LOOKED_AT:
        near = np.random.default_rng(0).choice(near, LOOKED_AT, replace=False)
    seen = press.difference.reshape(-1, 3)[near].astype(np.float64)
    x, y = x_mm.ravel()[near], y_mm.ravel()[near]
    widest = min(LARGEST * labelled, 0.95 * press.ball_radius_mm)
    lowest = np.array([-labelled / 4, -labelled / 4, SMALLEST * labelled, np.log(STRETCH[0])])
    highest = np.array([labelled / 4, labelled / 4, widest, np.log(STRETCH[1])])
    start = np.clip([0, 0, labelled, 0], lowest + 1e-6, highest - 1e-6)

    def unexplained(parameters: Float[np.ndarray, "4"]) -> Float[np.ndarray, " n"]:
        terms = _shading_terms(x, y, parameters, press.ball_radius_mm)
        shares = np.linalg.lstsq(terms.T @ terms, terms.T @ seen, rcond=None)[0]
        return (seen - terms @ shares).ravel()

    scale = max(float(seen.std()), 1e-6)
    fitted = least_squares(
        lambda parameters: unexplained(parameters) / scale,
        start,
        bounds=(lowest, highest),
        x_scale=[labelled / 10, labelled / 10, labelled / 10, 0.3],
        loss="soft_l1",
        f_scale=0.3,
        diff_step=1e-3,
        max_nfev=30,
    )
    return ElasticContact(radius_mm=float(fitted.x[2]), stretch=float(np.exp(fitted.x[3])))


def elastic_fade(ratio: Float[np.ndarray, "*n"]) -> Float[np.ndarray, "*n"]:
    """Slope of the free gel over the slope at the rim, at ``ratio`` contact radii (1 inside)."""
    inverse = 1 / np.maximum(ratio, 1.0)
    return 2 / np.pi / inverse * (np.arcsin(inverse) - inverse * np.sqrt(1 - inverse**2))


def _shading_terms(
    x_mm: Float[np.ndarray, " n"],
    y_mm: Float[np.ndarray, " n"],
    parameters: Float[np.ndarray, "4"],
    ball_radius_mm: float,
) -> Float[np.ndarray, "n 7"]:
    """Colours are taken as a mix of these: the normal's components up to the third power.

    Parameters are the centre, the contact radius and the logarithm of the collar's stretch.
    """
    center_x, center_y, radius, log_stretch = parameters
    dx, dy = x_mm - center_x, y_mm - center_y
    distance = np.hypot(dx, dy) + 1e-9
    inside = np.minimum(distance, radius)
    slope = inside / np.sqrt(ball_radius_mm**2 - inside**2)
    slope = slope * elastic_fade(1 + np.maximum(distance / radius - 1, 0) * np.exp(log_stretch))
    sine = slope / np.sqrt(1 + slope**2)
    nx, ny = -dx / distance * sine, -dy / distance * sine
    return np.stack([nx, ny, nx * ny, nx**2 - ny**2, sine**2, nx * sine**2, ny * sine**2], 1)
