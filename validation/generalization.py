# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""What an estimator does beyond its lesson: other shapes, balls and places, fewer presses.

``python -m validation.generalization shapes DATASET`` teaches the presses of a set and reconstructs
its shapes, or those of a second set of the same sensor, where one is named; ``other TAUGHT JUDGED``
teaches one set and judges the presses of another; ``fewer DATASET`` teaches ten presses and all, by
five folds; ``places DATASET`` holds out a quarter of the pad at a time, and as many folds of
presses; ``intervals DATASET`` counts the held-out truths inside the intervals. Few presses are
chosen three times: over the pad, each as far as can be from those before; those nearest to where
``wedge capture`` points in turn; and evenly through the list, which leaves parts of the pad out.
Deviations are errors of depth, each by what is expected of it, root mean square.
``--lights RB`` leaves all but these lights of a set unused, for shapes and intervals.
``--json FILE`` keeps the numbers.
"""

import argparse
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from statistics import fmean, median
from typing import Any

import numpy as np

from recon.calibration import calibrate, lit_channels
from recon.cloud import expected_error_mm
from recon.coverage import Coverage
from recon.estimators import GradientEstimator
from recon.estimators.default import Default
from recon.pipeline import Reconstruction
from recon.pixels import BallPress, label_pixels
from recon.presses import read_presses
from sensor.arguments import ending_in_a_sentence
from sensor.dataset import Dataset, read_dataset
from sensor.errors import WedgeError
from sensor.files import check_outputs, write_json
from validation.datasets import dataset_folder
from validation.depth import depth_errors, true_depth
from validation.error_table import measure_press
from validation.folds import fit_presses
from validation.metrics import PIXEL_SETS, PressErrors, mean_errors
from validation.reconstructed import reconstruct_press
from validation.shapes import measure_shapes
from validation.splits import splits

FOLDS = 5
SEED = 0
REFERENCE = "mlp"
"""What ratios are taken to: the paper's."""

Presses = Sequence[BallPress]
Row = dict[str, Any]


def shapes(
    taught: str,
    judged: str,
    names: Sequence[str],
    count: int | None = None,
    seed: int = SEED,
    lights: str | None = None,
) -> list[Row]:
    """Depth errors of a set's shapes, by estimators trained on its presses, or some of them."""
    folder, shown = dataset_folder(taught), dataset_folder(judged)
    dataset = read_dataset(folder)
    every = read_presses(dataset)
    dataset = _lit_by(lights, dataset)
    rows: list[Row] = []
    for how in EVERY if count is None else CHOICES:
        presses = replace(every, presses=tuple(_chosen(every.presses, count, how)))
        some: list[Row] = []
        for name in names:
            unit = calibrate(
                dataset, presses, estimator=name, serial="s", created="-", metrics={}, seed=seed
            )
            some += [
                {"estimator": name, "shape": shape.name, "presses": len(presses.presses)}
                | {"chosen": how, "rmse_mm": shape.rmse_mm, "bias_mm": shape.bias_mm}
                | ({} if shape.deviations is None else {"deviations": shape.deviations})
                for shape in measure_shapes(shown, unit)
            ]
        if not some:
            raise WedgeError(f"{shown} holds no shape whose depth is in truth/: name another set.")
        rows += _with_ratio(some)
    return rows


def other(taught: str, judged: str, names: Sequence[str], seed: int = SEED) -> list[Row]:
    """Errors on the presses of one set by estimators trained on another, and on that set itself.

    Its own presses are judged by folds, where there are enough.
    """
    lesson, _ = _read(taught)
    task, dataset = _read(judged)
    rows: list[Row] = []
    for name in names:
        fitted = _fit(name, lesson, dataset, seed)
        rows.append(
            {"estimator": name, "taught": taught, **_pooled([(fitted, task)], dataset),
             "depth": _depths(fitted, task, dataset)}
        )  # fmt: skip
        if len(task) >= 2 * FOLDS:
            own = _held_out(name, task, dataset, _folds(task, FOLDS), seed)
            rows.append({"estimator": name, "taught": judged, **own})
    return rows


