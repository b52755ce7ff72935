# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Which frames are called implausible: presses, and the same mirrored or with colours swapped.

``python -m validation.plausible DATASET...`` teaches two thirds of a set's presses at a time, and
reconstructs the others as they are and altered, and one grey frame; rendered shapes, where the set
has some, by all presses. For each it counts what ``recon.plausible`` calls implausible, and says
what its limits are held against. ``--json FILE`` keeps the numbers.
"""

import argparse
import json
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from recon.arrays import ContactMask, Unwarped
from recon.calibration import lit_channels
from recon.estimators import GradientEstimator
from recon.images import read_frame
from recon.pipeline import Reconstruction, reconstruct
from recon.plausible import is_implausible, share_of_no_surface, shorter_side_mm
from recon.presses import press_reader, read_presses
from recon.rendered_presses import depth_files
from sensor.dataset import Dataset, read_dataset
from sensor.errors import WedgeError
from sensor.files import check_outputs, write_atomic
from validation.datasets import dataset_folder
from validation.folds import fit_folds, fit_presses

FOLDS = 3
SEED = 0
GREY = 100 / 255
Row = dict[str, Any]

ALTERED: Mapping[str, Callable[[Unwarped], Unwarped]] = {
    "as they are": lambda frame: frame,
    "mirrored": lambda frame: frame[:, ::-1],
    "upside down": lambda frame: frame[::-1],
    "blue for red": lambda frame: frame[..., ::-1],
}


def called_implausible(name: str, estimator: str) -> list[Row]:
    """A row for each kind of frame of a set.

    Raises:
        WedgeError: the set cannot be used.
    """
    dataset = read_dataset(dataset_folder(name))
    presses, reader = read_presses(dataset).presses, press_reader(dataset)
    channels, _ = lit_channels(dataset)
    found: dict[str, list[Reconstruction]] = {how: [] for how in (*ALTERED, "grey", "shapes")}
    for fold in fit_folds(presses, estimator, channels, folds=FOLDS, seed=SEED):
        for how, alter in ALTERED.items():
            for press in (presses[index] for index in fold.test):
                frame = alter(press.difference + reader.blank)
                hidden = None if press.hidden is None else alter(press.hidden[..., None])[..., 0]
                found[how].append(_touch(frame - reader.blank, fold.estimator, dataset, hidden))
        grey = np.full_like(reader.blank, GREY)
        found["grey"].append(_touch(grey - reader.blank, fold.estimator, dataset))
    shapes = list(_shapes(dataset))
    if shapes:
        fitted = fit_presses(presses, range(len(presses)), estimator, channels, SEED)
        differences = (reader.unwarp(read_frame(dataset.folder, x)) - reader.blank for x in shapes)
        found["shapes"] = [_touch(difference, fitted, dataset) for difference in differences]
    return [_row(name, estimator, how, touches) for how, touches in found.items() if touches]


def _shapes(dataset: Dataset) -> Iterator[str]:
    """The frames whose depth is known and that are no labelled presses."""
    labelled = {Path(label.file).stem for label in dataset.labels}
    for path in depth_files(dataset.folder):
        if path.stem not in labelled:
            yield f"{path.stem}.jpg"


def _touch(
    difference: Unwarped,
    fitted: GradientEstimator,
    dataset: Dataset,
    hidden: ContactMask | None = None,
) -> Reconstruction:
    return reconstruct(
        np.ascontiguousarray(difference, np.float32),
        fitted,
        missing=lit_channels(dataset)[1],
        lights_deg=dataset.card.lights_deg,
        mm_per_px=dataset.card.mm_per_px,
        hidden=hidden,
    )


def _row(name: str, estimator: str, how: str, touches: Sequence[Reconstruction]) -> Row:
    shares = [share_of_no_surface(touch) for touch in touches]
    depths = [touch.depth_mm / shorter_side_mm(touch) for touch in touches]
    return {
        "dataset": name,
        "estimator": estimator,
        "frames": how,
        "n": len(touches),
        "implausible": sum(map(is_implausible, touches)),
        "share of no surface, median": float(np.median(shares)),
        "most": max(shares),
        "deepest, of the shorter side": max(float(depth.max()) for depth in depths),
        "out of the gel, of it": max(float(-depth.min()) for depth in depths),
    }


def main() -> None:
    """Measure, print, and keep as JSON where asked."""
    parser = argparse.ArgumentParser(prog="python -m validation.plausible", description=__doc__)
    parser.add_argument("dataset", nargs="+", help="names of sets, or their folders")
    parser.add_argument("--estimator", default="default,mlp,table", help="with commas between them")
    parser.add_argument("--json", type=Path, help="write the numbers here")
    options = parser.parse_args()
    rows: list[Row] = []
    try:
        check_outputs(options.json)
        for name in options.dataset:
            for estimator in options.estimator.split(","):
                for row in called_implausible(name, estimator):
                    rows.append(row)
                    cells = (f"{x:.3f}" if isinstance(x, float) else str(x) for x in row.values())
                    print(
                        "  ".join(f"{k} {x}" for k, x in zip(row, cells, strict=True)), flush=True
                    )
        if options.json:
            write_atomic(options.json, (json.dumps(rows, indent=2) + "\n").encode())
    except WedgeError as error:
        sys.exit(str(error))


if __name__ == "__main__":
    main()
