# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Estimators on the same contact pixels of presses that none of them has learnt from."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float, Float32

from recon.calibration import lit_channels
from recon.pixels import label_pixels
from recon.presses import LeftOut, press_reader, sifted
from sensor.dataset import read_dataset
from validation.folds import Fold
from validation.reconstructed import slopes_of

LEAST_PIXELS = 10
"""In a bin that is shown."""


@dataclass(frozen=True, kw_only=True)
class Unseen:
    """What an estimator says of contact pixels it has not learnt from."""

    estimator: str
    truth: Float32[np.ndarray, "n 2"]
    estimated: Float32[np.ndarray, "n 2"]
    half_width: Float32[np.ndarray, "n 2"] | None
    """Of its 90 % interval, where it tells one."""
    n_presses: int

    @property
    def error_deg(self) -> Float[np.ndarray, " n"]:
        """Mean of the errors of theta_x and theta_y."""
        apart = np.arctan(self.estimated.astype(float)) - np.arctan(self.truth.astype(float))
        return np.degrees(np.abs(apart)).mean(1)

    @property
    def steepness(self) -> Float[np.ndarray, " n"]:
        """|G| of the truth."""
        return np.linalg.norm(self.truth.astype(float), axis=1)


def unseen_slopes(folder: Path, fold: Fold, seed: int) -> Unseen:
    """What an estimator says of the contacts that it has not learnt from.

    Args:
        folder: the dataset.
        fold: an estimator of all lit colours, and the presses to look at.
        seed: of the drawn pixels.

    Raises:
        WedgeError: the dataset cannot be used.
    """
    dataset = read_dataset(folder)
    lights_deg, (_, missing) = dataset.card.lights_deg, lit_channels(dataset)
    reader = press_reader(dataset)  # few frames in memory: other work goes on beside this
    labels = [
        label
        for label, found in zip(dataset.labels, sifted(reader), strict=True)
        if not isinstance(found, LeftOut)
    ]
    truth, estimated = [], []
    for index in fold.test:
        press = reader.read(labels[index])
        pixels = label_pixels(press, index, seed)
        pixels = pixels[pixels.contact]
        truth.append(pixels.gradient)
        estimated.append(slopes_of(fold.estimator, press, pixels, missing, lights_deg))
    return Unseen(
        estimator=fold.estimator.name,
        truth=np.concatenate(truth),
        estimated=np.concatenate(estimated),
        half_width=fold.estimator.half_width(np.concatenate(estimated)),
        n_presses=len(fold.test),
    )


def error_map_deg(unseen: Unseen, bins: int, reach: float) -> Float[np.ndarray, "b b"]:
    """Mean angle error by the direction in which the true skin faces, NaN where little was seen.

    Rows and columns are the normal's components along y and x, from ``-reach`` to ``reach``: a
    ball's contact as it is seen, whatever its size.
    """
    truth = unseen.truth.astype(float)
    facing = -truth / np.sqrt(1 + (truth**2).sum(1, keepdims=True))
    edges = np.linspace(-reach, reach, bins + 1)
    x, y = facing.T
    count = np.histogram2d(y, x, bins=(edges, edges))[0]
    total = np.histogram2d(y, x, bins=(edges, edges), weights=unseen.error_deg)[0]
    return np.where(count >= LEAST_PIXELS, total / np.maximum(count, 1), np.nan)


def by_steepness(
    unseen: Unseen, values: Float[np.ndarray, " n"], edges: Float[np.ndarray, " e"]
) -> Float[np.ndarray, " b"]:
    """Mean of some values between each two edges of |G|, NaN where little was seen."""
    count = np.histogram(unseen.steepness, edges)[0]
    total = np.histogram(unseen.steepness, edges, weights=values)[0]
    return np.where(count >= LEAST_PIXELS, total / np.maximum(count, 1), np.nan)


def covered(unseen: Unseen) -> Float[np.ndarray, " n"] | None:
    """Share of a pixel's two slopes whose truth lies inside the 90 % interval."""
    if unseen.half_width is None:
        return None
    return (np.abs(unseen.estimated - unseen.truth) <= unseen.half_width).mean(1)
