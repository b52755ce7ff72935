# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Which frames are called implausible: presses, and the same mirrored or with colours swapped.

``python -m validation.plausible DATASET...`` teaches two thirds of a set's presses at a time, and
reconstructs the others as they are, fainter and altered, noisy blank frames and one grey one;
rendered shapes, where the set has some, by all presses. For each it counts what
``recon.plausible`` calls implausible, and says what its limits are held against. ``--json FILE``
keeps the numbers.
"""

import argparse
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import cycle
from pathlib import Path
from typing import Any

import numpy as np

from recon.arrays import ContactMask, Unwarped
from recon.calibration import lit_channels
from recon.estimators import GradientEstimator
from recon.integration.weighed import shorter_side_mm
from recon.lights import unseen_axis
from recon.pipeline import reconstruct
from recon.plausible import MOST_OFF, is_implausible, slopes_of_no_surface
from recon.presses import press_reader, read_presses
from sensor.arguments import ending_in_a_sentence
from sensor.dataset import Dataset, read_dataset
from sensor.files import check_outputs, write_json
from validation.contact import blank_frames
from validation.datasets import dataset_folder
from validation.folds import fit_folds, fit_presses
from validation.shapes import known_shapes

FOLDS = 3
SEED = 0
GRAY = 100 / 255
BLANKS = 20
"""Of each fold."""
FAINT = 0.2
"""Of a press's change of colour."""
Row = dict[str, Any]

ALTERED: Mapping[str, Callable[[Unwarped], Unwarped]] = {
    "as they are": lambda frame: frame,
    "mirrored": lambda frame: frame[:, ::-1],
    "upside down": lambda frame: frame[::-1],
    "blue for red": lambda frame: frame[..., ::-1],
}
KINDS = (*ALTERED, "blank", "faint", "gray", "shapes")


@dataclass(frozen=True, kw_only=True)
class Judged:
    """What the limits are held against in one frame."""

    implausible: bool
    off: float
    share: float
    """Both of ``slopes_of_no_surface``."""
    deepest: float
    highest: float
    """Out of the gel; both in shares of the frame's shorter side."""


def called_implausible(name: str, estimator: str) -> list[Row]:
    """A row for each kind of frame of a set.

    Raises:
        WedgeError: the set cannot be used.
    """
    dataset = read_dataset(dataset_folder(name))
    presses, reader = read_presses(dataset).presses, press_reader(dataset)
    channels, _ = lit_channels(dataset)
    found: dict[str, list[Judged]] = {how: [] for how in KINDS}
    for fold in fit_folds(presses, estimator, channels, folds=FOLDS, seed=SEED):
        for how, alter in ALTERED.items():
            for press in (presses[index] for index in fold.test):
                frame = alter(press.difference + reader.blank)
                hidden = None if press.hidden is None else alter(press.hidden[..., None])[..., 0]
                found[how].append(_judged(frame - reader.blank, fold.estimator, dataset, hidden))
        blanks = list(blank_frames(reader, BLANKS, SEED))
        found["blank"] += [_judged(x, fold.estimator, dataset, hidden) for x, hidden in blanks]
        for press, (blank, _) in zip((presses[i] for i in fold.test), cycle(blanks), strict=False):
            faint = blank + FAINT * press.difference
            found["faint"].append(_judged(faint, fold.estimator, dataset, press.hidden))
        gray = np.full_like(reader.blank, GRAY)
        found["gray"].append(_judged(gray - reader.blank, fold.estimator, dataset))
    shapes = [shape.difference for shape in known_shapes(dataset)]
    if shapes:
        fitted = fit_presses(presses, range(len(presses)), estimator, channels, SEED)
        found["shapes"] = [_judged(difference, fitted, dataset) for difference in shapes]
    return [_row(name, estimator, how, frames) for how, frames in found.items() if frames]


def _judged(
    difference: Unwarped,
    fitted: GradientEstimator,
    dataset: Dataset,
    hidden: ContactMask | None = None,
) -> Judged:
    touch = reconstruct(
        np.ascontiguousarray(difference, np.float32),
        fitted,
        missing=lit_channels(dataset)[1],
        lights_deg=dataset.card.lights_deg,
        mm_per_px=dataset.card.mm_per_px,
        hidden=hidden,
    )
    off, share = slopes_of_no_surface(touch)
    depth = touch.depth_mm / shorter_side_mm(touch.depth_mm.shape, touch.mm_per_px)
    return Judged(
        implausible=is_implausible(touch, unseen_axis(dataset.card.lights_deg, fitted.channels)),
        off=off,
        share=share,
        deepest=float(depth.max()),
        highest=float(-depth.min()),
    )


def _row(name: str, estimator: str, how: str, frames: Sequence[Judged]) -> Row:
    beyond = [frame.off for frame in frames if frame.share > MOST_OFF]
    return {
        "dataset": name,
        "estimator": estimator,
        "frames": how,
        "n": len(frames),
        "implausible": sum(frame.implausible for frame in frames),
        "share of no surface, median": float(np.median([frame.share for frame in frames])),
        "most": max(frame.share for frame in frames),
        "root mean square where it is too large, least": min(beyond, default=None),
        "largest": max(beyond, default=None),
        "deepest, of the shorter side": max(frame.deepest for frame in frames),
        "out of the gel, of it": max(frame.highest for frame in frames),
    }


def main() -> None:
    """Measure, print, and keep as JSON where asked."""
    parser = argparse.ArgumentParser(prog="python -m validation.plausible", description=__doc__)
    parser.add_argument("dataset", nargs="+", help="names of sets, or their folders")
    parser.add_argument("--estimator", default="default,mlp,table", help="with commas between them")
    parser.add_argument("--json", type=Path, help="write the numbers here")
    options = parser.parse_args()
    rows: list[Row] = []
    with ending_in_a_sentence(parser):
        check_outputs(options.json)
        for name in options.dataset:
            for estimator in options.estimator.split(","):
                for row in called_implausible(name, estimator):
                    rows.append(row)
                    cells = (f"{x:.3f}" if isinstance(x, float) else str(x) for x in row.values())
                    print(
                        "  ".join(f"{k} {x}" for k, x in zip(row, cells, strict=True)), flush=True
                    )
        write_json(options.json, rows)


if __name__ == "__main__":
    main()
