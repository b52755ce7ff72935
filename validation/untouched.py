# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Is a ball found where nothing touches?

``python -m validation.untouched`` looks at real frames: those of the clips before anything is
gripped, by the force that was measured beside them; every set's blank frame as its camera would
see it again, with noise, flicker, drift, stains and JPEG (``validation.contact``); and what of
each labelled press lies farther than three radii from the ball, where shadows and the gel's bulge
remain. It prints one row a set and takes some minutes.
"""

import argparse
import operator
from collections.abc import Sequence
from concurrent.futures import Executor, ProcessPoolExecutor
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path
from typing import Literal

import numpy as np
from jaxtyping import Float32

from recon.arrays import Difference
from recon.images import read_frame
from recon.labels.find_circle import find_circle
from recon.presses import press_reader
from sensor.arguments import ending_in_a_sentence
from sensor.dataset import BallLabel, read_dataset
from sensor.files import check_outputs, write_json
from validation.contact import drifted, noisy
from validation.datasets import dataset_folder, on_this_machine
from validation.force import FORCES, measured_forces
from validation.importers.wedge_mit import CLIPS

Part = Float32[np.ndarray, "rows columns 3"]
Kind = Literal["before the grip", "seen again", "beside a press"]
LABELLED = ("taxim-gelsight", "known-depth", "wedge-lab")
SETS = (*LABELLED, "marker-balls-a", "marker-balls-b")
BALLS_MM = (1.5, 2.4, 4.0)
"""Radii that a clip's frames are searched for, as no ball of known size was pressed there."""
FREE_BELOW_N = 0.1
"""Of the force's reading at rest."""
CLEAR_OF_BALL = 3.0
"""Contact radii."""
LEAST_SIDE = 0.25
"""Of the frame's shorter side: a part with a shorter one is left out."""
JPEG_QUALITY = 90
SEEN_AGAIN = 20


@dataclass(frozen=True, kw_only=True)
class FalseCircles:
    """One set's row."""

    name: str
    kind: Kind
    searches: int
    found: tuple[str, ...]
    """Names of the frames on which a ball was found."""


def before_the_grip(name: str) -> FalseCircles:
    """Frames of a clip until the force first rises.

    Raises:
        WedgeError: the clip is not on this machine, or its forces are damaged.
    """
    reader = press_reader(read_dataset(dataset_folder(name)))
    folder, pitch = reader.dataset.folder, reader.dataset.card.mm_per_px
    gripped = np.abs(measured_forces(folder / FORCES)) > FREE_BELOW_N
    first = int(gripped.argmax()) if gripped.any() else len(gripped)
    found, searches = [], 0
    for path in sorted(folder.glob("frame-*.png")):
        if 0 < int(path.stem.removeprefix("frame-")) < first:
            difference = reader.unwarp(read_frame(folder, path.name)) - reader.blank
            balls = [find_circle(difference, ball_mm, pitch) for ball_mm in BALLS_MM]
            searches += len(balls)
            found += [path.name for ball in balls if ball is not None]
    return FalseCircles(name=name, kind="before the grip", searches=searches, found=tuple(found))


def seen_again(name: str, count: int = SEEN_AGAIN) -> FalseCircles:
    """A set's blank frame against noisy copies of it.

    Raises:
        WedgeError: the set is not on this machine.
    """
    reader = press_reader(read_dataset(dataset_folder(name)))
    card, rng = reader.dataset.card, np.random.default_rng(0)
    found = []
    for index in range(count):
        frame = noisy(drifted(reader.background, rng), JPEG_QUALITY, rng)
        if find_circle(reader.unwarp(frame) - reader.blank, card.ball_radius_mm, card.mm_per_px):
            found.append(f"copy {index}")
    return FalseCircles(name=name, kind="seen again", searches=count, found=tuple(found))


def beside_presses(name: str) -> FalseCircles:
    """The largest part of each press's frame that is clear of its ball.

    Raises:
        WedgeError: the set is not on this machine.
    """
    reader = press_reader(read_dataset(dataset_folder(name)))
    card, found, searches = reader.dataset.card, [], 0
    for label in reader.dataset.labels:
        difference = reader.unwarp(read_frame(reader.dataset.folder, label.file)) - reader.blank
        part = clear_part(difference, label)
        if part is not None:
            searches += 1
            if find_circle(part, reader.dataset.ball_radius_mm(label), card.mm_per_px):
                found.append(label.file)
    return FalseCircles(name=name, kind="beside a press", searches=searches, found=tuple(found))


def clear_part(difference: Difference, label: BallLabel) -> Part | None:
    """The largest of the four parts beside a ball, over the frame's whole width or height."""
    height, width = difference.shape[:2]
    reach = CLEAR_OF_BALL * label.contact_radius_px
    left, right = label.center_x_px - reach, label.center_x_px + reach
    top, bottom = label.center_y_px - reach, label.center_y_px + reach
    parts = (
        difference[:, : max(0, int(left))],
        difference[:, min(width, int(np.ceil(right))) :],
        difference[: max(0, int(top))],
        difference[min(height, int(np.ceil(bottom))) :],
    )
    wide = [x for x in parts if min(x.shape[:2]) >= LEAST_SIDE * min(height, width)]
    return np.ascontiguousarray(max(wide, key=lambda x: x.size)) if wide else None


def measure(pool: Executor) -> list[FalseCircles]:
    """Rows of all sets that this machine has.

    Raises:
        WedgeError: it has none, or one that cannot be read.
    """
    here = on_this_machine([*(clip.name for clip in CLIPS), *SETS])
    tasks = [partial(before_the_grip, clip.name) for clip in CLIPS if clip.name in here]
    tasks += [partial(seen_again, name) for name in SETS if name in here]
    tasks += [partial(beside_presses, name) for name in LABELLED if name in here]
    rows = []
    for row in pool.map(operator.call, tasks):
        rows.append(row)
        where = f": {', '.join(row.found)}" if row.found else ""
        print(f"{row.name}, {row.kind}: {len(row.found)} of {row.searches}{where}", flush=True)
    return rows


def _total(rows: Sequence[FalseCircles], kinds: Sequence[Kind]) -> str:
    chosen = [row for row in rows if row.kind in kinds]
    return f"{sum(len(x.found) for x in chosen)} of {sum(x.searches for x in chosen)}"


def main() -> None:
    """Measure, print, and write JSON where asked."""
    parser = argparse.ArgumentParser(prog="python -m validation.untouched", description=__doc__)
    parser.add_argument("--json", type=Path, help="write the numbers here")
    arguments = parser.parse_args()
    with ending_in_a_sentence(parser):
        check_outputs(arguments.json)
        with ProcessPoolExecutor(2) as pool:
            rows = measure(pool)
        write_json(arguments.json, [asdict(row) for row in rows])
    blank = _total(rows, ("before the grip", "seen again"))
    print(f"balls found on blank frames: {blank}; beside presses: ", end="")
    print(_total(rows, ("beside a press",)))


if __name__ == "__main__":
    main()
