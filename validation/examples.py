# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Presses that an estimator has not learnt from, with everything that pictures of them need."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from jaxtyping import Float32

from recon.arrays import GradientField
from recon.calibration import lit_channels
from recon.contact import boundary_of, contact_mask
from recon.estimators import GradientEstimator, fit_estimator, gradient_field
from recon.images import read_frame
from recon.lights import unseen_axis
from recon.pipeline import complete_gradient, depth_map
from recon.pixels import BallPress, Pixels, join, label_pixels
from recon.presses import PressSet, read_presses
from sensor.dataset import Dataset, read_dataset
from sensor.unit import MissingAxis
from validation.depth import DepthErrors, cap_of, judge_depth, true_depth
from validation.figures.ball_press import PressPicture
from validation.splits import splits

RANKS = {"median": 0.5, "worst": 1.0}
"""Places in the order of depth RMSE, 0 the best."""
TRUTH_NAMES = {"ball cap": "ideal ball", "truth file": "known depth"}


@dataclass(frozen=True, kw_only=True)
class Example:
    """One press as reconstructed."""

    picture: PressPicture
    depth: DepthErrors
    rank: str = "one"
    """Which of its set it is, in words."""


@dataclass(frozen=True, kw_only=True)
class HeldOut:
    """What an estimator makes of the presses that a split holds out."""

    pixels: Pixels
    estimated: Float32[np.ndarray, "n 2"]
    """Gradients at those pixels."""
    n_presses: int
    examples: tuple[Example, ...]


def held_out(folder: Path, estimator: str, *, folds: int, seed: int) -> HeldOut:
    """Fit on the first split of the error table and look at the presses that it holds out.

    The examples are the median press and the worst, by depth RMSE.

    Args:
        folder: the dataset.
        estimator: its name.
        folds: as for the error table.
        seed: as for the error table.

    Raises:
        WedgeError: the dataset cannot be used.
    """
    dataset = read_dataset(folder)
    presses = read_presses(dataset)
    split = splits(len(presses.presses), folds, seed)[0]
    channels, missing = lit_channels(dataset)
    train = join([label_pixels(presses.presses[i], i, seed) for i in split.train])
    fitted = fit_estimator(estimator, train, channels, seed)
    pixels = join([label_pixels(presses.presses[i], i, seed) for i in split.test])
    lights_deg = dataset.card.lights_deg

    def rmse_mm(index: int) -> float:
        press = presses.presses[index]
        gradient = full_gradient(fitted, press, missing, lights_deg)
        return judge_depth(gradient, contact_mask(press.difference), press, folder).rmse_mm

    ranked = sorted(split.test, key=rmse_mm)
    chosen = {ranked[round(RANKS[rank] * (len(ranked) - 1))]: rank for rank in RANKS}
    return HeldOut(
        pixels=pixels,
        estimated=fitted.slopes(pixels.color, pixels.position),
        n_presses=len(split.test),
        examples=tuple(
            replace(
                example(fitted, missing, dataset, presses, presses.presses[i]),
                rank=f"the {rank} by depth error",
            )
            for i, rank in chosen.items()
        ),
    )


def example(
    estimator: GradientEstimator,
    missing: MissingAxis,
    dataset: Dataset,
    presses: PressSet,
    press: BallPress,
) -> Example:
    """Reconstruct one press of a dataset beside its truth."""
    gradient = full_gradient(estimator, press, missing, dataset.card.lights_deg)
    contact = contact_mask(press.difference)
    depth_mm = depth_map(gradient, contact, boundary_of(contact), press.mm_per_px)
    truth = true_depth(depth_mm, press, dataset.folder)
    known = np.where(truth.depth_mm > 0, truth.depth_mm + truth.rim_mm, np.nan)
    return Example(
        picture=PressPicture(
            title=f"{press.file} of {dataset.card.name}",
            frame=presses.unwarp(read_frame(dataset.folder, press.file)),
            difference=press.difference,
            gradient=gradient,
            gradient_truth=cap_of(press).gradient,
            depth_mm=depth_mm,
            depth_truth_mm=known,
            truth=TRUTH_NAMES[truth.name],
            center_px=press.center_px,
            contact_radius_mm=press.contact_radius_mm,
            mm_per_px=press.mm_per_px,
        ),
        depth=judge_depth(gradient, contact, press, dataset.folder),
    )


def full_gradient(
    estimator: GradientEstimator,
    press: BallPress,
    missing: MissingAxis,
    lights_deg: Mapping[str, float] | None,
) -> GradientField:
    """The gradient field of a press, its unseen axis filled in where there is one."""
    return complete_gradient(
        gradient_field(estimator, press.difference),
        missing,
        unseen_axis(lights_deg, estimator.channels),
        press.mm_per_px,
    )


def label_shift_deg(
    gradient: Float32[np.ndarray, "n 2"], ball_radius_mm: float, shift_mm: float
) -> float:
    """How far a ball's true theta_x moves, on average, when its centre is moved along x.

    A label that is off by so much makes an exact estimator look that wrong.
    """
    steepness = np.sqrt(1 + np.sum(gradient.astype(float) ** 2, 1))
    x_mm, y_mm = (-ball_radius_mm * gradient[:, axis] / steepness for axis in (0, 1))
    height_mm = np.sqrt(np.maximum(ball_radius_mm**2 - (x_mm - shift_mm) ** 2 - y_mm**2, 1e-12))
    moved = np.arctan(-(x_mm - shift_mm) / height_mm) - np.arctan(gradient[:, 0])
    return float(np.degrees(np.abs(moved).mean()))
