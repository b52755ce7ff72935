# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""How much of an estimator's error is the labels': circles moved to where another one reads them.

A circle that a hand drew a pixel off its ball is a wrong truth, and an estimator that reads the
ball right is charged for it. Where another estimator, which never saw that press either, reads the
ball's centre, tells how far off the circle is as well as that one's own error lets it.
``python -m validation.label_noise DATASET`` fits two by five folds, moves every held-out circle to
where one reads it, its radius kept, and judges the other by that. What both misread alike, of light
or of gel, moves the circles too and is charged to neither; what the judging one alone misreads is
charged to the other. Labels are flat from 1.3 contact radii on, where skin still follows the ball;
so ``contact+5%`` is judged without that collar as well. ``--json FILE`` keeps the numbers.
"""

import argparse
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Bool, Float32
from scipy.optimize import minimize

from recon.calibration import lit_channels
from recon.estimators.lesson import FLAT_FROM
from recon.pixels import BallPress, Pixels, ball_slopes, label_pixels
from recon.presses import read_presses
from sensor.arguments import ending_in_a_sentence
from sensor.dataset import read_dataset
from sensor.files import check_outputs, write_json
from sensor.toml import Pair
from validation.datasets import dataset_folder
from validation.folds import fit_presses
from validation.metrics import PIXEL_SETS, mean_errors, press_errors
from validation.reconstructed import Slopes, reconstruct_press, slopes_in
from validation.splits import splits

FOLDS = 5
SEED = 0
HOW = ("as labelled", "as the other reads")
WITHOUT_COLLAR = "contact+5% without the collar"
Row = dict[str, Any]


@dataclass(frozen=True, kw_only=True)
class Read:
    """One press as an estimator that did not learn from it reads it."""

    press: BallPress
    pixels: Pixels
    slopes: Slopes
    """Of the pixels, as labels mean them."""
    shift_px: Pair
    """From the labelled centre to where these slopes say that the ball is."""


def label_noise(name: str, estimators: tuple[str, str]) -> list[Row]:
    """Mean errors of two estimators as circles lie, and as the other one reads them.

    Args:
        name: of a data set, or its folder.
        estimators: two names.

    Raises:
        WedgeError: the set cannot be used.
    """
    reads = [read_held_out(name, estimator) for estimator in estimators]
    rows: list[Row] = []
    for own, others, estimator in zip(reads, reads[::-1], estimators, strict=True):
        shifts = [other.shift_px for other in others]
        row: Row = {
            "dataset": name,
            "estimator": estimator,
            "presses": len(own),
            "moved by, median px": float(np.median(np.hypot(*np.transpose(shifts)))),
        }
        none = [(0.0, 0.0)] * len(shifts)
        for how, moves in zip(HOW, (none, shifts), strict=True):
            row |= {f"{pixels}, {how} theta_deg": e for pixels, e in _theta_deg(own, moves).items()}
        rows.append(row)
    apart = [np.array([read.shift_px for read in some]) for some in reads]
    alike = [float(np.corrcoef(a, b)[0, 1]) for a, b in zip(*(one.T for one in apart), strict=True)]
    return [row | {"shifts alike, x": alike[0], "shifts alike, y": alike[1]} for row in rows]


def read_held_out(name: str, estimator: str) -> list[Read]:
    """Every press of a set as read by a fit to the other folds' presses."""
    dataset = read_dataset(dataset_folder(name))
    presses = read_presses(dataset).presses
    channels, missing = lit_channels(dataset)
    reads = {}
    for split in splits(len(presses), FOLDS, SEED):
        fitted = fit_presses(presses, split.train, estimator, channels, SEED)
        for index in split.test:
            press = presses[index]
            pixels = label_pixels(press, index, SEED)
            touch = reconstruct_press(press, fitted, missing, dataset.card.lights_deg)
            slopes = slopes_in(touch, fitted, pixels)
            shift_px = shift_read_in(slopes, pixels, press)
            reads[index] = Read(press=press, pixels=pixels, slopes=slopes, shift_px=shift_px)
    return [reads[index] for index in range(len(presses))]


