# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Presses that an estimator has not learnt from, with everything that pictures of them need."""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from jaxtyping import Float32

from recon.arrays import DepthMap, Difference, GradientField, Unwarped
from recon.calibration import lit_channels
from recon.estimators import GradientEstimator
from recon.images import read_frame
from recon.pixels import BallPress, Pixels, join, label_pixels
from recon.presses import PressSet, read_presses
from sensor.dataset import Dataset, read_dataset
from sensor.toml import Pair
from sensor.unit import MissingAxis
from validation.depth import DepthErrors, cap_of, depth_errors, true_depth
from validation.folds import Fold
from validation.reconstructed import reconstruct_press, slopes_in
from validation.side_by_side import Unseen

RANKS = {"median": 0.5, "worst": 1.0}
"""Places in the order of depth RMSE, 0 the best."""
TRUTH_NAMES = {"ball cap": "ideal ball", "truth file": "known depth"}


@dataclass(frozen=True, kw_only=True)
class PressPicture:
    """What ``figures.ball_press`` shows; all arrays cover the same pixels."""

    title: str
    frame: Unwarped
    difference: Difference
    gradient: GradientField
    gradient_truth: GradientField
    depth_mm: DepthMap
    depth_truth_mm: DepthMap
    """NaN where nothing is known, outside the contact."""
    truth: str
    """What the true depth is, for the legend."""
    center_px: Pair
    contact_radius_mm: float
    mm_per_px: Pair


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
    ball_radius_mm: Float32[np.ndarray, " n"]
    """Of the ball that pressed at each."""
    estimated: Float32[np.ndarray, "n 2"]
    """Gradients at those pixels."""
    half_width: Float32[np.ndarray, "n 2"] | None
    """Of their 90 % intervals, where the estimator tells one."""
    estimator: str
    n_presses: int
    examples: tuple[Example, ...]

    @property
    def unseen(self) -> Unseen:
        """Its contact pixels, to be set beside other estimators'."""
        contact = self.pixels.contact
        return Unseen(
            estimator=self.estimator,
            truth=self.pixels.gradient[contact],
            estimated=self.estimated[contact],
            half_width=None if self.half_width is None else self.half_width[contact],
            n_presses=self.n_presses,
        )


def held_out(folder: Path, fold: Fold, seed: int) -> HeldOut:
    """Look at the presses that an estimator has not learnt from.

    The examples are the median press and the worst, by depth RMSE.

    Args:
        folder: the dataset.
        fold: an estimator of all lit colours, and the presses to look at.
        seed: of the drawn pixels.

    Raises:
        WedgeError: the dataset cannot be used.
    """
    dataset = read_dataset(folder)
    presses = read_presses(dataset)
    fitted, (_, missing) = fold.estimator, lit_channels(dataset)
    judged = [(presses.presses[i], label_pixels(presses.presses[i], i, seed)) for i in fold.test]
    estimated, rmse_mm = [], {}
    for index, (press, pixels) in zip(fold.test, judged, strict=True):
        found = reconstruct_press(press, fitted, missing, dataset.card.lights_deg)
        estimated.append(slopes_in(found, fitted, pixels))
        rmse_mm[index] = depth_errors(found.depth_mm, press, folder).rmse_mm
    ranked = sorted(fold.test, key=rmse_mm.__getitem__)
    chosen = {ranked[round(RANKS[rank] * (len(ranked) - 1))]: rank for rank in RANKS}
    return HeldOut(
        pixels=join([pixels for _, pixels in judged]),
        ball_radius_mm=np.concatenate(
            [np.full(len(pixels), press.ball_radius_mm, np.float32) for press, pixels in judged]
        ),
        estimated=np.concatenate(estimated),
        half_width=fitted.half_width(np.concatenate(estimated)),
        estimator=fitted.name,
        n_presses=len(fold.test),
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
    found = reconstruct_press(press, estimator, missing, dataset.card.lights_deg)
    truth = true_depth(found.depth_mm, press, dataset.folder)
    known = np.where(truth.contact, truth.depth_mm + truth.rim_mm, np.nan)
    return Example(
        picture=PressPicture(
            title=f"{press.file} of {dataset.card.name}",
            frame=presses.unwarp(read_frame(dataset.folder, press.file)),
            difference=press.difference,
            gradient=found.gradient,
            gradient_truth=cap_of(press).gradient,
            depth_mm=found.depth_mm,
            depth_truth_mm=known,
            truth=TRUTH_NAMES[truth.name],
            center_px=press.center_px,
            contact_radius_mm=press.contact_radius_mm,
            mm_per_px=press.mm_per_px,
        ),
        depth=depth_errors(found.depth_mm, press, dataset.folder),
    )