def fewer(of: str, names: Sequence[str], count: int, seed: int = SEED) -> list[Row]:
    """Errors by five folds when trained on a few presses, and on all."""
    presses, dataset = _read(of)
    rows: list[Row] = []
    for name in names:
        for how in (*CHOICES, *EVERY):
            fitted = []
            for split in splits(len(presses), FOLDS, SEED):
                train = _chosen([presses[i] for i in split.train], count, how)
                estimator = _fit(name, train, dataset, seed)
                fitted.append((estimator, [presses[i] for i in split.test]))
            rows.append({"estimator": name, "presses": len(train), "chosen": how}
                        | _pooled(fitted, dataset))  # fmt: skip
    return rows


def places(of: str, names: Sequence[str], seed: int = SEED) -> list[Row]:
    """Errors where no press was taught: in each quarter of the pad, by those of the other three.

    Beside them, errors by as many folds of presses from all over the pad.
    """
    presses, dataset = _read(of)
    quarters = _quarters_of_the_pad(presses)
    held_out = {"a quarter of the pad": quarters, "presses": _folds(presses, len(quarters))}
    return [
        {"estimator": name, "held out": what} | _held_out(name, presses, dataset, groups, seed)
        for name in names
        for what, groups in held_out.items()
    ]


def intervals(of: str, lights: str | None = None) -> list[Row]:
    """Share of held-out contact slopes inside their 90 % interval, pooled and by steepness.

    Beside it, by how many of the deviations expected of it depth is off.
    """
    presses, dataset = _read(of)
    dataset = _lit_by(lights, dataset)
    squares: list[float] = []
    inside: list[np.ndarray] = []
    steepness: list[np.ndarray] = []
    for split in splits(len(presses), FOLDS, SEED):
        fitted = _fit(Default.name, [presses[i] for i in split.train], dataset)
        assert isinstance(fitted, Default)
        for i in split.test:
            pixels = label_pixels(presses[i], i, SEED)
            pixels = pixels[pixels.contact]
            touch = _touch(fitted, presses[i], dataset)
            found = touch.gradient.reshape(-1, 2)[pixels.place]
            truth = pixels.gradient + fitted.lean(pixels.position)
            inside.append(np.abs(found - truth) <= fitted.half_width(found))
            steepness.append(np.linalg.norm(truth, axis=1))
            known = true_depth(touch.depth_mm, presses[i], dataset.folder)
            off = (touch.depth_mm - known.rim_mm - known.depth_mm) / expected_error_mm(touch)
            squares.append(float(np.mean(off[known.contact] ** 2)))
    within, steep = np.concatenate(inside), np.concatenate(steepness)
    edges = [0, 0.3, 0.7, 9]
    row: Row = {"dataset": of, "presses": len(presses), "covered": float(within.mean())}
    for low, high in pairwise(edges):
        chosen = (steep >= low) & (steep < high)
        if chosen.any():
            row[f"covered, slope {low}-{high}"] = float(within[chosen].mean())
    row["deviations, median press"] = median(squares) ** 0.5
    return [row]


def _read(name: str) -> tuple[list[BallPress], Dataset]:
    dataset = read_dataset(dataset_folder(name))
    return list(read_presses(dataset).presses), dataset


def _lit_by(lights: str | None, dataset: Dataset) -> Dataset:
    """The set as a sensor with some of its lights would have taken it; with all unless given.

    Raises:
        WedgeError: the set does not say where one of these lights sits.
    """
    if lights is None:
        return dataset
    known = dataset.card.lights_deg or {}
    if not lights or set(lights) - set(known):
        raise WedgeError(f"{dataset.card.name} has lights {''.join(known) or '?'}, not {lights!r}.")
    some = {channel: known[channel] for channel in known if channel in lights}
    return replace(dataset, card=replace(dataset.card, lights_deg=some))


