# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Where it touches, against the twin's truth, labelled balls and blank gel.

``python -m benchmarks.contact`` prints the overlap of contact masks with the truth on the twin's
shapes, the processor time that a mask takes, and the overlap of shadows with those of traced rays;
``--twin FOLDER DESIGN`` takes a set that was rendered anew instead (``wedge simulate --scene
set``), ``--balls`` adds the labelled balls of every set that is here, ``--blanks N`` noisy blank
frames of every sensor.
"""

import argparse
from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from statistics import median
from time import process_time

import numpy as np

from recon.presses import read_presses
from sensor.arguments import ending_in_a_sentence
from sensor.dataset import read_dataset
from sensor.design_file import load_design
from sensor.errors import WedgeError
from sensor.files import check_outputs, write_json
from validation.contact import ball_overlaps, blank_frames_in_contact, iou, mean_iou
from validation.contact_shapes import ShapeContact, shape_contacts
from validation.datasets import dataset_folder
from validation.folds import fit_folds, fit_presses

TWINS = (("twin-standard", "standard"), ("twin-finger", "finger"))
BALLS = ("taxim-gelsight", "known-depth", "wedge-lab", "twin-standard", "twin-finger")
FOLDS = 3
BLANK_GELS = (
    *("taxim-gelsight", "known-depth", "wedge-lab", "marker-balls-a", "twin-standard"),
    *("twin-finger", "wedge-mit-golf-ball", "wedge-mit-lego", "wedge-mit-bolt"),
    "wedge-lab-markerless",
)


MASKS: dict[str, Callable[[ShapeContact], object]] = {
    "": lambda shape: replace(shape.touch).contact,  # a copy, which has not been asked yet
    " by slopes alone": lambda shape: shape.by_slopes,
}
REPEATS = 3


def taken_ms(act: Callable[[], object]) -> float:
    """Median processor time of some repeats."""
    times_ms = []
    for _ in range(REPEATS):
        start = process_time()
        act()
        times_ms.append(1e3 * (process_time() - start))
    return median(times_ms)


def shape_rows(
    estimators: Sequence[str], twins: Iterable[tuple[str, str]] = TWINS
) -> list[dict[str, object]]:
    """Every shape of each set with every estimator.

    Args:
        estimators: names.
        twins: dataset and design; names, or a folder and a file.

    Raises:
        WedgeError: a dataset or a design cannot be used.
    """
    rows: list[dict[str, object]] = []
    for dataset, design in twins:
        folder, wedge = dataset_folder(dataset), load_design(design)
        twin = read_dataset(folder)
        presses = read_presses(twin).presses
        for estimator in estimators:
            fitted = fit_presses(presses, range(len(presses)), estimator, "RGB", seed=0)
            found = shape_contacts(twin, wedge, fitted)
            rows += [_row(dataset, estimator, shape) for shape in found]
            of_shapes = rows[-len(found) :]
            mean, by_slopes, exact = (
                np.mean([row[name] for row in of_shapes])
                for name in ("iou", "iou_by_slopes", "iou_with_true_depth")
            )
            print(
                f"{dataset}, {estimator}: mean IoU {mean:.3f}; by slopes alone {by_slopes:.3f}; "
                f"with the true depth {exact:.3f}"
            )
            for shape, row in zip(found, of_shapes, strict=True):
                print(
                    f"  {shape.name:12s} {shape.iou:.3f}  by slopes alone "
                    f"{row['iou_by_slopes']:.3f}  with the true depth {shape.exact_iou:.3f}  "
                    f"held {row['held_px']} px"
                )
            for how, mask in MASKS.items():
                times_ms = [taken_ms(partial(mask, shape)) for shape in found]
                print(
                    f"  a mask{how} takes {min(times_ms):.0f} to {max(times_ms):.0f} ms "
                    f"(processor time, n {len(times_ms)})"
                )
            shadows = [shape.shadows for shape in found]
            right, all_found = (
                sum(getattr(s, n) for s in shadows) for n in ("right_px", "found_px")
            )
            seen, cast = (sum(getattr(s, n) for s in shadows) for n in ("cast_found_px", "cast_px"))
            print(
                f"  shadows: {seen / cast:.2f} of {cast} cast pixels found; "
                f"{right / all_found:.2f} of {all_found} found ones lack half of their light"
            )
    return rows


def _row(dataset: str, estimator: str, shape: ShapeContact) -> dict[str, object]:
    shadows = shape.shadows
    return {
        "dataset": dataset,
        "estimator": estimator,
        "shape": shape.name,
        "iou": shape.iou,
        "iou_by_slopes": iou(shape.by_slopes, shape.truth),
        "iou_with_true_depth": shape.exact_iou,
        "held_px": int(shape.truth.sum()),
        "shadow_precision": shadows.precision,
        "shadow_recall": shadows.recall,
        "shadow_cast_px": shadows.cast_px,
    }


def ball_rows(estimator: str) -> list[dict[str, object]]:
    """Labelled balls of the sets that are here, three-fold by press."""
    rows: list[dict[str, object]] = []
    for name in BALLS:
        try:
            folder = dataset_folder(name)
        except WedgeError:
            print(f"{name}: not here")
            continue
        dataset = read_dataset(folder)
        presses = read_presses(dataset).presses
        fitted = fit_folds(presses, estimator, "RGB", folds=FOLDS, seed=0)
        found = ball_overlaps(dataset, presses, fitted)
        ratio = float(np.mean([item.radius_ratio for item in found]))
        least = min(item.iou for item in found)
        rows.append(
            {"dataset": name, "presses": len(found), "iou": mean_iou(found), "radius_ratio": ratio}
        )
        print(
            f"{name}: {len(found)} balls, mean IoU {mean_iou(found):.3f}, least {least:.3f}, "
            f"radius found to labelled {ratio:.2f}"
        )
    return rows


def blank_rows(count: int) -> list[dict[str, object]]:
    """So many blank frames in all, shared among the sensors that are here."""
    folders = {}
    for name in BLANK_GELS:
        try:
            folders[name] = dataset_folder(name)
        except WedgeError:
            print(f"{name}: not here")
    each = -(-count // len(folders))
    rows: list[dict[str, object]] = []
    for name, folder in folders.items():
        touched = blank_frames_in_contact(read_dataset(folder), each)
        rows.append({"dataset": name, "frames": each, "in_contact": touched})
        print(f"{name}: {touched} of {each} blank frames taken for a contact")
    return rows


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.contact", description=__doc__)
    parser.add_argument(
        "--estimator", default="mlp,default", help="names, with commas between them"
    )
    parser.add_argument(
        "--twin",
        nargs=2,
        action="append",
        metavar=("FOLDER", "DESIGN"),
        help="shapes of this set in place of both; once for each set",
    )
    parser.add_argument("--balls", action="store_true", help="labelled balls too; minutes")
    parser.add_argument("--blanks", type=int, default=0, help="so many blank frames too")
    parser.add_argument("--json", type=Path, help="write the numbers here")
    options = parser.parse_args()
    estimators = [name for name in options.estimator.split(",") if name]
    with ending_in_a_sentence(parser):
        check_outputs(options.json)
        document = {
            "shapes": shape_rows(estimators, options.twin or TWINS),
            "balls": ball_rows(estimators[0]) if options.balls and estimators else [],
            "blanks": blank_rows(options.blanks) if options.blanks > 0 else [],
        }
        write_json(options.json, document)


if __name__ == "__main__":
    main()
