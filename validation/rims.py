# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""How steep the skin is found round a ball's labelled circle, ring by ring.

A label says that the skin follows the ball up to the circle. Where the slope that is found peaks
before it, the skin has let go of the ball, or no colour tells steeper skin apart; an estimator that
learnt to agree there would have learnt where balls end. ``python -m validation.rims DATASET`` fits
by five folds and prints both slopes.
"""

import argparse
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from recon.arrays import GradientField
from recon.pixels import BallPress, positions
from recon.presses import read_presses
from sensor.arguments import ending_in_a_sentence
from sensor.dataset import read_dataset
from validation.datasets import dataset_folder
from validation.depth import cap_of
from validation.folds import fit_folds
from validation.reconstructed import reconstruct_press

RINGS = np.round(np.arange(0.3, 1.51, 0.05), 2)
"""Edges of the rings, in labelled contact radii."""
FOLDS = 5
SEED = 0


@dataclass(frozen=True, kw_only=True)
class RimProfile:
    """Mean slope toward the centre, mm/mm, on each ring between ``RINGS``; means of presses."""

    found: Float[np.ndarray, " k"]
    labelled: Float[np.ndarray, " k"]
    """The ball's, and zero outside the circle."""
    presses: int

    @property
    def middles(self) -> Float[np.ndarray, " k"]:
        """Radii of the rings, in labelled contact radii."""
        return (RINGS[1:] + RINGS[:-1]) / 2

    @property
    def steepest_at(self) -> float:
        """Where the found slope peaks, in labelled contact radii."""
        return float(self.middles[self.found.argmax()])


def rim_profile(presses: Sequence[BallPress], fields: Sequence[GradientField]) -> RimProfile:
    """Azimuthal means round the circles of presses.

    Args:
        presses: with circles that lie inside the frame.
        fields: of each, the gradients of what is pressed in.
    """
    sums = [_ring_means(press, field) for press, field in zip(presses, fields, strict=True)]
    found, labelled = np.nanmean(sums, 0)
    return RimProfile(found=found, labelled=labelled, presses=len(presses))


def _ring_means(press: BallPress, field: GradientField) -> Float[np.ndarray, "2 k"]:
    x_mm, y_mm = press.offsets_mm
    away_mm = np.hypot(x_mm, y_mm)
    ring = np.digitize(away_mm / press.contact_radius_mm, RINGS) - 1
    inside = (ring >= 0) & (ring < len(RINGS) - 1)
    count = np.bincount(ring[inside], minlength=len(RINGS) - 1)
    means = np.full((2, len(RINGS) - 1), np.nan)
    for row, slopes in enumerate((field, cap_of(press).gradient)):
        inward = -(slopes[..., 0] * x_mm + slopes[..., 1] * y_mm) / np.maximum(away_mm, 1e-9)
        total = np.bincount(ring[inside], inward[inside], len(RINGS) - 1)
        np.divide(total, count, out=means[row], where=count > 0)
    return means


def held_out_profile(dataset: str, estimator: str) -> RimProfile:
    """The rings of all presses, each found by an estimator that has not learnt from it."""
    known = read_dataset(dataset_folder(dataset))
    presses = list(read_presses(known).presses)
    judged: list[BallPress] = []
    fields: list[GradientField] = []
    for fold in fit_folds(presses, estimator, "RGB", folds=FOLDS, seed=SEED):
        for i in fold.test:
            judged.append(presses[i])
            lean = fold.estimator.lean(positions(presses[i].size_px))
            found = reconstruct_press(presses[i], fold.estimator, "none", known.card.lights_deg)
            fields.append(found.gradient - lean)
    return rim_profile(judged, fields)


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(prog="python -m validation.rims", description=__doc__)
    parser.add_argument("dataset")
    parser.add_argument("--estimator", default="default")
    options = parser.parse_args()
    with ending_in_a_sentence(parser):
        profile = held_out_profile(options.dataset, options.estimator)
    print(f"{profile.presses} presses; the slope found peaks at {profile.steepest_at:.2f} radii")
    for row in zip(profile.middles, profile.labelled, profile.found, strict=True):
        print("radii {:.3f}  labelled {:.3f}  found {:.3f}".format(*row))


if __name__ == "__main__":
    main()
