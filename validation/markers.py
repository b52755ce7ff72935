# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""What dots cost: slopes under them, filled in, against slopes of clear gel beside them.

The same pixels without dots nearby: a pixel under a dot is compared with pixels of other presses
at the same distance from the ball's centre, in contact radii, that lie farther than ``CLEAR_PX``
from every dot. Presses are judged by estimators that have not seen them.
``python -m validation.markers DATASET`` fits by five folds and prints both.
"""

import argparse
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from jaxtyping import Bool, Float, Int

from recon.ball import ball_cap, offsets_mm
from recon.estimators import GradientEstimator, fit_estimator, gradient_field
from recon.markers.filling import METHODS, fill_gradients
from recon.pixels import RIM_PX, STEEPEST, BallPress, join, label_pixels
from recon.presses import read_presses
from sensor.dataset import Dataset, read_dataset
from sensor.errors import WedgeError
from validation.datasets import dataset_folder

SEED, FOLDS = 0, 5
CLEAR_PX = 2
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


def dot_cost(
    dataset: Dataset,
    *,
    estimator: str = "mlp",
    methods: Sequence[str] = ("zero", "nearest", "harmonic", "biharmonic", "surface"),
) -> DotCost:
    """Judge every press of a marker gel by an estimator that has not seen it.

    Raises:
        WedgeError: the gel shows no dots or nothing else, or a method has no such name.
    """
    for method in methods:
        if method not in METHODS:
            raise WedgeError(f"no way of filling is called {method!r}: known are {METHODS}.")
    presses = read_presses(dataset)
    if presses.dots is None:
        raise WedgeError(f"{dataset.folder} shows no dots: their cost cannot be measured on it.")
    order = np.random.default_rng(SEED).permutation(len(presses.presses))
    rings: dict[str, list[np.ndarray]] = {name: [] for name in ("clear", *methods)}
    errors: dict[str, list[np.ndarray]] = {name: [] for name in ("clear", *methods)}
    for fold in range(FOLDS):
        judged = order[fold::FOLDS]
        train = [
            label_pixels(presses.presses[i], k, SEED)
            for k, i in enumerate(np.setdiff1d(order, judged))
        ]
        fitted = fit_estimator(estimator, join(train), "RGB", SEED)
        for index in judged:
            press = presses.presses[index]
            for name, (ring, error) in _press_errors(press, fitted, methods).items():
                rings[name].append(ring)
                errors[name].append(error)
    mean, pixels = compared(
        {name: (np.concatenate(rings[name]), np.concatenate(errors[name])) for name in rings}
    )
    if not pixels:
        raise WedgeError(f"{dataset.folder} shows no gel without dots nearby to compare with.")
    return DotCost(clear=mean.pop("clear"), filled=mean, presses=len(order), pixels=pixels)


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
    press: BallPress, fitted: GradientEstimator, methods: Sequence[str]
) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """Ring and error of every judged pixel, of clear gel and under dots by method."""
    assert press.hidden is not None
    touched, ring = _contact(press)
    truth = ball_cap(
        press.size_px,
        press.center_px,
        min(press.contact_radius_mm, 0.999 * press.ball_radius_mm),
        press.ball_radius_mm,
        press.mm_per_px,
    ).gradient
    near = cv2.dilate(press.hidden.astype(np.uint8), np.ones((2 * CLEAR_PX + 1,) * 2, np.uint8))
    clear, under = touched & ~near.astype(bool), touched & press.hidden
    slopes = gradient_field(fitted, press.difference)
    found = {"clear": (ring[clear], np.abs(slopes - truth).mean(-1)[clear])}
    for method in methods:
        filled = fill_gradients(slopes, press.hidden, method, press.mm_per_px)
        found[method] = (ring[under], np.abs(filled - truth).mean(-1)[under])
    return found


def _contact(press: BallPress) -> tuple[Bool[np.ndarray, "h w"], np.ndarray]:
    """The contact's pixels as the error table counts them, and each pixel's ring."""
    away_mm = np.hypot(*offsets_mm(press.size_px, press.center_px, press.mm_per_px))
    pitch_mm = press.contact_radius_mm / press.contact_radius_px
    reach_mm = min(press.contact_radius_mm - RIM_PX * pitch_mm, STEEPEST * press.ball_radius_mm)
    ring = np.minimum((RINGS * away_mm / reach_mm).astype(int), RINGS - 1)
    return away_mm < reach_mm, ring


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(prog="python -m validation.markers", description=__doc__)
    parser.add_argument("dataset", help="such as wedge-lab; see `wedge data list`")
    parser.add_argument("--estimator", default="mlp")
    options = parser.parse_args()
    try:
        dataset = read_dataset(dataset_folder(options.dataset))
        cost = dot_cost(dataset, estimator=options.estimator)
    except WedgeError as error:
        sys.exit(str(error))
    print(f"{cost.presses} presses, {cost.pixels} pixels under dots; mean slope errors in mm/mm")
    print(f"without dots nearby {cost.clear:.4f}")
    for name, filled in cost.filled.items():
        print(f"under dots, {name} {filled:.4f}, {filled / cost.clear:.2f} times as much")


if __name__ == "__main__":
    main()
