# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Which presses teach and which judge: always whole presses, drawn with a seed."""

from dataclasses import dataclass

import numpy as np

from sensor.errors import WedgeError

PAPER_TRAIN, PAPER_TEST = 32, 8
SHARE_OF_TRAIN = 0.8


@dataclass(frozen=True, kw_only=True)
class Split:
    """Indices of presses."""

    train: tuple[int, ...]
    test: tuple[int, ...]


def refuse_folds(folds: int) -> None:
    """Refuse a number of folds that no set could be split into.

    Raises:
        WedgeError: it is below 1.
    """
    if folds < 1:
        raise WedgeError(f"--folds {folds} must be at least 1.")


def splits(count: int, folds: int, seed: int) -> tuple[Split, ...]:
    """Splits of ``count`` presses.

    Args:
        count: number of presses.
        folds: 1 for the paper's single split (32 train and 8 test where there are 40 or more,
            80/20 below that); more for cross-validation, in which every press is judged once.
        seed: of the order.

    Raises:
        WedgeError: there are too few presses.
    """
    refuse_folds(folds)
    if count < max(2, folds):
        raise WedgeError(
            f"{count} usable press{'es' if count != 1 else ''} cannot be split by press into "
            f"{'train and test' if folds == 1 else f'{folds} folds'}: press the ball more often."
        )
    order = [int(index) for index in np.random.default_rng(seed).permutation(count)]
    if folds == 1:
        enough = count >= PAPER_TRAIN + PAPER_TEST
        train = PAPER_TRAIN if enough else min(count - 1, round(SHARE_OF_TRAIN * count))
        test = PAPER_TEST if enough else count - train
        return (_split(order[:train], order[train : train + test]),)
    parts = [order[start::folds] for start in range(folds)]
    return tuple(
        _split([i for j, part in enumerate(parts) if j != k for i in part], parts[k])
        for k in range(folds)
    )


def _split(train: list[int], test: list[int]) -> Split:
    return Split(train=tuple(sorted(train)), test=tuple(sorted(test)))
