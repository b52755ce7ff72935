# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Gradient errors, one number each, with an interval over whole presses."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from statistics import median
from typing import Literal

import numpy as np
from jaxtyping import Bool, Float, Float32, Int

from validation.intervals import Interval, bootstrap_intervals

PixelSet = Literal["contact+5%", "contact"]
PIXEL_SETS: tuple[PixelSet, ...] = ("contact+5%", "contact")
METRICS = ("gx_mae", "gy_mae", "theta_x_deg", "theta_y_deg")
LEAST_BENT = 1e-12
"""Sum of squares of normals' components, below which a truth has no curvature to compare with."""


@dataclass(frozen=True, kw_only=True)
class PressErrors:
    """Sums over the pixels of one press, from which any mean follows."""

    file: str
    absolute: Float[np.ndarray, "4"]
    """Sums of the absolute errors, in the order of ``METRICS``."""
    absolute_gradient: float
    """Sum over pixels of (\\|Gx\\| + \\|Gy\\|) / 2 of the truth."""
    curvature: float
    """Of the ball that the estimated slopes fit, in shares of the pressed ball's."""
    n_pixels: int


@dataclass(frozen=True, kw_only=True)
class Errors:
    """Mean absolute errors over the pixels of some presses."""

    values: Mapping[str, float]
    """By name, in the order of ``METRICS``."""
    ci95: Mapping[str, Interval | None]
    """Press-level bootstrap 95 % intervals; ``None`` each where too few presses were judged."""
    mean_abs_gradient: float
    curvature: float
    """The median press's."""
    n_pixels: int
    n_presses: int


def press_errors(
    file: str,
    estimated: Float32[np.ndarray, "n 2"],
    truth: Float32[np.ndarray, "n 2"],
    chosen: Bool[np.ndarray, " n"],
) -> PressErrors:
    """Errors of one press over the chosen pixels: of G, and of theta = atan(G) in degrees."""
    estimated, truth = estimated[chosen].astype(float), truth[chosen].astype(float)
    slope = np.abs(estimated - truth).sum(0)
    angle = np.degrees(np.abs(np.arctan(estimated) - np.arctan(truth))).sum(0)
    return PressErrors(
        file=file,
        absolute=np.concatenate([slope, angle]),
        absolute_gradient=float(np.abs(truth).mean(1).sum()),
        curvature=fitted_curvature(estimated, truth),
        n_pixels=int(chosen.sum()),
    )


def fitted_curvature(estimated: Float[np.ndarray, "n 2"], truth: Float[np.ndarray, "n 2"]) -> float:
    """The curvature of the ball that slopes fit, in shares of the one whose slopes are the truth.

    Across a sphere the normal's component along an axis is ``-offset / R``, so that those of two
    spheres lie on a straight line through each other; its slope is fitted. 0 where nothing bends.
    """
    found, true = (
        slopes / np.sqrt(1 + (slopes**2).sum(1, keepdims=True)) for slopes in (estimated, truth)
    )
    found, true = found - found.mean(0), true - true.mean(0)
    return float((found * true).sum() / max(float((true**2).sum()), LEAST_BENT))


def mean_errors(presses: Sequence[PressErrors], seed: int) -> Errors:
    """Means over all pixels of the presses, with press-level bootstrap intervals."""
    sums = np.stack([press.absolute for press in presses])
    counts = np.array([press.n_pixels for press in presses])
    means = sums.sum(0) / counts.sum()
    return Errors(
        values={name: float(mean) for name, mean in zip(METRICS, means, strict=True)},
        ci95=_bootstrapped(sums, counts, seed),
        mean_abs_gradient=float(sum(press.absolute_gradient for press in presses) / counts.sum()),
        curvature=median(press.curvature for press in presses),
        n_pixels=int(counts.sum()),
        n_presses=len(presses),
    )


def _bootstrapped(
    sums: Float[np.ndarray, "p 4"], counts: Int[np.ndarray, " p"], seed: int
) -> dict[str, Interval | None]:
    """Intervals of the means over presses, by name."""
    found = bootstrap_intervals(
        lambda drawn: drawn @ sums / (drawn @ counts)[:, None], len(sums), seed
    )
    return dict.fromkeys(METRICS) if found is None else dict(zip(METRICS, found, strict=True))
