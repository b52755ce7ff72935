# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Are the discs of a ball round in the unwarped picture? Then the unwarp is right where they lie.

A ball's skin is seen through a stretch ``exp(s/2)`` along x, ``exp(-s/2)`` along y and a shear
``t``; centre, radius, fade, s and t are fitted to its colours, which are taken as a polynomial of
the normal and solved for at each step (variable projection; Golub and Pereyra, 2003). Lights of
different strength make a disc uneven, not oval, and do not disturb the fit.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares

from recon.labels.ball_fit import without
from recon.pixels import BallPress

PRESSES = 10
"""Fitted, spread over the set."""
PIXELS = 700
"""Drawn from each."""
REACH = 1.8
"""Contact radii that are looked at."""
LARGEST = 0.4
"""Stretch and shear; beyond, nothing is a disc."""


@dataclass(frozen=True, kw_only=True)
class Roundness:
    """How far discs are from round, the median of presses."""

    stretch: float
    """Share by which they are too long along x for their length along y."""
    shear: float
    """Share by which they lean."""

    @property
    def out_of_round(self) -> float:
        """Of a disc's diameter: its longest less its shortest."""
        return float(np.hypot(self.stretch, self.shear))


def roundness(presses: Sequence[BallPress], seed: int) -> Roundness | None:
    """Of presses whose discs lie wholly inside; ``None`` where none does."""
    whole = [press for press in presses if _is_whole(press)]
    step = max(1, len(whole) // PRESSES)
    found = np.array([_stretch_shear(press, seed) for press in whole[::step][:PRESSES]])
    if not len(found):
        return None
    stretch, shear = np.median(found, axis=0)
    return Roundness(stretch=float(stretch), shear=float(shear))


def _is_whole(press: BallPress) -> bool:
    x_mm, y_mm = press.offsets_mm
    edges_mm = -x_mm[0, 0], x_mm[0, -1], -y_mm[0, 0], y_mm[-1, 0]
    return bool(min(edges_mm) > 1.1 * press.contact_radius_mm)


def _stretch_shear(press: BallPress, seed: int) -> tuple[float, float]:
    radius = press.contact_radius_px
    x, y, color = _pixels(press, seed)
    ball_px = press.ball_radius_mm * radius / press.contact_radius_mm
    steepest = 0.95 * ball_px
    start = np.array([0.0, 0.0, min(radius, 0.9 * steepest), np.log(radius / 4), 0.0, 0.0])
    low = np.array([-radius / 2, -radius / 2, radius / 3, np.log(0.5), -LARGEST, -LARGEST])
    high = np.array([radius / 2, radius / 2, steepest, np.log(2 * radius), LARGEST, LARGEST])
    found = least_squares(
        _unexplained,
        start,
        bounds=(low, high),
        x_scale=[1, 1, 1, 0.3, 0.05, 0.05],
        diff_step=1e-3,
        loss="soft_l1",
        f_scale=0.02,
        max_nfev=30,
        args=(x, y, color, ball_px),
    )
    return float(found.x[4]), float(found.x[5])


def _pixels(press: BallPress, seed: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Places from the centre and colours, a row each, of some pixels near a contact; dots left out.

    Places are in square pixels, as large as the frame's own are.
    """
    pitch_mm = press.contact_radius_mm / press.contact_radius_px
    x, y = (offset_mm / pitch_mm for offset_mm in press.offsets_mm)
    near = np.hypot(x, y) < REACH * press.contact_radius_px
    if press.hidden is not None:
        near &= ~press.hidden
    places = np.flatnonzero(near)
    if len(places) > PIXELS:
        places = np.random.default_rng(seed).choice(places, PIXELS, replace=False)
    color = np.ascontiguousarray(press.difference.reshape(-1, 3)[places].T, np.float64)
    return x.ravel()[places], y.ravel()[places], color


# Called thousands of times, so its shapes are not checked at every call.
def _unexplained(
    parameters: np.ndarray, x: np.ndarray, y: np.ndarray, color: np.ndarray, ball_px: float
) -> np.ndarray:
    """Colours less their projection on the shading's terms, in one row."""
    center_x, center_y, radius, log_fade, stretch, shear = parameters
    x, y = x - center_x, y - center_y
    dx = np.exp(-stretch / 2) * x - shear / 2 * y
    dy = np.exp(stretch / 2) * y - shear / 2 * x
    distance = np.sqrt(dx * dx + dy * dy) + 1e-9
    inside = np.minimum(distance, radius)
    slope = inside / np.sqrt(ball_px**2 - inside * inside)
    slope = slope * np.exp(-np.maximum(distance - radius, 0) / np.exp(log_fade))
    sine = slope / np.sqrt(1 + slope * slope)
    nx, ny = dx / distance * sine, dy / distance * sine
    flat = sine * sine
    terms = np.stack(
        [np.ones_like(nx), nx, ny, nx * ny, nx * nx - ny * ny, flat, nx * flat, ny * flat]
    )
    return without(color, terms).ravel()