def shift_read_in(slopes: Slopes, pixels: Pixels, press: BallPress) -> Pair:
    """How far, in pixels, the centre must move for a ball's slopes to be likest to these.

    By the mean absolute error of theta = atan(G) in contact, as the table has it.
    """
    contact = pixels[pixels.contact]
    read = np.arctan(slopes[pixels.contact])

    def error(shift_px: np.ndarray) -> float:
        x_px, y_px = shift_px
        return float(np.abs(read - np.arctan(moved_slopes(contact, press, (x_px, y_px)))).mean())

    around = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]])
    found = minimize(
        error, around[0], method="Nelder-Mead", options={"initial_simplex": around, "xatol": 0.01}
    )
    return float(found.x[0]), float(found.x[1])


def moved_slopes(pixels: Pixels, press: BallPress, shift_px: Pair) -> Slopes:
    """Slopes of pixels, as if the label's centre lay elsewhere; zero outside its contact."""
    row, column = np.divmod(pixels.place, press.size_px[0])
    x_mm = (column - press.center_px[0] - shift_px[0]) * press.mm_per_px[0]
    y_mm = (row - press.center_px[1] - shift_px[1]) * press.mm_per_px[1]
    slopes = ball_slopes(x_mm, y_mm, press.ball_radius_mm)
    return np.where(pixels.contact[:, None], slopes, 0).astype(np.float32)


def _theta_deg(reads: Sequence[Read], shifts_px: Sequence[Pair]) -> dict[str, float]:
    """Mean of theta x and theta y over each pixel set of the table, once circles have moved."""
    found: dict[str, float] = {}
    for name in (*PIXEL_SETS, WITHOUT_COLLAR):
        errors = []
        for read, shift_px in zip(reads, shifts_px, strict=True):
            truth = moved_slopes(read.pixels, read.press, shift_px)
            errors.append(press_errors(read.press.file, read.slopes, truth, _judged(read, name)))
        values = mean_errors(errors, SEED).values
        found[name] = (values["theta_x_deg"] + values["theta_y_deg"]) / 2
    return found


def _judged(read: Read, name: str) -> Bool[np.ndarray, " n"]:
    """Which of a press's pixels a set of this name holds."""
    contact = read.pixels.contact
    if name == "contact":
        return contact
    if name == "contact+5%":
        return np.ones_like(contact)
    press = read.press
    away_mm = press.distance_mm.ravel()[read.pixels.place]
    flat = away_mm >= FLAT_FROM * press.contact_radius_mm
    return np.asarray(contact | flat)


def label_shift_deg(
    gradient: Float32[np.ndarray, "n 2"],
    ball_radius_mm: float | Float32[np.ndarray, " n"],
    shift_mm: float,
) -> float:
    """How far a ball's true theta_x moves, on average, when its centre is moved along x.

    A label that is off by so much makes an exact estimator look that wrong.

    Args:
        gradient: true slopes on balls.
        ball_radius_mm: of the ball at each, or of all.
        shift_mm: of the centre.
    """
    steepness = np.sqrt(1 + np.sum(gradient.astype(float) ** 2, 1))
    x_mm, y_mm = (-ball_radius_mm * gradient[:, axis] / steepness for axis in (0, 1))
    height_mm = np.sqrt(np.maximum(ball_radius_mm**2 - (x_mm - shift_mm) ** 2 - y_mm**2, 1e-12))
    moved = np.arctan(-(x_mm - shift_mm) / height_mm) - np.arctan(gradient[:, 0])
    return float(np.degrees(np.abs(moved).mean()))


def main() -> None:
    """Measure, print, and keep as JSON where asked."""
    parser = argparse.ArgumentParser(prog="python -m validation.label_noise", description=__doc__)
    parser.add_argument("dataset")
    parser.add_argument("--estimator", default="default,mlp", help="two names")
    parser.add_argument("--json", type=Path)
    options = parser.parse_args()
    names = options.estimator.split(",")
    if len(names) != 2:
        parser.error("--estimator takes two names with a comma between them")
    with ending_in_a_sentence(parser):
        check_outputs(options.json)
        rows = label_noise(options.dataset, (names[0], names[1]))
        write_json(options.json, rows)
    for row in rows:
        cells = [f"{k} {v:.3f}" if isinstance(v, float) else f"{k} {v}" for k, v in row.items()]
        print("  ".join(cells))


if __name__ == "__main__":
    main()
