# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Ball presses that the frame cuts: what is left of the depth that they have uncut.

    python -m benchmarks.cut_contacts UNIT DATASET --presses 16

The slopes of a press are cut beside the ball's middle, before they become depth. For each edge, and
for frames that leave the same on two opposite sides, three numbers: the deepest point over that of
the uncut press in the same part of the frame, on average and in the worst press, and the root mean
square of the difference where the uncut press is deeper than 0.02 mm. Presses of which the cut
leaves less than 40 pixels are left out.

First it says how many of the set's presses and shapes are taken for cut as they are, in frames no
longer than the network sees.
"""

import argparse
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from recon.arrays import ContactMask, DepthMap, Difference, GradientField
from recon.calibration import Calibration, load_calibration
from recon.depth import depth_of
from recon.estimators import gradient_field
from recon.lights import unseen_axis
from recon.missing_axis.mirrored import rows_beyond
from recon.pipeline import disturbed_in
from recon.pixels import BallPress
from recon.presses import read_presses
from sensor.arguments import at_least, ending_in_a_sentence
from sensor.dataset import read_dataset
from validation.datasets import dataset_folder
from validation.shapes import DEEPER_THAN_MM, known_shapes

LEAST_PX = 40
Cut = tuple[slice, slice]


@dataclass(frozen=True, kw_only=True)
class Left:
    """What a cut leaves of a press."""

    share: float
    """The deepest point over the uncut press's."""
    rmse_mm: float


def cuts(press: BallPress, beside: float) -> Iterator[tuple[str, Cut]]:
    """Named parts of a frame; each ends so many contact radii from the ball's middle."""
    every, away = slice(None), beside * press.contact_radius_px
    (x, y) = press.center_px
    left, right, top, bottom = (
        max(0, round(place)) for place in (x - away, x + away, y - away, y + away)
    )
    yield "left", (every, slice(left, None))
    yield "right", (every, slice(right))
    yield "top", (slice(top, None), every)
    yield "bottom", (slice(bottom), every)
    yield "left and right", (every, slice(left, right))
    yield "top and bottom", (slice(top, bottom), every)


def depth_mm_of(unit: Calibration, gradient: GradientField, disturbed: ContactMask) -> DepthMap:
    """Depth by the unit's lights."""
    card = unit.card
    return depth_of(
        np.ascontiguousarray(gradient),
        np.ascontiguousarray(disturbed),
        unit.estimator,
        missing=card.missing_axis,
        lights_deg=card.lights_deg,
        mm_per_px=card.mm_per_px,
    ).depth_mm


def left_of(unit: Calibration, press: BallPress, beside: float) -> Iterator[tuple[str, Left]]:
    """What each cut leaves of a press."""
    gradient, disturbed = _seen(unit, press.difference)
    uncut_mm = depth_mm_of(unit, gradient, disturbed)
    for name, part in cuts(press, beside):
        wanted_mm = uncut_mm[part]
        deeper = wanted_mm > DEEPER_THAN_MM
        if min(wanted_mm.shape) < LEAST_PX or not deeper.any():
            continue
        found_mm = depth_mm_of(unit, gradient[part], disturbed[part])
        off_mm = (found_mm - wanted_mm)[deeper]
        share = float(found_mm[deeper].max() / wanted_mm.max())
        yield name, Left(share=share, rmse_mm=float(np.sqrt(np.mean(off_mm**2))))


def is_mirrored(unit: Calibration, difference: Difference) -> bool:
    """Whether an edge passes for one that cuts something, where lights leave an axis unseen."""
    unseen = unseen_axis(unit.card.lights_deg, unit.card.channels)
    if unseen is None:
        return False
    gradient, disturbed = _seen(unit, difference)
    return any(rows_beyond(disturbed, gradient, unseen, hinted=unit.estimator.looks_around))


def _seen(unit: Calibration, difference: Difference) -> tuple[GradientField, ContactMask]:
    """The slopes of a frame, and where its colours changed."""
    return gradient_field(unit.estimator, difference), disturbed_in(difference, unit.estimator)


def main() -> None:
    """Print a table."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.cut_contacts", description=__doc__)
    parser.add_argument("unit", type=Path)
    parser.add_argument("dataset")
    parser.add_argument("--presses", type=at_least(1), default=16)
    parser.add_argument("--beside", type=float, nargs="+", default=[0.0, 0.4, 0.9])
    asked = parser.parse_args()
    with ending_in_a_sentence(parser):
        dataset = read_dataset(dataset_folder(asked.dataset))
        every, shapes = read_presses(dataset).presses, list(known_shapes(dataset))
        unit = load_calibration(asked.unit)
        for name, touches in (("presses", every), ("shapes", shapes)):
            count = sum(is_mirrored(unit, touch.difference) for touch in touches)
            print(f"uncut: {count} of {len(touches)} {name} mirrored", flush=True)
        for beside in asked.beside:
            _print(unit, every[: asked.presses], beside)


def _print(unit: Calibration, presses: Sequence[BallPress], beside: float) -> None:
    found: dict[str, list[Left]] = {}
    for press in presses:
        for name, left in left_of(unit, press, beside):
            found.setdefault(name, []).append(left)
    for name, lefts in found.items():
        shares, rmses_mm = [left.share for left in lefts], [left.rmse_mm for left in lefts]
        least = max(shares, key=lambda share: abs(share - 1))
        print(
            f"{beside:4.1f} radii  {name:14} {len(lefts):3} presses  "
            f"{np.mean(shares):.2f} (worst {least:.2f}) of the peak  "
            f"{np.mean(rmses_mm):.4f} mm",
            flush=True,
        )


if __name__ == "__main__":
    main()
