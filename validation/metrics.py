# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Gradient errors, one number each, with an interval over whole presses."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from jaxtyping import Bool, Float, Float32, Int

from validation.intervals import Interval, bootstrap_intervals

PixelSet = Literal["contact+5%", "contact"]
PIXEL_SETS: tuple[PixelSet, ...] = ("contact+5%", "contact")
METRICS = ("gx_mae", "gy_mae", "theta_x_deg", "theta_y_deg")


@dataclass(frozen=True, kw_only=True)
class PressErrors:
    """Sums over the pixels of one press, from which any mean follows."""

    file: str
    absolute: Float[np.ndarray, "4"]
    """Sums of the absolute errors, in the order of ``METRICS``."""
    absolute_gradient: float
    """Sum over pixels of (\\|Gx\\| + \\|Gy\\|) / 2 of the truth."""
    n_pixels: int


@dataclass(frozen=True, kw_only=True)
class Errors:
    """Mean absolute errors over the pixels of some presses."""

    values: Mapping[str, float]
    """By name, in the order of ``METRICS``."""
    ci95: Mapping[str, Interval | None]
    """Press-level bootstrap 95 % intervals; ``None`` each where too few presses were judged."""
    mean_abs_gradient: float
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
        n_pixels=int(chosen.sum()),
    )


def mean_errors(presses: Sequence[PressErrors], seed: int) -> Errors:
    """Means over all pixels of the presses, with press-level bootstrap intervals."""
    sums = np.stack([press.absolute for press in presses])
    counts = np.array([press.n_pixels for press in presses])
    means = sums.sum(0) / counts.sum()
    return Errors(
        values={name: float(mean) for name, mean in zip(METRICS, means, strict=True)},
        ci95=_bootstrapped(sums, counts, seed),
        mean_abs_gradient=float(sum(press.absolute_gradient for press in presses) / counts.sum()),
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