def _folds(presses: Presses, folds: int) -> list[Sequence[int]]:
    """Presses that are held out together, drawn from all."""
    return [split.test for split in splits(len(presses), folds, SEED)]


def _quarters_of_the_pad(presses: Presses) -> list[Sequence[int]]:
    """Presses that are held out together: those whose middle lies in one quarter of the frame.

    Raises:
        WedgeError: all lie in one.
    """
    right, below = (np.array([x.center_px for x in presses]) > np.divide(presses[0].size_px, 2)).T
    quarters = [np.flatnonzero(2 * below + right == k).tolist() for k in range(4)]
    if sum(map(bool, quarters)) < 2:
        raise WedgeError("all presses lie in one quarter of the pad: press the ball all over it.")
    return [quarter for quarter in quarters if quarter]


def _over_the_pad(presses: Presses, count: int) -> list[int]:
    """That many: one in the middle, each next far from all before."""
    size_px = np.array(presses[0].size_px)
    places = np.array([press.center_px for press in presses])
    chosen = [int(np.linalg.norm(places - size_px / 2, axis=1).argmin())]
    while len(chosen) < count:
        away_px = np.linalg.norm(places[:, None] - places[chosen], axis=-1).min(1)
        chosen.append(int(away_px.argmax()))
    return sorted(chosen)


def _as_captured(presses: Presses, count: int) -> list[int]:
    """That many: each the one nearest to where a capture would point after those before."""
    coverage = Coverage(presses[0].size_px, presses[0].mm_per_px)
    places = np.array([press.center_px for press in presses])
    chosen: list[int] = []
    while len(chosen) < count:
        away_px = np.linalg.norm(places - coverage.next_px, axis=1)
        away_px[chosen] = np.inf
        chosen.append(int(away_px.argmin()))
        coverage.add(presses[chosen[-1]].center_px)
    return sorted(chosen)


def _as_listed(presses: Presses, count: int) -> list[int]:
    """That many, evenly through the list."""
    return [int(i) for i in np.linspace(0, len(presses) - 1, count).round()]


CHOICES: Mapping[str, Callable[[Presses, int], list[int]]] = {
    "over the pad": _over_the_pad,
    "as captured": _as_captured,
    "as listed": _as_listed,
}
EVERY = ("every one",)


def _chosen(presses: Presses, count: int | None, how: str) -> Presses:
    if how not in CHOICES or count is None or count >= len(presses):
        return presses
    return [presses[i] for i in CHOICES[how](presses, count)]


def _fit(name: str, presses: Presses, dataset: Dataset, seed: int = SEED) -> GradientEstimator:
    return fit_presses(presses, range(len(presses)), name, lit_channels(dataset)[0], seed)


def _touch(fitted: GradientEstimator, press: BallPress, dataset: Dataset) -> Reconstruction:
    return reconstruct_press(press, fitted, lit_channels(dataset)[1], dataset.card.lights_deg)


def _held_out(
    name: str, presses: Presses, dataset: Dataset, groups: Sequence[Sequence[int]], seed: int
) -> Row:
    """Errors of each group of presses by an estimator that all others taught."""
    fitted = []
    for test in groups:
        train = [press for i, press in enumerate(presses) if i not in test]
        fitted.append((_fit(name, train, dataset, seed), [presses[i] for i in test]))
    return _pooled(fitted, dataset)


def _pooled(fitted: Sequence[tuple[GradientEstimator, Presses]], dataset: Dataset) -> Row:
    return _means([e for one, presses in fitted for e in _press_errors(one, presses, dataset)])


def _press_errors(
    fitted: GradientEstimator, presses: Presses, dataset: Dataset
) -> list[tuple[PressErrors, ...]]:
    missing, lights_deg = lit_channels(dataset)[1], dataset.card.lights_deg
    return [
        measure_press(fitted, press, label_pixels(press, i, SEED), missing, lights_deg)
        for i, press in enumerate(presses)
    ]


