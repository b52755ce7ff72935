# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""What dots cost: slopes under them, filled in, against slopes of clear gel beside them.

The same pixels without dots nearby: a pixel under a dot is compared with pixels of other presses
at the same distance from the ball's centre, in contact radii, that lie farther than ``CLEAR_PX``
from every dot. Presses are judged by estimators that have not seen them.
``python -m validation.markers DATASET`` fits by five folds and prints both.
"""

import argparse
from collections.abc import Mapping
from dataclasses import dataclass

import cv2
import numpy as np
from jaxtyping import Float, Int

from recon.arrays import GradientField
from recon.estimators import GradientEstimator, as_labelled, gradient_field
from recon.markers.filling import fill_gradients
from recon.pixels import BallPress, label_pixels
from recon.presses import read_presses
from sensor.arguments import ending_in_a_sentence
from sensor.dataset import Dataset, read_dataset
from sensor.errors import WedgeError
from validation.datasets import dataset_folder
from validation.folds import fit_folds

SEED, FOLDS = 0, 5
CLEAR_PX = 2
FILLED_BY = ("zero", "nearest", "harmonic", "biharmonic", "surface")
RINGS = 12
"""Distances from the ball's centre are compared in so many steps."""


@dataclass(frozen=True, kw_only=True)
class DotCost:
    """Mean absolute slope errors in the contact, mm/mm."""

    clear: float
    """Pixels without dots nearby, as far from the ball's centre as those under dots."""
    filled: dict[str, float]
    """Pixels under dots, by how they were filled."""
    presses: int
    pixels: int
    """Under dots, in contacts, at distances where there is gel without dots nearby as well."""


def dot_cost(dataset: Dataset, *, estimator: str = "mlp") -> DotCost:
    """Judge every press of a marker gel by an estimator that has not seen it.

    Raises:
        WedgeError: the gel shows no dots or nothing else.
    """
    presses = read_presses(dataset)
    if presses.dots is None:
        raise WedgeError(f"{dataset.folder} shows no dots: their cost cannot be measured on it.")
    rings: dict[str, list[np.ndarray]] = {name: [] for name in ("clear", *FILLED_BY)}
    errors: dict[str, list[np.ndarray]] = {name: [] for name in rings}
    for fold in fit_folds(presses.presses, estimator, "RGB", folds=FOLDS, seed=SEED):
        for index in fold.test:
            found = _press_errors(presses.presses[index], fold.estimator)
            for name, (ring, error) in found.items():
                rings[name].append(ring)
                errors[name].append(error)
    mean, pixels = compared(
        {name: (np.concatenate(rings[name]), np.concatenate(errors[name])) for name in rings}
    )
    if not pixels:
        raise WedgeError(f"{dataset.folder} shows no gel without dots nearby to compare with.")
    return DotCost(
        clear=mean.pop("clear"), filled=mean, presses=len(presses.presses), pixels=pixels
    )


def compared(
    found: Mapping[str, tuple[Int[np.ndarray, " n"], Float[np.ndarray, " n"]]],
) -> tuple[dict[str, float], int]:
    """Mean errors on clear gel and under dots, in rings that have both, and the pixels under dots.

    Args:
        found: ring and error of every pixel: of ``clear``, and under dots by method.
    """
    counts = {name: np.bincount(ring, minlength=RINGS) for name, (ring, _) in found.items()}
    under = next(count for name, count in counts.items() if name != "clear")
    weights = np.where(counts["clear"] > 0, under, 0)
    if not weights.any():
        return dict.fromkeys(found, np.nan), 0
    by_ring = {
        name: np.bincount(ring, error, minlength=RINGS) / counts[name].clip(1)
        for name, (ring, error) in found.items()
    }
    mean = {name: float(np.average(by_ring[name], weights=weights)) for name in found}
    return mean, int(weights.sum())


def _press_errors(
    press: BallPress, fitted: GradientEstimator
) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """Ring and error of every contact pixel: of clear gel, and under dots by how it was filled."""
    assert press.hidden is not None
    labelled = label_pixels(press, 0, SEED)
    pixels = labelled[labelled.contact]
    away_mm = press.distance_mm.ravel()[pixels.place]
    ring = np.minimum((RINGS * away_mm / away_mm.max()).astype(int), RINGS - 1)
    around = np.ones((2 * CLEAR_PX + 1,) * 2, np.uint8)
    near = cv2.dilate(press.hidden.astype(np.uint8), around).ravel()[pixels.place] > 0
    slopes = gradient_field(fitted, press.difference)

    def errors(field: GradientField) -> Float[np.ndarray, " n"]:
        found = as_labelled(fitted, field.reshape(-1, 2)[pixels.place], pixels)
        return np.asarray(np.abs(found - pixels.gradient).mean(-1))

    found = {"clear": (ring[~near], errors(slopes)[~near])}
    for method in FILLED_BY:
        filled = fill_gradients(slopes, press.hidden, method, press.mm_per_px)
        found[method] = (ring[pixels.hidden], errors(filled)[pixels.hidden])
    return found


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(prog="python -m validation.markers", description=__doc__)
    parser.add_argument("dataset", help="such as wedge-lab; see `wedge data list`")
    parser.add_argument("--estimator", default="mlp")
    options = parser.parse_args()
    with ending_in_a_sentence(parser):
        dataset = read_dataset(dataset_folder(options.dataset))
        cost = dot_cost(dataset, estimator=options.estimator)
    print(f"{cost.presses} presses, {cost.pixels} pixels under dots; mean slope errors in mm/mm")
    print(f"without dots nearby {cost.clear:.4f}")
    for name, filled in cost.filled.items():
        print(f"under dots, {name} {filled:.4f}, {filled / cost.clear:.2f} times as much")


if __name__ == "__main__":
    main()
