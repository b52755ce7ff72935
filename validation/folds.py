# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Estimators beside the presses that they have not learnt from."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from recon.estimators import GradientEstimator, fit_estimator, lesson_of
from recon.pixels import BallPress
from validation.splits import splits


@dataclass(frozen=True, kw_only=True)
class Fold:
    """An estimator that has learnt from some presses of a dataset, and the others."""

    estimator: GradientEstimator
    test: tuple[int, ...]
    """Places, among the dataset's usable presses, of those that it has not learnt from."""


def fit_folds(
    presses: Sequence[BallPress], estimator: str, channels: str, *, folds: int, seed: int
) -> Iterator[Fold]:
    """Fit an estimator to the train presses of each split.

    Args:
        presses: the usable ones of a dataset, in order.
        estimator: its name.
        channels: that it looks at.
        folds: as for the error table.
        seed: of the splits, the drawn pixels and the training.

    Raises:
        WedgeError: there are too few presses.
    """
    for split in splits(len(presses), folds, seed):
        fitted = fit_presses(presses, split.train, estimator, channels, seed)
        yield Fold(estimator=fitted, test=split.test)


def fit_presses(
    presses: Sequence[BallPress], chosen: Sequence[int], estimator: str, channels: str, seed: int
) -> GradientEstimator:
    """Fit the estimator of that name to some presses of a dataset."""
    return fit_estimator(estimator, lesson_of(estimator, presses, chosen, seed), channels, seed)