def _means(measured: list[tuple[PressErrors, ...]]) -> Row:
    row: Row = {"judged": len(measured)}
    for column, pixels in enumerate(PIXEL_SETS):
        values = mean_errors([errors[column] for errors in measured], SEED).values
        row[f"{pixels} theta_deg"] = fmean((values["theta_x_deg"], values["theta_y_deg"]))
    return row


def _depths(fitted: GradientEstimator, presses: Presses, dataset: Dataset) -> Row:
    """Depth errors, as shapes' wherever the truth is pressed in, which a file knows beyond the rim.

    So too soft a collar counts as well.
    """
    peaks_off_mm, off_mm = [], []
    for press in presses:
        depth = _touch(fitted, press, dataset).depth_mm
        known = true_depth(depth, press, dataset.folder)
        off_mm.append((depth - known.rim_mm - known.depth_mm)[known.depth_mm > 0])
        errors = depth_errors(depth, press, dataset.folder)
        peaks_off_mm.append(errors.peak_mm - errors.peak_truth_mm)
    return {
        "rmse_mm": fmean(float(np.sqrt(np.mean(off**2))) for off in off_mm),
        "bias_mm": fmean(float(off.mean()) for off in off_mm),
        "peaks_off_mm": peaks_off_mm,
        "truth": known.name,
    }


def _with_ratio(rows: list[Row]) -> list[Row]:
    """Each row with its ratio to the reference's, where that was measured."""
    mm = {row["shape"]: row["rmse_mm"] for row in rows if row["estimator"] == REFERENCE}
    return [
        row | ({"ratio": row["rmse_mm"] / mm[row["shape"]]} if row["shape"] in mm else {})
        for row in rows
    ]


def main() -> None:
    """Measure, print, and keep as JSON where asked."""
    parser = argparse.ArgumentParser(
        prog="python -m validation.generalization", description=__doc__
    )
    parser.add_argument("what", choices=["shapes", "other", "fewer", "places", "intervals"])
    parser.add_argument(
        "dataset", nargs="+", help="one set, or the set to train on and the one to judge"
    )
    parser.add_argument("--estimator", default=f"default,{REFERENCE}")
    parser.add_argument("--presses", type=int, help="to train on, for fewer (10) or shapes (all)")
    parser.add_argument("--seed", type=int, default=SEED, help="of the training (0)")
    parser.add_argument("--lights", help="of the set, for shapes or intervals (all)")
    parser.add_argument("--json", type=Path)
    options = parser.parse_args()
    names = options.estimator.split(",")
    if options.seed != SEED and options.what == "intervals":
        parser.error("intervals are counted with one seed")
    if options.lights is not None and options.what not in {"shapes", "intervals"}:
        parser.error("lights are chosen for shapes and intervals")
    if len(options.dataset) not in {"other": (2,), "shapes": (1, 2)}.get(options.what, (1,)):
        parser.error("other takes two datasets, shapes one or two, the rest take one")
    first, last = options.dataset[0], options.dataset[-1]
    measures: dict[str, Callable[[], list[Row]]] = {
        "shapes": lambda: shapes(first, last, names, options.presses, options.seed, options.lights),
        "other": lambda: other(first, last, names, options.seed),
        "fewer": lambda: fewer(first, names, options.presses or 10, options.seed),
        "places": lambda: places(first, names, options.seed),
        "intervals": lambda: intervals(first, options.lights),
    }
    with ending_in_a_sentence(parser):
        check_outputs(options.json)
        rows = measures[options.what]()
        document = {"what": options.what, "dataset": options.dataset, "rows": rows}
        write_json(options.json, document)
    for row in rows:
        print("  ".join(f"{key} {_text(value)}" for key, value in row.items()))


def _text(value: object) -> str:
    if isinstance(value, dict):
        return ", ".join(f"{key} {_text(inner)}" for key, inner in value.items())
    if isinstance(value, list):
        return " ".join(_text(inner) for inner in value)
    return f"{value:.4f}" if isinstance(value, float) else str(value)


if __name__ == "__main__":
    main()
